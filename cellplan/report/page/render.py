"""``report.html``: the verdict of a run and everything behind it, as one page that needs nothing but itself."""

import math
import re
from collections.abc import Iterable, Mapping
from functools import cache

from jinja2 import Environment, PackageLoader, StrictUndefined

from cellplan.model.cell import Cell
from cellplan.model.motion import Motion
from cellplan.model.rehearsal import Rehearsal
from cellplan.model.report import Check, Report
from cellplan.report.plots.palette import ROBOTS, robot_colours
from cellplan.report.record.acceleration_figures import acceleration_figures
from cellplan.report.record.clock import clock_words
from cellplan.report.record.left_out import grips_told, told_left_out
from cellplan.report.record.method import method_lines
from cellplan.report.record.open_surfaces import open_surface_lines
from cellplan.report.record.rehearsal import rehearsal_record
from cellplan.report.record.rests_on import good_to
from cellplan.report.record.run import Provenance, Record, rounded_down
from cellplan.report.record.task import direction_words
from cellplan.report.record.write import run_record, summary_record

MODES = {
    "simultaneous": "all robots move",
    "pairwise": "the positioner and one operator move at a time",
    "part_at_rest": "the positioner stands still",
}
CHECKS = {
    "joint_position": "joint positions within their limits",
    "joint_velocity": "joint velocities within their limits",
    "joint_acceleration": "joint accelerations within their limits",
    "joint_acceleration_assumed": "joint accelerations within assumed limits",
    "joint_jerk": "joint jerk within its limits",
    "part_acceleration": "acceleration of the part within its limit",
    "locked_joint": "joints that failed stand still",
    "position_error": "tool position on the part within tolerance",
    "orientation_error": "tool orientation on the part within tolerance",
    "position_error_between_rows": "tool position within tolerance between the rows",
    "orientation_error_between_rows": "tool orientation within tolerance between the rows",
    "closure_position_error_between_rows": "further holders' tools on their grasps between the rows",
    "closure_orientation_error_between_rows": "further holders' tools turned as they grasp between the rows",
    "closure_position_error": "further holders' tools on their grasps",
    "closure_orientation_error": "further holders' tools turned as they grasp",
    "tool_depth": "tools no deeper in the part than allowed",
    "joint_drift": "joints back where each cycle began",
    "clearance": "required clearance kept",
    "payload": "tool and part within the payload",
    "payload_centre": "centre of the load within its distances",
    "payload_moment": "moments of the load on the wrist within their limits",
    "payload_inertia": "inertia of the load on the wrist within its limits",
    "collision": "no collision",
    "grip_depth": "holders no deeper in the part than their grip",
    "mount_depth": "tools no deeper in the arm than their mounting",
    "standing_depth": "what stands no deeper in what carries it than allowed",
}
CLASSES = {
    "whole": "whole cell",
    "robot_robot": "robot to robot",
    "self": "robot to itself",
    "part": "part",
    "environment": "environment",
}
EXECUTION_TITLES = {
    "before": "as solved",
    "after": "corrected from pass to pass",
    "in_pass": "corrected within the pass",
}
OUTCOMES = {
    "converged": "converged",
    "stalled": "does not converge: the error falls no more and is beyond the tolerance",
    "diverged": "does not converge: the error grew, or the corrected references cannot be followed",
    "unfinished": "not converged yet: the rounds are used up",
}
BETWEEN = "_between_rows"  # part of the names of errors there
MANY = 8  # [-] robots; with more, pictures and long lists are folded and each robot has a line of its own
NARROW = 0.05  # [-] of the half range: a joint whose margin is smaller is marked
FAST = 0.95  # [-] of the speed limit: likewise
SMALLEST_SHOWN = 1e-6  # [mm] or [deg]: below it more digits tell nothing
LEAST_PLAIN = 1e-4  # [-] of a manipulability: smaller ones are shown with a power of ten


def report_html(
    report: Report, *, cell: Cell, provenance: Provenance, plots: Mapping[str, bytes], motion: Motion | None = None
) -> str:
    """The page of one run.

    Args:
        report: The run.
        cell: Its cell.
        provenance: Where the result comes from.
        plots: SVG pictures by file name, as ``draw_plots`` returns them; others are ignored.
        motion: The motion as it was planned, for what its steps took; None when it is not at hand.
    """
    return report_page(
        run_record(report, cell=cell, provenance=provenance, motion=motion), report.checks, cell=cell, plots=plots
    )


