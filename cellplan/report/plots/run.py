"""Figures of a run: joint margins and speeds, clearance, tool errors, joint positions and velocities between limits."""

import math
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.report.report import ClearanceClass, ClosureAccuracy, Conditioning, JointUse, Report, TaskAccuracy
from cellplan.model.task.task import Frame
from cellplan.model.units import rounded_down
from cellplan.report.plots.errors import ORIENTATION, POSITION, error_panels
from cellplan.report.plots.feeds import feed_figure
from cellplan.report.plots.figure import (
    Figure,
    Item,
    LegendKey,
    Limit,
    PlotAxis,
    PlotCurve,
    PlotMark,
    PlotPanel,
    time_axis,
    value_axis,
)
from cellplan.report.plots.palette import CLASSES, INK, LIMIT, ROBOTS, robot_colours
from cellplan.report.plots.placing import SUPERSCRIPTS, number_sign
from cellplan.report.record.common import shortened

JOINT_COLUMNS: Final = 3
LEAST_PLAIN, SMALLEST_SHOWN = 1e-2, 1e-200  # [-] of a manipulability: below, in powers of ten; below, as zero
MAX_TITLE_LETTERS: Final = 29  # [-] letters beside which the whole note has room in one of three columns
CLASS_TITLES: Final[Mapping[ClearanceClass, str]] = {
    ClearanceClass.ROBOT_ROBOT: "robot to robot",
    ClearanceClass.SELF: "robot to itself",
    ClearanceClass.PART: "part",
    ClearanceClass.ENVIRONMENT: "environment",
}
MAX_ROBOTS: Final = 8  # with a panel each; more share one, with a curve for the worst joint of each robot
MAX_LETTERS: Final = 22  # [-] of joint names beside a title; longer ones are counted from the base
LONGEST_NAME: Final = 13  # [-] letters of a robot's name beside the names of its joints
PERCENT: Final = 100.0
Shares = Mapping[str, tuple[Sequence[JointUse], Array]]  # by robot: its joints and their shares in [%], shape (N, n)


def run_figures(report: Report, *, cell: Cell) -> dict[str, Figure]:
    """All figures of one run by name, what decides about it first.

    These are ``margins``, ``speeds``, ``clearance``, ``task_<task>``, ``feed_<task>``, ``closure_<robot>``,
    ``positions_<robot>`` and ``velocities_<robot>``, and ``singularity``, as far as the run has what they show.

    Args:
        cell: Where tolerances, the required clearance and the order of the robots come from.
    """
    colours = robot_colours(cell)
    robots = list(report.q) if report.tasks else [name for name, q in report.q.items() if np.any(q != q[0])]
    over_all = {
        "margins": margins_figure(report, robots, colours),
        "speeds": speeds_figure(report, robots, colours),
        "clearance": _clearance_figure(report, cell.checks.clearance_mm.si),
    }
    figures = {name: figure for name, figure in over_all.items() if figure is not None}
    for accuracy in report.accuracy:
        figures[f"task_{accuracy.task}"] = _task_figure(accuracy, report.times, cell)
    for greatest in report.greatest_feeds:
        figures[f"feed_{greatest.task}"] = feed_figure(greatest)
    for closure in report.closures:
        figures[f"closure_{closure.robot}"] = _closure_figure(closure, report.times, cell)
    for robot in robots:
        uses = [use for use in report.joints if use.robot == robot]
        figures[f"positions_{robot}"] = _positions_figure(robot, uses, report, colours[robot])
        figures[f"velocities_{robot}"] = _velocities_figure(robot, uses, report, colours[robot])
    if report.conditioning is not None:
        figures["singularity"] = _singularity_figure(report.conditioning, report.times, colours)
    return figures


def _task_figure(accuracy: TaskAccuracy, times: Array, cell: Cell) -> Figure:
    """Total and per-axis error of position and orientation."""
    tolerance = cell.task(accuracy.task).tolerance
    place = "on the part" if cell.task(accuracy.task).relative_to is Frame.PART else "in the world"
    panels = error_panels(times, accuracy.position_error, allowed=tolerance.position_mm.si, kind=POSITION)
    panels += error_panels(times, accuracy.orientation_error, allowed=tolerance.orientation_deg.si, kind=ORIENTATION)
    title = f"{accuracy.task} ({accuracy.robot}): tool error {place}"
    return Figure(title=title, x=time_axis(times), panels=panels, columns=2)


