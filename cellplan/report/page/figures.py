"""Key figures of a page: the worst values, where and when."""

from typing import Any, Final

from cellplan.report.record.common import Entries, Record
from cellplan.report.record.numbers import against, fixed, floored, percent, seconds, small, stated
from cellplan.report.record.phases import is_of_phase, phase_key
from cellplan.report.record.sections.clearance import other_classes
from cellplan.report.text.notes import accuracy_note, clock_note

BETWEEN: Final = "_between_rows"  # part of the keys of errors there

Use = tuple[str, str, Record]  # robot, joint, and how it is used


def key_figures(record: Record) -> Entries:
    """The key figures of a run: its duration, its clearance, what is nearest to a limit, and its tool errors.

    Each has a ``label``, a ``value`` and a ``unit``; ``where``, ``at_s`` and ``phase`` of the worst; a ``note``. The
    joint that is nearest to any limit ``is_nearest``.
    """
    joints = [*_joint_figures(record), *_acceleration_figures(record)]
    nearest = max(joints, key=lambda joint: joint["used"], default=None)
    if nearest is not None:
        nearest["is_nearest"] = True
    return [
        _cycle_figure(record),
        _clearance_figure(record),
        *joints,
        *_closure_figures(record),
        *_error_figures(record["tasks"]),
    ]


def figure(label: str, value: str, unit: str, **further: Any) -> dict[str, Any]:
    """A figure with what templates ask of each."""
    absent = {"where": "", "at_s": None, "phase": "", "note": "", "is_bad": False, "is_nearest": False}
    return {"label": label, "value": value, "unit": unit, **absent, **further}


def _when(entry: Record, key: str) -> dict[str, Any]:
    """Time and phase of a figure."""
    return {"at_s": entry[key], "phase": entry.get(phase_key(key)) or ""}


def _cycle_figure(record: Record) -> dict[str, Any]:
    """Cycle time, and what determines it unless the cell file states it."""
    if is_of_phase(record):
        note = f"{record['samples']} samples, {small(1e3 * record['step_s'])} ms apart"
    else:
        note = f"{len(record['runs'])} {'phases' if record['cycles'] else 'runs'}, one after another"
    clock = clock_note(record)
    return figure("Cycle time", seconds(record["cycle_time_s"]), "s", note=f"{note}; {clock}" if clock else note)


def phase_errors(record: Record) -> dict[str, Entries]:
    """Largest position and orientation error of the tasks of each phase that has some, by the name of the phase."""
    by_phase: dict[str, dict[str, Record]] = {}
    for name, task in record["tasks"].items():
        by_phase.setdefault(task[phase_key("max_position_error_at_s")], {})[name] = task
    return {phase: _error_figures(tasks) for phase, tasks in by_phase.items()}


def _error_figures(tasks: Record) -> Entries:
    """Largest position and orientation error of some tasks."""
    if not tasks:
        return []
    return [_error_figure(tasks, name, unit) for name, unit in (("position", "mm"), ("orientation", "deg"))]


def _error_figure(tasks: Record, name: str, unit: str) -> dict[str, Any]:
    errors = [
        (entry[f"max_{name}_error{where}_{unit}"], where, task)
        for task, entry in tasks.items()
        for where in ("", BETWEEN)
        if f"max_{name}_error{where}_{unit}" in entry
    ]
    value, where, task = max(errors, key=lambda one: one[0])
    worst, allowed = tasks[task], tasks[task]["tolerance"][f"between_rows_{unit}" if where else f"{name}_{unit}"]
    return figure(
        f"Largest {name} error",
        against(value, allowed),
        unit,
        where=f"{task} ({worst['robot']})",
        **_when(worst, f"max_{name}_error{where}_at_s"),
        note=f"{'between the rows; ' if where else ''}allowed {stated(allowed)} {unit}",
        is_bad=value > allowed,
    )


def _closure_figures(record: Record) -> Entries:
    """Largest deviation of a co-holder's tool from its grasp."""
    closures = record["closure"]
    if not closures:
        return []
    robot = max(closures, key=lambda name: closures[name]["max_position_error_mm"])
    worst = closures[robot]
    value, allowed = worst["max_position_error_mm"], worst["allowed"]["position_mm"]
    closure = figure(
        "Largest closure error",
        against(value, allowed),
        "mm",
        where=robot,
        **_when(worst, "at_s"),
        note=f"allowed {stated(allowed)} mm",
        is_bad=value > allowed,
    )
    return [closure]