def report_page(record: Record, checks: Iterable[Check], *, cell: Cell, plots: Mapping[str, bytes]) -> str:
    """The page of a run whose record, as ``run_record`` gives it, and checks are at hand; see ``report_html``."""
    return _render(
        "report.html",
        record,
        cell,
        {
            "figures": _figures(record),
            "left_out": told_left_out(record),
            "grips": grips_told(record),
            "check_groups": _check_groups(checks),
            "shares": _shares(record),
            "excluded": _by_reason(record["exclusions"]),
            "open_surfaces": [line for _, line in open_surface_lines(record["open_surfaces"])],
            "method": list(method_lines(record["solver"], record["step_s"])),
            "plots": _inline_plots(plots),
        },
    )


def overview_html(reports: Mapping[str, Report], *, cell: Cell, provenance: Provenance) -> str:
    """The page of a job done in several runs, with a link to the page of each; see ``summary_record``."""
    return overview_page(summary_record(reports, cell=cell, provenance=provenance), cell=cell)


def overview_page(record: Record, *, cell: Cell) -> str:
    """The page of a job of several runs whose record is at hand; see ``overview_html``."""
    parts = {"figures": _figures(record), "left_out": told_left_out(record), "grips": grips_told(record)}
    return _render("overview.html", record, cell, parts)


def rehearsal_html(rehearsal: Rehearsal, *, provenance: Provenance, plots: Mapping[str, bytes]) -> str:
    """The page of a rehearsal; ``plots`` as ``draw_rehearsal`` returns them."""
    record = rehearsal_record(rehearsal, provenance=provenance)
    parts = {"plots": _inline_plots(plots), "executions": EXECUTION_TITLES, "outcomes": OUTCOMES}
    return _render("rehearsal.html", record, rehearsal.cell, parts)


def _render(template: str, record: Record, cell: Cell, parts: Mapping[str, object]) -> str:
    words = {"modes": MODES, "classes": CLASSES, "narrow": NARROW, "fast": FAST, "many": len(cell.robots) > MANY}
    colours = robot_colours(cell)
    return _environment().get_template(template).render(r=record, colours=colours, ink=ROBOTS[-1], **words, **parts)


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("cellplan.report.page", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "fixed": _fixed,
        "small": _small,
        "power": _power,
        "percent": _percent,
        "floored": _floored,
        "range_bar": _range_bar,
        "way_round": direction_words,
        "worst": _worst,
    }
    return environment


def _fixed(value: float | None, digits: int = 1) -> str:
    """The value with so many decimals; a dash where there is none."""
    if value is None:
        return "–"
    text = f"{value:.{digits}f}"
    return f"{0.0:.{digits}f}" if float(text) == 0.0 else text.replace("-", "−")


def _small(value: float | None) -> str:
    """The value with three telling digits, never with an exponent."""
    if value is None:
        return "–"
    if value == 0.0:
        return "0"
    if abs(value) < SMALLEST_SHOWN:
        return f"< {SMALLEST_SHOWN:.6f}"
    text = f"{float(f'{value:.3g}'):.9f}".rstrip("0").rstrip(".")
    return text.replace("-", "−")


def _power(value: float | None) -> str:
    """The value with three telling digits, small ones as a multiple of a power of ten."""
    if value is None or value == 0.0 or abs(value) >= LEAST_PLAIN:
        return _small(value)
    digits, _, exponent = f"{value:.2e}".partition("e")
    return f"{digits} · 10^{int(exponent)}".replace("-", "−")


def _floored(value: float | None) -> str:
    return "–" if value is None else _fixed(rounded_down(value), 1)


def _percent(value: float | None, digits: int = 0) -> str:
    """A share as a percentage, with more digits where rounding would hide on which side of the whole it lies."""
    if value is None:
        return "–"
    return f"{_fixed(100.0 * value, 2 if value != 1.0 and abs(value - 1.0) < 0.01 else digits)} %"


