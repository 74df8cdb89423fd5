"""Figures of a program: what each phase measures as one table, the worst of it, and how that is called and shown."""

import csv
import io
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from types import MappingProxyType
from typing import Any, Final, Self

import numpy as np

from cellplan.model.motion.plan import ALL_TASKS
from cellplan.model.report.report import Report
from cellplan.model.task.task import first_judged
from cellplan.model.units import DEG, MM
from cellplan.report.record.common import Number, Record, number
from cellplan.report.record.numbers import fixed, floored, percent, plain, small
from cellplan.report.record.sections.joints import velocity_ratio

SECONDS_PER_HOUR: Final = 3600.0
REDUCED: Final = 250.0  # [mm/s]
UNKNOWN: Final = "not stated"
ALL: Final = "all"  # subject of what is measured of a phase as a whole
Fold = Callable[..., Any]  # max, min or sum
FiguresRecord = dict[str, dict[str, dict[str, Number]]]  # by phase, quantity and subject


@dataclass(frozen=True, slots=True)
class FigureQuantity:
    """A quantity of a program."""

    key: str  # of its worst value, in records and tables
    over_phases: Fold  # the value of one subject over several phases
    worst: Fold  # the value over all subjects
    scale: float  # from SI to the unit of its key
    subject: str  # key of the subject that is worst; empty where that is not recorded
    absent: Number  # the worst value where there is none
    meaning: str  # what it is


@dataclass(frozen=True, slots=True)
class Shown:
    """How the worst value of a quantity is shown."""

    heading: str  # of a column of a page, its unit in a line of its own
    page: Callable[[Number], str]  # its text there
    column: str  # heading of a column on the terminal
    percent: float  # 100 for a share, else 1: also the scale of its plot
    plot: str  # title of its plot
    limit: float | None = None  # A limit there, and its name
    limit_name: str = ""  # empty for a limit without a name

    def text(self, value: Number) -> str:
        """Its text on the terminal: that of the page, its unit in the heading."""
        return plain(self.page(value)).removesuffix(" %")


# fmt: off
_LISTED: Final = (
    FigureQuantity("cycle_time_s", sum, sum, 1.0, "", None, "duration of the program"),
    FigureQuantity("parts_per_h", max, max, 1.0, "", None, "programs in an hour, one after the other"),
    FigureQuantity("load_ratio", max, max, 1.0, "", None, "share of the cycle in which the limits would allow the same motion; 1: the shortest"),
    FigureQuantity("failed_checks", sum, sum, 1.0, "", None, "checks that failed"),
    FigureQuantity("max_position_error_mm", max, max, MM, "", 0.0, "largest position error of a tool, at the rows or between them"),
    FigureQuantity("max_orientation_error_deg", max, max, DEG, "", 0.0, "largest orientation error of a tool, likewise"),
    FigureQuantity("min_margin_deg", min, min, DEG, "min_margin_joint", None, "smallest distance of a revolute joint from a position limit"),
    FigureQuantity("max_velocity_ratio", max, max, 1.0, "max_velocity_joint", None, "largest joint velocity as a share of its limit"),
    FigureQuantity("max_acceleration_ratio", max, max, 1.0, "max_acceleration_joint", None, "largest joint acceleration as a share of its limit, where one counts"),
    FigureQuantity("min_clearance_mm", min, min, MM, "min_clearance_pair", None, "smallest certified distance of two bodies; null if it was not certified"),
    FigureQuantity("max_tool_speed_mm_s", max, max, MM, "max_tool_speed_robot", 0.0, "largest speed of a tool tip in the world"),
    FigureQuantity("max_axis_speed_mm_s", max, max, MM, "max_axis_speed_joint", None, "largest speed of a point on a joint axis: shoulder, elbow or wrist"),
    FigureQuantity("time_above_250_s", sum, max, 1.0, "", None, "time in which a tool tip is faster than 250 mm/s"),
    FigureQuantity("share_above_250_mm_s", max, max, 1.0, "share_above_250_robot", None, "largest share of the cycle in which a tool tip is faster than 250 mm/s"),
    FigureQuantity("load_s", sum, sum, 1.0, "", None, "for all joints added up, the time that a joint needs for its travel at top speed"),
    FigureQuantity("energy_proxy_s", sum, sum, 1.0, "", None, "sum over all joints of the integral of (velocity / limit)^2 over the time"),
    FigureQuantity("energy_j", sum, sum, 1.0, "", None, "work of the drives, without friction and motors; null unless the masses of all robots are stated"),
)
SHOWN: Final[Mapping[str, Shown]] = MappingProxyType({
    "cycle_time_s": Shown("cycle time<br>s", partial(fixed, digits=3), "cycle s", 1.0, "cycle time, in s"),
    "parts_per_h": Shown("parts<br>per hour", fixed, "parts/h", 1.0, "parts per hour"),
    "max_velocity_ratio": Shown("velocity<br>of limit", partial(percent, digits=1), "velocity %", 100.0, "highest joint velocity, in % of its limit", 100.0),
    "max_acceleration_ratio": Shown("acceleration<br>of limit", partial(percent, digits=1), "acceleration %", 100.0, "highest joint acceleration, in % of its limit", 100.0),
    "max_tool_speed_mm_s": Shown("tool speed<br>mm/s", partial(fixed, digits=0), "tool mm/s", 1.0, "fastest tool tip in the world, in mm/s", REDUCED, "reduced speed"),
    "energy_proxy_s": Shown("energy proxy<br>s", small, "energy proxy s", 1.0, "energy proxy, in s"),
    "energy_j": Shown("work<br>J", lambda value: UNKNOWN if value is None else fixed(value, 0), "work J", 1.0, "work of the drives, in J"),
    "min_margin_deg": Shown("margin<br>deg", floored, "margin deg", 1.0, "smallest joint margin, in deg"),
    "min_clearance_mm": Shown("clearance<br>mm", floored, "clearance mm", 1.0, "smallest certified clearance, in mm"),
})
# fmt: on
QUANTITIES: Final[Mapping[str, FigureQuantity]] = MappingProxyType({quantity.key: quantity for quantity in _LISTED})
SUBJECTS: Final[Mapping[str, FigureQuantity]] = MappingProxyType(
    {quantity.subject: quantity for quantity in _LISTED if quantity.subject}
)
# fmt: off
KEY: Final = (
    "cycle_time_s", "failed_checks", "max_position_error_mm", "max_orientation_error_deg", "min_margin_deg",
    "min_margin_joint", "max_velocity_ratio", "max_velocity_joint", "max_acceleration_ratio",
    "max_acceleration_joint", "min_clearance_mm", "min_clearance_pair", "max_tool_speed_mm_s",
)  # of every variant of a cell
# fmt: on
# fmt: off
LOAD: Final = (
    "cycle_time_s", "parts_per_h", "load_ratio", "max_velocity_ratio", "max_velocity_joint", "max_acceleration_ratio",
    "max_acceleration_joint", "max_tool_speed_mm_s", "max_tool_speed_robot", "max_axis_speed_mm_s",
    "max_axis_speed_joint", "share_above_250_mm_s", "share_above_250_robot", "energy_proxy_s", "energy_j",
    "min_margin_deg", "min_margin_joint", "min_clearance_mm", "min_clearance_pair", "failed_checks",
)  # how hard joints and tools work at a cycle time