def _closure_figure(closure: ClosureAccuracy, times: Array, cell: Cell) -> Figure:
    """Total and per-axis error of the tool of a further holder on its grasp."""
    checks = cell.checks
    panels = error_panels(times, closure.position_error, allowed=checks.closure_mm.si, kind=POSITION)
    panels += error_panels(times, closure.orientation_error, allowed=checks.closure_deg.si, kind=ORIENTATION)
    title = f"{closure.robot}: closure error at its grasp"
    return Figure(title=title, x=time_axis(times), panels=panels, columns=2)


def _positions_figure(robot: str, uses: Sequence[JointUse], report: Report, colour: str) -> Figure:
    """Joint positions between their limits; a dot where the margin is smallest."""
    panels = []
    for i, use in enumerate(uses):
        unit, scale = use.display_unit
        curve = PlotCurve(use.joint, report.times, scale * report.q[robot][:, i], colour)
        worst_at_s = use.margin_at_s if math.isfinite(use.margin) else None
        limits = (scale * use.lower, scale * use.upper)
        panels.append(_joint_panel(curve, limits, unit, note=_margin_note(use, scale), worst_at_s=worst_at_s))
    return _joint_figure(f"{robot}: joint positions", panels, report.times)


def _margin_note(use: JointUse, scale: float) -> str:
    """How near the joint comes to its limits, or how far it leaves them, and when."""
    if not math.isfinite(use.margin):
        return "no position limits"
    margin = scale * use.margin
    near = f"margin {rounded_down(margin):.1f}" if margin >= 0.0 else f"outside by {-margin:.3g}"
    return f"{near} at {use.margin_at_s:.3f} s"


def _velocities_figure(robot: str, uses: Sequence[JointUse], report: Report, colour: str) -> Figure:
    """Joint speeds between their limits; a dot where the speed is largest."""
    middle, panels = 0.5 * (report.times[1:] + report.times[:-1]), []
    for i, use in enumerate(uses):
        unit, scale = use.display_unit
        curve = PlotCurve(use.joint, middle, scale * report.qd[robot][:, i], colour)
        limits = (-scale * use.velocity_limit, scale * use.velocity_limit)
        note = f"peak {scale * use.peak_velocity:.1f} at {use.peak_velocity_at_s:.3f} s"
        panels.append(_joint_panel(curve, limits, f"{unit}/s", note=note, worst_at_s=use.peak_velocity_at_s))
    return _joint_figure(f"{robot}: joint velocities", panels, report.times)


def _joint_figure(title: str, panels: Sequence[PlotPanel], times: Array) -> Figure:
    """The joints of a robot side by side."""
    columns = min(JOINT_COLUMNS, max(len(panels), 1))
    return Figure(title=title, x=time_axis(times), panels=panels, columns=columns)


def _joint_panel(
    curve: PlotCurve, limits: tuple[float, float], unit: str, *, note: str, worst_at_s: float | None
) -> PlotPanel:
    """One panel that shows the whole allowed range and whatever lies outside it."""
    lower, upper = limits
    finite = [limit for limit in limits if math.isfinite(limit)]
    items: list[Item] = [Limit(limit, number_sign(f"{limit:.6g}"), is_upper=limit == upper) for limit in finite]
    items.append(curve)
    if worst_at_s is not None:
        worst = int(np.argmin(np.abs(curve.x - worst_at_s)))
        value = float(curve.y[worst])
        items.append(PlotMark(float(curve.x[worst]), value, INK if lower <= value <= upper else LIMIT))
    span = (min([float(curve.y.min()), *finite]), max([float(curve.y.max()), *finite]))
    return PlotPanel(title=f"{curve.name}, in {unit}", note=note, y=value_axis(*span, unit=unit), items=items)


def _clearance_figure(report: Report, required: float) -> Figure:
    """Distance that each class keeps over time, certified between the samples, with the required clearance."""
    panels = [_clearance_panel(report, 1e3 * required, index) for index in range(len(CLASS_TITLES))]
    return Figure(title="clearance over time", x=time_axis(report.times), panels=panels, columns=2)