def _range_bar(joint: Record) -> Record | None:
    """Where the limits and the reached range of a joint lie on a bar from 0 to 100; None for an endless joint."""
    lower, upper = joint["lower"], joint["upper"]
    if lower is None or upper is None:
        return None
    left, right = min(lower, joint["min"]), max(upper, joint["max"])
    scale = 100.0 / ((right - left) or 1.0)
    places = {"lower": lower, "upper": upper, "min": joint["min"], "max": joint["max"]}
    return {name: round(scale * (value - left), 2) for name, value in places.items()}


def _worst(joints: Record) -> Record:
    """The joint of a robot with the smallest share of its range left, and the one nearest to its top speed.

    Both carry their name; None stands for a robot without such a joint. A speed without a share is beyond all limits.
    """
    named = [{"name": name, **joint} for name, joint in joints.items()]
    bounded = [joint for joint in named if None not in (joint["margin"], joint["lower"], joint["upper"])]
    near = min(bounded, key=lambda joint: joint["margin"] / ((joint["upper"] - joint["lower"]) or 1.0), default=None)
    return {"near": near, "fast": max(named, key=_speed_share, default=None)}


def _speed_share(joint: Record) -> float:
    share = joint["velocity_ratio"]
    return math.inf if share is None else float(share)


def _clock_word(record: Record) -> str:
    """What decides the length of the clock, unless the cell file states it."""
    words = clock_words(record["clock_from"])
    return f"; {words}" if words else ""


def _figures(record: Record) -> list[Record]:
    """The key figures: what is worst, where and when."""
    cycle = {
        "label": "Cycle time",
        "value": _fixed(record["cycle_time_s"], 2),
        "unit": "s",
        "detail": f"{record['samples']} samples, {_small(1e3 * record['step_s'])} ms apart{_clock_word(record)}"
        if "samples" in record
        else f"{len(record['runs'])} runs, one after another",
    }
    return [
        cycle,
        *_error_figures(record["tasks"]),
        *_closure_figures(record["closure"]),
        *_joint_figures(record["joints"]),
        *acceleration_figures(record["joints"]),
        _clearance_figure(record),
    ]


def _error_figures(tasks: Record) -> list[Record]:
    """Largest position and orientation error of all tasks."""
    return [_error_figure(tasks, "position", "mm"), _error_figure(tasks, "orientation", "deg")] if tasks else []


def _error_figure(tasks: Record, name: str, unit: str) -> Record:
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
        "value": _small(value),
        "unit": unit,
        "detail": f"{task} ({worst['robot']}) at {_fixed(worst[f'max_{name}_error{where}_at_s'], 3)} s"
        f"{', between the rows' if where else ''}; allowed {_small(allowed)} {unit}",
        "is_bad": value > allowed,
    }


def _closure_figures(closures: Record) -> list[Record]:
    """Largest distance of a further holder's tool from its grasp."""
    if not closures:
        return []
    robot = max(closures, key=lambda name: closures[name]["max_position_error_mm"])
    worst = closures[robot]
    allowed = worst["allowed"]["position_mm"]
    return [
        {
            "label": "Largest closure error",
            "value": _small(worst["max_position_error_mm"]),
            "unit": "mm",
            "detail": f"{robot} at {_fixed(worst['at_s'], 3)} s; allowed {_small(allowed)} mm",
            "is_bad": worst["max_position_error_mm"] > allowed,
        }
    ]