# fmt: on


@dataclass(frozen=True, slots=True)
class Figures:
    """What a program measures: by phase, quantity and subject a value in the unit of the quantity's key."""

    by_phase: Mapping[str, Mapping[str, Mapping[str, float]]]
    of_program: Mapping[str, Mapping[str, float]] = field(default_factory=dict)  # of all phases at once

    @classmethod
    def of_record(cls, record: Record) -> Self:
        """The figures in a ``report.json``; null there is what has no bound."""
        rows: Mapping[str, Mapping[str, Mapping[str, Number]]] = record["figures"]
        read = {
            phase: {
                key: {subject: math.inf if value is None else value for subject, value in subjects.items()}
                for key, subjects in quantities.items()
            }
            for phase, quantities in rows.items()
        }
        return cls(read)

    def in_phases(self, names: Iterable[str]) -> Self:
        """The figures of some phases alone."""
        return type(self)({name: self.by_phase[name] for name in names})

    def of(self, key: str) -> Mapping[str, float]:
        """The values of all subjects, each over all phases."""
        if key in self.of_program:
            return self.of_program[key]
        values: dict[str, list[float]] = {}
        for quantities in self.by_phase.values():
            for subject, value in quantities.get(key, {}).items():
                values.setdefault(subject, []).append(value)
        return {subject: QUANTITIES[key].over_phases(series) for subject, series in values.items()}

    def recorded(self, key: str) -> Any:
        """The worst value, or the subject that has it."""
        if key in SUBJECTS:
            rows = self.of(SUBJECTS[key].key)
            return (SUBJECTS[key].worst(rows, key=rows.__getitem__) or None) if rows else None
        quantity, values = QUANTITIES[key], self.of(key).values()
        if not values:
            return quantity.absent
        value = quantity.worst(values)
        return value if isinstance(value, int) else number(value)  # a count stays one

    def record(self, keys: Sequence[str]) -> dict[str, Any]:
        """Worst values by key."""
        return {key: self.recorded(key) for key in keys}


def figures_of(reports: Iterable[Report], *, cycle: float | None = None, load: float | None = None) -> Figures:
    """The figures of a program, as its ``report.json`` has them.

    Args:
        cycle: Time from the first row of the program to the last one in [s], where that is asked for.
    """
    figures = Figures({report.phase or ALL_TASKS: _figures_of_phase(report) for report in reports})
    of_program: dict[str, dict[str, float]] = {} if load is None else {"load_ratio": {ALL: load}}
    if cycle is not None:
        of_program |= {"cycle_time_s": {ALL: cycle}, "parts_per_h": {ALL: SECONDS_PER_HOUR / cycle}}
        above = figures.of("time_above_250_s")
        of_program["share_above_250_mm_s"] = {robot: time / cycle for robot, time in above.items()}
    return replace(figures, of_program=of_program)


