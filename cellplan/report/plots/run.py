"""Plots of a run: task errors, joint positions and speeds with their limits drawn, clearance over time."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell
from cellplan.model.report import ClearanceClass, ClosureAccuracy, Conditioning, JointUse, Report, TaskAccuracy
from cellplan.model.task import Frame
from cellplan.report.plots import palette
from cellplan.report.plots.palette import INK, LIMIT
from cellplan.report.plots.sheet import Sheet
from cellplan.report.record.common import rounded_down

JOINT_COLUMNS = 3
MIN_IN_UNIT = 0.5  # [-] of an error in its unit: a larger unit is not chosen below
LEAST_PLAIN, SMALLEST_DRAWN = 1e-2, 1e-200  # [-] of a manipulability: below, in powers of ten; below, as zero
MAX_TITLE_LETTERS = 29  # [-] letters beside which the whole note has room in one of three columns
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
CLASS_TITLES: Mapping[ClearanceClass, str] = {
    ClearanceClass.ROBOT_ROBOT: "robot to robot",
    ClearanceClass.SELF: "robot to itself",
    ClearanceClass.PART: "part",
    ClearanceClass.ENVIRONMENT: "environment",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ErrorKind:
    """How an error is shown: its name, units from large to small as (name, factor from SI), and axis names."""

    name: str
    units: tuple[tuple[str, float], ...]
    axes: tuple[str, str, str]


POSITION = ErrorKind(name="position error", units=(("mm", 1e3), ("µm", 1e6), ("nm", 1e9)), axes=("x", "y", "z"))
ORIENTATION = ErrorKind(
    name="orientation error",
    units=(
        ("deg", math.degrees(1.0)),
        ("10⁻³ deg", math.degrees(1e3)),
        ("10⁻⁶ deg", math.degrees(1e6)),
    ),
    axes=("rx", "ry", "rz"),
)


def run_sheets(report: Report, *, cell: Cell) -> dict[str, Sheet]:
    """All plots of one run by name (``task_<task>``, ``positions_<robot>``, …).

    Args:
        report: What is drawn.
        cell: Where tolerances, the required clearance and the order of the robots come from.
    """
    sheets: dict[str, Sheet] = {}
    colours = palette.robot_colours(cell)
    for accuracy in report.accuracy:
        sheets[f"task_{accuracy.task}"] = _task_sheet(accuracy, report.times, cell)
    for closure in report.closures:
        sheets[f"closure_{closure.robot}"] = _closure_sheet(closure, report.times, cell)
    for robot in report.q if report.tasks else _moving(report):
        uses = [use for use in report.joints if use.robot == robot]
        sheets[f"positions_{robot}"] = _positions_sheet(robot, uses, report, colours[robot])
        sheets[f"velocities_{robot}"] = _velocities_sheet(robot, uses, report, colours[robot])
    if report.conditioning is not None:
        sheets["singularity"] = _singularity_sheet(report.conditioning, report.times, colours)
    sheets["clearance"] = _clearance_sheet(report, cell.checks.clearance)
    return sheets


def _moving(report: Report) -> list[str]:
    """Names of the robots that move at all."""
    return [name for name, q in report.q.items() if np.any(q != q[0])]


def _task_sheet(accuracy: TaskAccuracy, times: Array, cell: Cell) -> Sheet:
    """Total and per-axis error of position and orientation."""
    tolerance = cell.task(accuracy.task).tolerance
    place = "on the part" if cell.task(accuracy.task).relative_to is Frame.PART else "in the world"
    sheet = Sheet(f"{accuracy.task} ({accuracy.robot}): tool error {place}", rows=2, columns=2, times=times)
    draw_error(sheet, 0, accuracy.position_error, allowed=tolerance.position, kind=POSITION)
    draw_error(sheet, 1, accuracy.orientation_error, allowed=tolerance.orientation, kind=ORIENTATION)
    return sheet


def _closure_sheet(closure: ClosureAccuracy, times: Array, cell: Cell) -> Sheet:
    """Total and per-axis error of the tool of a further holder on its grasp."""
    checks = cell.checks
    sheet = Sheet(f"{closure.robot}: closure error at its grasp", rows=2, columns=2, times=times)
    draw_error(sheet, 0, closure.position_error, allowed=checks.closure_position, kind=POSITION)
    draw_error(sheet, 1, closure.orientation_error, allowed=checks.closure_orientation, kind=ORIENTATION)
    return sheet


def draw_error(sheet: Sheet, row: int, error: Array, *, allowed: float, kind: ErrorKind) -> None:
    """One row: the total, with the tolerance where it lies within the picture, and the three axes beside it.

    Ripples below the smallest unit are not blown up to fill the picture.
    """
    total = np.linalg.norm(error, axis=1)
    largest = float(total.max())
    unit, scale = readable_unit(largest, kind.units)
    main_unit, main_scale = kind.units[0]
    is_in_sight = allowed <= 4.0 * largest or largest == 0.0
    highest = scale * (max(largest, allowed) if is_in_sight else largest)
    is_ripple = scale * largest < MIN_IN_UNIT
    least = (scale * allowed if is_in_sight else 1.0) if is_ripple else 0.0
    span = (0.0, max(highest, least))
    note = f"tolerance {allowed * main_scale:.6g} {main_unit}{'' if is_in_sight else ', off the scale'}"
    panel = sheet.panel(2 * row, f"{kind.name}, total, in {unit}", note=note, span=span, is_floored=True)
    if is_in_sight:
        sheet.limit(panel, scale * allowed)
    sheet.curve(panel, sheet.times, scale * total, colour=INK)
    sheet.dot(panel, float(sheet.times[total.argmax()]), scale * largest, colour=LIMIT if largest > allowed else INK)

    reach = max(scale * float(np.abs(error).max()), least)
    panel = sheet.panel(2 * row + 1, f"{kind.name} by axis, in {unit}", span=(-reach, reach))
    for i, (axis, colour) in enumerate(zip(kind.axes, palette.AXES, strict=True)):
        sheet.curve(panel, sheet.times, scale * error[:, i], colour=colour, width=1.1)
        x, y = panel.left + panel.width - 0.25 * (2 - i), panel.bottom + panel.height + 0.07
        sheet.write(x, y, axis, size=8.5, color=colour, weight="bold", ha="right")


def readable_unit(largest: float, units: tuple[tuple[str, float], ...]) -> tuple[str, float]:
    """The largest unit in which the value is at least one half, or the smallest of all; the first one for zero."""
    if largest == 0.0:
        return units[0]
    return next((unit for unit in units if largest * unit[1] >= MIN_IN_UNIT), units[-1])


def _positions_sheet(robot: str, uses: list[JointUse], report: Report, colour: str) -> Sheet:
    """Joint positions between their limits; a dot where the margin is smallest."""
    sheet = _joint_sheet(f"{robot}: joint positions", len(uses), report.times)
    for i, use in enumerate(uses):
        unit, scale = use.display_unit
        curve = _JointCurve(
            title=f"{use.joint}, in {unit}",
            note=_margin_note(use, scale),
            times=report.times,
            values=scale * report.q[robot][:, i],
            lower=scale * use.lower,
            upper=scale * use.upper,
        )
        _draw_joint(sheet, i, curve, colour=colour, worst_at_s=use.margin_at_s if math.isfinite(use.margin) else None)
    return sheet


def _margin_note(use: JointUse, scale: float) -> str:
    """How near the joint comes to its limits, or how far it leaves them, and when."""
    if not math.isfinite(use.margin):
        return "no position limits"
    margin = scale * use.margin
    near = f"margin {rounded_down(margin):.1f}" if margin >= 0.0 else f"outside by {-margin:.3g}"
    return f"{near} at {use.margin_at_s:.2f} s"


def _velocities_sheet(robot: str, uses: list[JointUse], report: Report, colour: str) -> Sheet:
    """Joint speeds between their limits; a dot where the speed is largest."""
    sheet = _joint_sheet(f"{robot}: joint velocities", len(uses), report.times)
    for i, use in enumerate(uses):
        unit, scale = use.display_unit
        curve = _JointCurve(
            title=f"{use.joint}, in {unit}/s",
            note=f"peak {scale * use.peak_velocity:.1f} at {use.peak_velocity_at_s:.2f} s",
            times=0.5 * (report.times[1:] + report.times[:-1]),
            values=scale * report.qd[robot][:, i],
            lower=-scale * use.velocity_limit,
            upper=scale * use.velocity_limit,
        )
        _draw_joint(sheet, i, curve, colour=colour, worst_at_s=use.peak_velocity_at_s)
    return sheet


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _JointCurve:
    """One joint's position or speed over time in printed units, with its limits."""

    title: str
    note: str
    times: Array
    values: Array
    lower: float
    upper: float