def _clearance_panel(report: Report, required: float, index: int) -> PlotPanel:
    """One class, with the required clearance in [mm]."""
    kind, title = list(CLASS_TITLES.items())[index]
    distances = 1e3 * report.clearance.curves.get(kind, np.empty(0))
    minimum = report.clearance.minima.get(kind)
    known = distances[np.isfinite(distances)]
    if not len(known) or minimum is None or minimum.minimum is None or minimum.at_s is None:
        return PlotPanel(title=title, note="no such pair", y=value_axis(0.0, 1.0, is_floored=True), items=[])
    smallest, word = 1e3 * minimum.minimum, "smallest" if minimum.exact else "at least"
    return PlotPanel(
        title=f"{title}, in mm",
        note=f"{word} {rounded_down(smallest):.1f} at {minimum.at_s:.3f} s, required {required:g}",
        y=value_axis(0.0, max(float(known.max()), required) or 1.0, unit="mm", is_floored=True),
        items=[
            Limit(required, is_upper=False),
            PlotCurve("distance", report.clearance.curve_times, distances, CLASSES[index]),
            PlotMark(minimum.at_s, smallest, LIMIT if smallest < required else INK),
        ],
    )


def _singularity_figure(conditioning: Conditioning, times: Array, colours: Mapping[str, str]) -> Figure:
    """Singular values, condition and manipulability of the whole stack, then the smallest value of each robot."""
    series = {
        "all robots together": conditioning.stack,
        "their condition": conditioning.condition,
        "their manipulability": conditioning.manipulability,
        **conditioning.robots,
    }
    title = "smallest singular values, condition and manipulability along the motion"
    panels = [_smallest(name, values, times, colours.get(name, INK)) for name, values in series.items()]
    return Figure(title=title, x=time_axis(times), panels=panels, columns=JOINT_COLUMNS)


def _smallest(name: str, values: Array, times: Array, colour: str) -> PlotPanel:
    """A quantity that should not come near zero."""
    worst = int(np.argmin(values))
    unit, scale = _power_of_ten(float(values.max()))
    at_s, smallest = float(times[worst]), scale * float(values[worst])
    is_long = len(name + unit) > MAX_TITLE_LETTERS
    return PlotPanel(
        title=shortened(name, MAX_TITLE_LETTERS) + unit,
        note=f"{'' if is_long else 'smallest '}{smallest:.2g} at {at_s:.3f} s",
        y=value_axis(0.0, scale * float(values.max()) or 1.0, is_floored=True),
        items=[PlotCurve(name, times, scale * values, colour), PlotMark(at_s, smallest)],
    )


def _power_of_ten(largest: float) -> tuple[str, float]:
    """Label and factor that make small values readable; what is too small for that becomes zero."""
    if largest >= LEAST_PLAIN:
        return "", 1.0
    if largest < SMALLEST_SHOWN:
        return "", 0.0
    exponent = math.floor(math.log10(largest))
    return f", in 10{str(exponent).translate(SUPERSCRIPTS)}", 10.0**-exponent


def margins_figure(report: Report, robots: Sequence[str], colours: Mapping[str, str]) -> Figure | None:
    """Distance of every joint to its nearer limit; None where no joint has two."""
    shares = {robot: _margins(report, robot) for robot in robots}
    shares = {robot: share for robot, share in shares.items() if share[0]}
    return _figure(
        "joint margins: distance to the nearer limit, in % of half the range",
        shares,
        report.times,
        colours,
        is_margin=True,
    )


def speeds_figure(report: Report, robots: Sequence[str], colours: Mapping[str, str]) -> Figure | None:
    """Speed of every joint as a share of its limit; None without robots."""
    named = {robot: [use for use in report.joints if use.robot == robot] for robot in robots}
    shares = {
        robot: (uses, PERCENT * np.abs(report.qd[robot]) / np.array([use.velocity_limit for use in uses]))
        for robot, uses in named.items()
        if uses
    }
    middle = 0.5 * (report.times[1:] + report.times[:-1])
    return _figure("joint speeds, in % of their limits", shares, middle, colours, is_margin=False, ends=report.times)