def _joint_figures(record: Record) -> Entries:
    """Smallest margin, of revolute joints unless only prismatic ones exceed their limits, and highest speed."""
    uses = _uses(record)
    bounded = [use for use in uses if use[2]["margin"] is not None]
    moving = [use for use in uses if use[2]["velocity_ratio"] is not None]
    figures: Entries = []
    if bounded:
        exceeded = [use for use in bounded if use[2]["margin"] < 0.0]
        revolute = [use for use in bounded if use[2]["unit"] == "deg"]
        shown = [use for use in revolute if use in exceeded] or exceeded or revolute or bounded
        figures.append(_margin_figure(min(shown, key=lambda use: use[2]["margin"])))
    if moving:
        figures.append(_speed_figure(max(moving, key=lambda use: use[2]["velocity_ratio"])))
    return figures


def _uses(record: Record) -> list[Use]:
    return [(robot, name, joint) for robot, named in record["joints"].items() for name, joint in named.items()]


def _margin_figure(use: Use) -> dict[str, Any]:
    robot, name, joint = use
    lower, upper = joint["lower"], joint["upper"]
    half = 0.5 * (upper - lower) if None not in (lower, upper) else 0.0
    return figure(
        "Smallest joint margin",
        floored(joint["margin"]),
        joint["unit"],
        where=f"{robot} {name}",
        **_when(joint, "margin_at_s"),
        note=f"allowed {fixed(lower, 1)} to {fixed(upper, 1)} {joint['unit']}",
        is_bad=joint["margin"] < 0.0,
        used=1.0 - joint["margin"] / half if half > 0.0 else 0.0,
    )


def _speed_figure(use: Use) -> dict[str, Any]:
    robot, name, joint = use
    return figure(
        "Highest joint speed",
        percent(joint["velocity_ratio"], 1).removesuffix(" %"),
        "% of limit",
        where=f"{robot} {name}",
        **_when(joint, "peak_velocity_at_s"),
        note=f"{fixed(joint['peak_velocity'], 1)} of {fixed(joint['velocity_limit'], 1)} {joint['unit']}/s",
        is_bad=joint["velocity_ratio"] > 1.0,
        used=joint["velocity_ratio"],
    )


def _acceleration_figures(record: Record) -> Entries:
    """The joint with the largest fraction of its limit; nothing if no joint has one."""
    limited = [use for use in _uses(record) if use[2].get("acceleration_ratio") is not None]
    if not limited:
        return []
    robot, name, joint = max(limited, key=lambda use: use[2]["acceleration_ratio"])
    ratio, is_assumed = joint["acceleration_ratio"], joint["acceleration_limit_source"] == "assumed"
    highest = figure(
        "Highest joint acceleration",
        percent(ratio, 1).removesuffix(" %"),
        f"% of {'assumed' if is_assumed else 'stated'} limit",
        where=f"{robot} {name}",
        **_when(joint, "peak_acceleration_at_s"),
        note=f"{fixed(joint['peak_acceleration'])} of {fixed(joint['acceleration_limit'])} {joint['unit']}/s²",
        is_bad=ratio > 1.0,
        used=ratio,
    )
    return [highest]


def _clearance_figure(record: Record) -> dict[str, Any]:
    whole, required = record["clearance"]["whole"], f"required {stated(record['required_clearance_mm'])} mm"
    value = floored(whole["minimum_mm"])
    if whole["minimum_mm"] is None:
        return figure("Smallest clearance", value, "mm", note=required)
    rests_on = accuracy_note(whole["pair"] or (), whole["accuracies_mm"])
    classes = other_classes(record["clearance"])
    others = [f"{words} {floored(minimum['minimum_mm'])} mm" for words, minimum in classes.items()]
    return figure(
        "Smallest clearance",
        value if whole["exact"] else f"at least {value}",
        "mm",
        where=" and ".join(whole["pair"] or ()),
        **_when(whole, "at_s"),
        note="; ".join([required, *([rests_on] if rests_on else []), *others]),
        is_bad=whole["minimum_mm"] < record["required_clearance_mm"],
    )