def _joint_sheet(title: str, joint_count: int, times: Array) -> Sheet:
    columns = min(JOINT_COLUMNS, max(joint_count, 1))
    return Sheet(title, rows=max(1, math.ceil(joint_count / columns)), columns=columns, times=times)


def _draw_joint(sheet: Sheet, index: int, curve: _JointCurve, *, colour: str, worst_at_s: float | None) -> None:
    """One panel that shows the whole allowed range and whatever lies outside it."""
    limits = [limit for limit in (curve.lower, curve.upper) if math.isfinite(limit)]
    span = (min([float(curve.values.min()), *limits]), max([float(curve.values.max()), *limits]))
    panel = sheet.panel(index, curve.title, note=curve.note, span=span)
    for limit in limits:
        sheet.limit(panel, limit, label=f"{limit:.6g}", is_upper=limit == curve.upper)
    sheet.curve(panel, curve.times, curve.values, colour=colour)
    if worst_at_s is not None:
        worst = int(np.argmin(np.abs(curve.times - worst_at_s)))
        value = float(curve.values[worst])
        is_outside = not curve.lower <= value <= curve.upper
        sheet.dot(panel, float(curve.times[worst]), value, colour=LIMIT if is_outside else INK)


def _clearance_sheet(report: Report, required: float) -> Sheet:
    """Distance that each class keeps over time, certified between the samples, with the required clearance."""
    sheet = Sheet("clearance over time", rows=2, columns=2, times=report.times)
    for index, (kind, title) in enumerate(CLASS_TITLES.items()):
        curve = 1e3 * report.clearance.curves.get(kind, np.empty(0))
        known = np.isfinite(curve)
        minimum = report.clearance.minima.get(kind)
        if not known.any() or minimum is None or minimum.minimum is None or minimum.at_s is None:
            sheet.panel(index, title, note="no such pair", span=(0.0, 1.0), is_floored=True)
            continue
        smallest, word = 1e3 * minimum.minimum, "smallest" if minimum.exact else "at least"
        panel = sheet.panel(
            index,
            f"{title}, in mm",
            note=f"{word} {rounded_down(smallest):.1f} at {minimum.at_s:.2f} s, required {1e3 * required:g}",
            span=(0.0, max(float(curve[known].max()), 1e3 * required) or 1.0),
            is_floored=True,
        )
        sheet.limit(panel, 1e3 * required, is_upper=False)
        sheet.curve(panel, report.clearance.curve_times[known], curve[known], colour=palette.CLASSES[index])
        sheet.dot(panel, minimum.at_s, smallest, colour=LIMIT if smallest < 1e3 * required else INK)
    return sheet