def _margins(report: Report, robot: str) -> tuple[list[JointUse], Array]:
    """Joints with two limits, and their margins in [%]."""
    uses = [use for use in report.joints if use.robot == robot]
    limited = [i for i, use in enumerate(uses) if np.isfinite(use.upper - use.lower)]
    lower, upper = np.array([[uses[i].lower, uses[i].upper] for i in limited]).reshape(-1, 2).T
    q = report.q[robot][:, limited]
    return [uses[i] for i in limited], PERCENT * np.minimum(q - lower, upper - q) / (0.5 * (upper - lower))


def _figure(
    title: str, shares: Shares, times: Array, colours: Mapping[str, str], *, is_margin: bool, ends: Array | None = None
) -> Figure | None:
    """A panel for each robot with a curve for each joint, or one for all robots with the worst joint of each."""
    if not shares:
        return None
    if len(shares) > MAX_ROBOTS:
        panels = [_crowd(shares, times, colours, is_margin=is_margin)]
    else:
        panels = [_robot(robot, *share, times, is_margin=is_margin) for robot, share in shares.items()]
    x = time_axis(times if ends is None else ends)
    return Figure(title=title, x=x, panels=panels, columns=min(2, len(panels)))


def _robot(robot: str, uses: Sequence[JointUse], shares: Array, times: Array, *, is_margin: bool) -> PlotPanel:
    """The joints of one robot, with the worst instant of all."""
    names = [use.joint for use in uses]
    if sum(map(len, names)) > MAX_LETTERS:
        names = [str(place) for place in range(1, len(uses) + 1)]
    pens = [ROBOTS[i % len(ROBOTS)] for i in range(len(uses))]
    row, joint = np.unravel_index(int(shares.argmin() if is_margin else shares.argmax()), shares.shape)
    value = float(shares[row, joint])
    is_bad = value < 0.0 if is_margin else value > PERCENT
    items: list[Item] = [_limit(is_margin=is_margin)]
    items += [
        PlotCurve(use.joint, times, shares[:, i], pen, 1.1) for i, (use, pen) in enumerate(zip(uses, pens, strict=True))
    ]
    items.append(PlotMark(float(times[row]), value, LIMIT if is_bad else INK))
    return PlotPanel(
        title=shortened(robot, LONGEST_NAME),
        keys=[LegendKey(name, pen) for name, pen in zip(names, pens, strict=True)],
        note=f"{uses[int(joint)].joint}: {_worst_text(value, is_margin=is_margin)} at {times[row]:.3f} s",
        y=_axis(shares, is_margin=is_margin),
        items=items,
    )


def _crowd(shares: Shares, times: Array, colours: Mapping[str, str], *, is_margin: bool) -> PlotPanel:
    """The worst joint of every robot at each instant."""
    worst = {robot: values.min(axis=1) if is_margin else values.max(axis=1) for robot, (_, values) in shares.items()}
    stacked = np.stack(list(worst.values()))
    robot, row = np.unravel_index(int(stacked.argmin() if is_margin else stacked.argmax()), stacked.shape)
    value = float(stacked[robot, row])
    items: list[Item] = [_limit(is_margin=is_margin)]
    items += [PlotCurve(name, times, curve, colours[name], 1.0) for name, curve in worst.items()]
    items.append(PlotMark(float(times[row]), value))
    return PlotPanel(
        title="worst joint of each robot",
        note=f"{list(worst)[int(robot)]}: {_worst_text(value, is_margin=is_margin)} at {times[row]:.3f} s",
        y=_axis(stacked, is_margin=is_margin),
        items=items,
    )


def _limit(*, is_margin: bool) -> Limit:
    """The limit of all shares."""
    return Limit(0.0, is_upper=False) if is_margin else Limit(PERCENT)


def _axis(shares: Array, *, is_margin: bool) -> PlotAxis:
    """The axis of shares: the whole range for margins, up to the limit at least for speeds."""
    if is_margin:
        return value_axis(min(0.0, float(shares.min())), PERCENT, unit="%")
    return value_axis(0.0, max(PERCENT, float(shares.max())), unit="%", is_floored=True)


def _worst_text(value: float, *, is_margin: bool) -> str:
    """The worst share in words."""
    return f"{number_sign(f'{rounded_down(value) if is_margin else value:.1f}')} %"