def _joint_figures(joints: Record) -> list[Record]:
    """Smallest joint margin, of turning joints unless only sliding ones break theirs, and highest share of a speed."""
    uses = [(robot, name, joint) for robot, named in joints.items() for name, joint in named.items()]
    figures = []
    bounded = [use for use in uses if use[2]["margin"] is not None]
    turning = [use for use in bounded if use[2]["unit"] == "deg"]
    if bounded:
        broken = [use for use in bounded if use[2]["margin"] < 0.0]
        shown = [use for use in turning if use in broken] or broken or turning or bounded
        robot, name, joint = min(shown, key=lambda use: use[2]["margin"])
        figures.append(
            {
                "label": "Smallest joint margin",
                "value": _floored(joint["margin"]),
                "unit": joint["unit"],
                "detail": f"{robot} {name} at {_fixed(joint['margin_at_s'], 3)} s; "
                f"allowed {_fixed(joint['lower'], 1)} to {_fixed(joint['upper'], 1)} {joint['unit']}",
                "is_bad": joint["margin"] < 0.0,
            }
        )
    moving = [use for use in uses if use[2]["velocity_ratio"] is not None]
    if moving:
        robot, name, joint = max(moving, key=lambda use: use[2]["velocity_ratio"])
        figures.append(
            {
                "label": "Highest joint speed",
                "value": _percent(joint["velocity_ratio"]).removesuffix(" %"),
                "unit": "% of limit",
                "detail": f"{robot} {name} at {_fixed(joint['peak_velocity_at_s'], 3)} s; "
                f"{_fixed(joint['peak_velocity'], 1)} of {_fixed(joint['velocity_limit'], 1)} {joint['unit']}/s",
                "is_bad": joint["velocity_ratio"] > 1.0,
            }
        )
    return figures


def _clearance_figure(record: Record) -> Record:
    whole = record["clearance"]["whole"]
    required = f"required {_small(record['required_clearance_mm'])} mm"
    figure = {"label": "Smallest clearance", "value": _floored(whole["minimum_mm"]), "unit": "mm", "detail": required}
    if whole["minimum_mm"] is not None:
        where, rests_on = " and ".join(whole["pair"] or ()), good_to(whole["pair"] or (), whole["accuracies_mm"])
        figure["detail"] = f"{where} at {_fixed(whole['at_s'], 3)} s; {required}{f'; {rests_on}' if rests_on else ''}"
        figure["is_bad"] = whole["minimum_mm"] < record["required_clearance_mm"]
        figure["value"] = figure["value"] if whole["exact"] else f"at least {figure['value']}"
    return figure


def _check_groups(checks: Iterable[Check]) -> list[Record]:
    """How many checks of each kind passed, in the order in which they were made."""
    groups: dict[str, Record] = {}
    for check in checks:
        title = CHECKS.get(check.name, check.name.replace("_", " "))
        group = groups.setdefault(check.name, {"title": title, "count": 0, "passed": 0})
        group["count"] += 1
        group["passed"] += check.passed
    return list(groups.values())


def _shares(record: Record) -> list[Record]:
    """Share of all motion of the positioners and of the operators together."""
    holders = [entry for entry in record["motion_share"].values() if entry["role"] == "positioner"]
    totals = {"positioner": 0.0, "operator": 0.0, "idle": 0.0}
    for entry in record["motion_share"].values():
        totals[entry["role"]] += entry["share"] or 0.0
    names = {
        "positioner": "positioner" if len(holders) < 2 else "positioners",
        "operator": "operators",
        "idle": "robots without a task",
    }
    return [{"name": names[role], "share": share} for role, share in totals.items() if share > 0.0]


def _by_reason(exclusions: Iterable[Record]) -> dict[str, list[str]]:
    """Pairs that were not checked, by reason."""
    groups: dict[str, list[str]] = {}
    for exclusion in exclusions:
        groups.setdefault(exclusion["reason"], []).append(" – ".join(exclusion["pair"]))
    return groups


def _inline_plots(plots: Mapping[str, bytes]) -> dict[str, str]:
    """SVG pictures ready to stand in the page, by file name without its ending."""
    drawings = {name.removesuffix(".svg"): data for name, data in plots.items() if name.endswith(".svg")}
    return {name: inline_svg(data.decode(), prefix=f"p{i}-") for i, (name, data) in enumerate(drawings.items())}


def inline_svg(text: str, *, prefix: str) -> str:
    """The drawing without its file header, with names of its own so that several can share a page."""
    body = text[text.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>|<style.*?</style>", "", body, flags=re.DOTALL)
    head, rest = body.split(">", 1)
    head = re.sub(r'\s(?:width|height)="[^"]*"', "", head) + ' aria-hidden="true" focusable="false"'
    rest = re.sub(r'\bid="', f'id="{prefix}', rest)
    rest = re.sub(r'(url\(|href=")#', rf"\g<1>#{prefix}", rest)
    return f"{head}>{rest}"