def _singularity_sheet(conditioning: Conditioning, times: Array, colours: Mapping[str, str]) -> Sheet:
    """Singular values, condition and manipulability of the whole stack, then the smallest value of each robot."""
    series = {
        "all robots together": conditioning.stack,
        "their condition": conditioning.condition,
        "their manipulability": conditioning.manipulability,
        **conditioning.robots,
    }
    rows = math.ceil(len(series) / JOINT_COLUMNS)
    title = "smallest singular values, condition and manipulability along the motion"
    sheet = Sheet(title, rows=rows, columns=JOINT_COLUMNS, times=times)
    for index, (name, values) in enumerate(series.items()):
        worst = int(np.argmin(values))
        unit, scale = _power_of_ten(float(values.max()))
        at_s, smallest = float(times[worst]), scale * float(values[worst])
        is_long = len(name + unit) > MAX_TITLE_LETTERS
        panel = sheet.panel(
            index,
            name + unit,
            note=f"{'' if is_long else 'smallest '}{smallest:.2g} at {at_s:.2f} s",
            span=(0.0, scale * float(values.max()) or 1.0),
            is_floored=True,
        )
        sheet.curve(panel, times, scale * values, colour=colours.get(name, INK))
        sheet.dot(panel, at_s, smallest)
    return sheet


def _power_of_ten(largest: float) -> tuple[str, float]:
    """Label and factor that make small values readable; what is too small for that becomes zero."""
    if largest >= LEAST_PLAIN:
        return "", 1.0
    if largest < SMALLEST_DRAWN:
        return "", 0.0
    exponent = math.floor(math.log10(largest))
    return f", in 10{str(exponent).translate(SUPERSCRIPTS)}", 10.0**-exponent