def figures_record(reports: Iterable[Report]) -> FiguresRecord:
    """The figures of each phase, as they stand in ``report.json``."""
    return {
        phase: {
            key: {subject: value if math.isfinite(value) else None for subject, value in subjects.items()}
            for key, subjects in quantities.items()
        }
        for phase, quantities in figures_of(reports).by_phase.items()
    }


def _figures_of_phase(report: Report) -> dict[str, dict[str, float]]:
    """By quantity and subject the values of one phase, with the digits of a record."""
    values: dict[str, dict[str, list[float]]] = {}
    for key, subject, value in _measured(report):
        values.setdefault(key, {}).setdefault(subject, []).append(value)
    return {
        key: {subject: _printed(QUANTITIES[key], series) for subject, series in subjects.items()}
        for key, subjects in values.items()
    }


def _printed(quantity: FigureQuantity, values: Sequence[float]) -> float:
    """The worst of several values in SI, in the unit of its key; a count stays one."""
    value = quantity.worst(values)
    printed = value if isinstance(value, int) else number(quantity.scale * value)
    return math.inf if printed is None else printed


def _measured(report: Report) -> Iterator[tuple[str, str, float]]:
    """Key, subject and value in SI of everything that one phase measures."""
    yield "cycle_time_s", ALL, report.cycle_time
    yield "failed_checks", ALL, sum(not check.passed for check in report.checks)
    yield "energy_proxy_s", ALL, energy_proxy(report)
    if report.torques and not any(use.missing for use in report.torques):
        yield "energy_j", ALL, sum(use.energy for use in report.torques)
    for use in report.joints:
        joint = f"{use.robot}/{use.joint}"
        if use.is_revolute and np.isfinite(use.margin):
            yield "min_margin_deg", joint, use.margin
        yield "max_velocity_ratio", joint, velocity_ratio(use)
        yield "load_s", joint, use.travel / use.velocity_limit if use.velocity_limit else 0.0
    for hard in report.accelerations.joints:
        if hard.ratio is not None:
            yield "max_acceleration_ratio", f"{hard.robot}/{hard.joint}", hard.ratio
    for near in report.clearance.minima.values():
        if near.minimum is not None:
            yield "min_clearance_mm", " - ".join(near.pair or ()), near.minimum
    for task in report.accuracy:
        between, judged = task.between, slice(first_judged(report.times, task.judged_from), None)
        position, orientation = (
            np.linalg.norm(error[judged], axis=1).max() for error in (task.position_error, task.orientation_error)
        )
        yield "max_position_error_mm", task.task, max(position, between.position.largest if between else 0.0)
        yield "max_orientation_error_deg", task.task, max(orientation, between.orientation.largest if between else 0.0)
    for robot, speed in report.speeds.items():
        yield "max_tool_speed_mm_s", robot, speed.tool_peak
        yield "max_axis_speed_mm_s", f"{robot}/{speed.axis}", speed.axis_peak
        yield "time_above_250_s", robot, speed.share_above_reduced * report.cycle_time


def energy_proxy(report: Report) -> float:
    r"""A figure that grows with the losses of all drives, in [s]; it is no energy in joules.

    .. math:: E = \sum_j \int_0^T \left( \dot q_j / \dot q_{j,\max} \right)^2 dt

    Along the same path it is inversely proportional to the cycle time. Masses and motors are not in it: it compares
    programs of one cell, not cells.
    """
    total, steps = 0.0, np.diff(report.times)
    for robot, velocities in report.qd.items():
        limits = np.array([use.velocity_limit for use in report.joints if use.robot == robot])
        turns = limits > 0.0
        total += float(steps @ np.sum((velocities[:, turns] / limits[turns]) ** 2, axis=1))
    return total


def terminal_lines(rows: Sequence[Sequence[str]], indent: str) -> list[str]:
    """Rows of a table as indented lines, the first one its headings, every column flush right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [indent + "  ".join(map(str.rjust, row, widths)).rstrip() for row in rows]


def terminal_table(keys: Iterable[str], figures: Iterable[Mapping[str, Any]], indent: str) -> list[str]:
    """A line of headings and a line for each row of figures."""
    shown = {key: SHOWN[key] for key in keys}
    heads = [figure.column for figure in shown.values()]
    rows = [heads, *([figure.text(row[key]) for key, figure in shown.items()] for row in figures)]
    return terminal_lines(rows, indent)


def page_headings(keys: Iterable[str]) -> str:
    """Headings of the columns of a page: of each quantity, and of what is worst of it."""
    heads = [None if key in SUBJECTS else SHOWN[key].heading for key in keys]
    name = '<th scope="col" class="text">joint</th>'
    return "".join(name if head is None else f'<th scope="col">{head}</th>' for head in heads)


def page_cells(keys: Iterable[str], figures: Mapping[str, Any]) -> list[tuple[bool, str]]:
    """Whether each cell of a row is a name, and its text."""
    return [(True, figures[key] or "") if key in SUBJECTS else (False, SHOWN[key].page(figures[key])) for key in keys]


def csv_text(rows: Iterable[Sequence[Any]]) -> str:
    """Rows as CSV, the first one its names."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
