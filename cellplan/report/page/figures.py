"""Key figures of a page: the worst values, where and when."""

from typing import Any, Final

from cellplan.report.page.filters import fixed, floored, percent, small
from cellplan.report.record.common import Entries, Record
from cellplan.report.text.notes import accuracy_note, clock_note

BETWEEN: Final = "_between_rows"  # part of the keys of errors there


def _clock_text(record: Record) -> str:
    """What determines the duration, unless the cell file states it."""
    note = clock_note(record)
    return f"; {note}" if note else ""


def key_figures(record: Record) -> Entries:
    """The key figures of a run."""
    cycle = {
        "label": "Cycle time",
        "value": fixed(record["cycle_time_s"], 2),
        "unit": "s",
        "detail": f"{record['samples']} samples, {small(1e3 * record['step_s'])} ms apart{_clock_text(record)}"
        if "samples" in record
        else f"{len(record['runs'])} {'phases' if record['cycles'] else 'runs'}, one after another",
    }
    return [
        cycle,
        *_error_figures(record["tasks"]),
        *_closure_figures(record["closure"]),
        *_joint_figures(record["joints"]),
        *_acceleration_figures(record["joints"]),
        _clearance_figure(record),
    ]


def _error_figures(tasks: Record) -> Entries:
    """Largest position and orientation error of all tasks."""
    return [_error_figure(tasks, "position", "mm"), _error_figure(tasks, "orientation", "deg")] if tasks else []


def _error_figure(tasks: Record, name: str, unit: str) -> dict[str, Any]:
    found = [
        (record[f"max_{name}_error{where}_{unit}"], where, task)
        for task, record in tasks.items()
        for where in ("", BETWEEN)
        if f"max_{name}_error{where}_{unit}" in record
    ]
    value, where, task = max(found, key=lambda one: one[0])
    worst, allowed = tasks[task], tasks[task]["tolerance"][f"between_rows_{unit}" if where else f"{name}_{unit}"]
    return {
        "label": f"Largest {name} error",
        "value": small(value),
        "unit": unit,
        "detail": f"{task} ({worst['robot']}) at {fixed(worst[f'max_{name}_error{where}_at_s'], 3)} s"
        f"{', between the rows' if where else ''}; allowed {small(allowed)} {unit}",
        "is_bad": value > allowed,
    }


def _closure_figures(closures: Record) -> Entries:
    """Largest deviation of a co-holder's tool from its grasp."""
    if not closures:
        return []
    robot = max(closures, key=lambda name: closures[name]["max_position_error_mm"])
    worst = closures[robot]
    allowed = worst["allowed"]["position_mm"]
    return [
        {
            "label": "Largest closure error",
            "value": small(worst["max_position_error_mm"]),
            "unit": "mm",
            "detail": f"{robot} at {fixed(worst['at_s'], 3)} s; allowed {small(allowed)} mm",
            "is_bad": worst["max_position_error_mm"] > allowed,
        }
    ]


def _joint_figures(joints: Record) -> Entries:
    """Smallest margin, of revolute joints unless only prismatic ones exceed their limits, and highest speed."""
    uses = [(robot, name, joint) for robot, named in joints.items() for name, joint in named.items()]
    figures: Entries = []
    bounded = [use for use in uses if use[2]["margin"] is not None]
    revolute = [use for use in bounded if use[2]["unit"] == "deg"]
    if bounded:
        exceeded = [use for use in bounded if use[2]["margin"] < 0.0]
        shown = [use for use in revolute if use in exceeded] or exceeded or revolute or bounded
        robot, name, joint = min(shown, key=lambda use: use[2]["margin"])
        figures.append(
            {
                "label": "Smallest joint margin",
                "value": floored(joint["margin"]),
                "unit": joint["unit"],
                "detail": f"{robot} {name} at {fixed(joint['margin_at_s'], 3)} s; "
                f"allowed {fixed(joint['lower'], 1)} to {fixed(joint['upper'], 1)} {joint['unit']}",
                "is_bad": joint["margin"] < 0.0,
            }
        )
    moving = [use for use in uses if use[2]["velocity_ratio"] is not None]
    if moving:
        robot, name, joint = max(moving, key=lambda use: use[2]["velocity_ratio"])
        figures.append(
            {
                "label": "Highest joint speed",
                "value": percent(joint["velocity_ratio"]).removesuffix(" %"),
                "unit": "% of limit",
                "detail": f"{robot} {name} at {fixed(joint['peak_velocity_at_s'], 3)} s; "
                f"{fixed(joint['peak_velocity'], 1)} of {fixed(joint['velocity_limit'], 1)} {joint['unit']}/s",
                "is_bad": joint["velocity_ratio"] > 1.0,
            }
        )
    return figures


def _clearance_figure(record: Record) -> dict[str, Any]:
    whole = record["clearance"]["whole"]
    required = f"required {small(record['required_clearance_mm'])} mm"
    figure = {"label": "Smallest clearance", "value": floored(whole["minimum_mm"]), "unit": "mm", "detail": required}
    if whole["minimum_mm"] is not None:
        where, rests_on = " and ".join(whole["pair"] or ()), accuracy_note(whole["pair"] or (), whole["accuracies_mm"])
        figure["detail"] = f"{where} at {fixed(whole['at_s'], 3)} s; {required}{f'; {rests_on}' if rests_on else ''}"
        figure["is_bad"] = whole["minimum_mm"] < record["required_clearance_mm"]
        figure["value"] = figure["value"] if whole["exact"] else f"at least {figure['value']}"
    return figure


def _acceleration_figures(joints: Record) -> Entries:
    """The joint with the largest fraction of its limit; nothing if no joint has one."""
    uses = [(robot, name, joint) for robot, named in joints.items() for name, joint in named.items()]
    limited = [use for use in uses if use[2].get("acceleration_ratio") is not None]
    if not limited:
        return []
    robot, name, joint = max(limited, key=lambda use: use[2]["acceleration_ratio"])
    ratio, is_assumed = joint["acceleration_ratio"], joint["acceleration_limit_source"] == "assumed"
    is_bad = ratio > 1.0
    return [
        {
            "label": "Highest joint acceleration",
            "value": f"{100.0 * ratio:.4g}" if is_bad else f"{100.0 * ratio:.0f}",
            "unit": f"% of {'assumed' if is_assumed else 'stated'} limit",
            "detail": f"{robot} {name} at {joint['peak_acceleration_at_s']:.3f} s; "
            f"{joint['peak_acceleration']:.1f} of {joint['acceleration_limit']:.1f} {joint['unit']}/s²",
            "is_bad": is_bad,
        }
    ]
