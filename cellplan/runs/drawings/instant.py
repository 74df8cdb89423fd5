"""The instant that decides the verdict of a run, and how it is called."""

import textwrap
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.model.cell.cell import Cell
from cellplan.model.report.check_kinds import GRAVITY
from cellplan.model.report.report import Check, ClearanceMinimum, JointUse, Report
from cellplan.model.units import MM
from cellplan.report.record.common import number
from cellplan.report.record.numbers import floored, plain
from cellplan.report.record.sections.clearance import smallest_minimum

NOTE_WIDTH: Final = 74  # [characters] of a line below the title, in a wide type
MOST_NOTES: Final = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Instant:
    """The instant that decides a verdict."""

    at_s: float  # its time in [s]
    check: Check | None = None  # the check that failed then; None where all passed
    minimum: ClearanceMinimum | None = None  # the smallest clearance, where that is what decides
    bodies: tuple[str, ...] = ()  # names of the bodies that matter
    robot: str | None = None  # the robot that matters; None where bodies do
    joint: str | None = None
    task: str | None = None  # the task that matters
    use: JointUse | None = None  # the joint that is nearest to a limit, where neither a failure nor a clearance decides

    @property
    def is_failure(self) -> bool:
        """Whether a check failed at it, or without an instant of its own where there is nothing else to show."""
        return self.check is not None and (self.check.at_s is not None or self.minimum is None)


def worst_instant(report: Report, cell: Cell) -> Instant:
    """The instant of the gravest failure of a run, or of its smallest clearance where no failure has an instant.

    Of failures of one kind that counts which exceeds its limit most.
    """
    failed = [check for check in report.checks if not check.passed and check.at_s is not None]
    if failed:
        return _of_check(min(failed, key=_gravity), report, cell)
    timeless = next((check for check in report.checks if not check.passed), None)
    smallest = smallest_minimum(report.clearance.minima)
    if smallest.at_s is None:
        return _narrowest(report, timeless)
    return Instant(at_s=smallest.at_s, check=timeless, minimum=smallest, bodies=smallest.pair or ())


def _narrowest(report: Report, check: Check | None) -> Instant:
    """The instant at which a joint is nearest to one of its limits, as a share of its range."""
    uses = [use for use in report.joints if np.isfinite(use.margin) and np.isfinite(use.upper - use.lower)]
    if not uses:
        return Instant(at_s=float(report.times[0]), check=check)
    use = min(uses, key=lambda joint: joint.margin / max(joint.upper - joint.lower, 1e-12))
    return Instant(at_s=use.margin_at_s, check=check, use=use)


def is_exact(minimum: ClearanceMinimum) -> bool:
    """Whether a smallest distance is known, rather than a bound of it."""
    return minimum.certified and minimum.exact


def graver(instant: Instant) -> tuple[float, ...]:
    """Order of the worst times of several runs, the gravest first: failures, then the smallest clearances."""
    if instant.check is not None and instant.is_failure:
        return (0.0, *_gravity(instant.check))
    distance = np.inf if instant.minimum is None else number(instant.minimum.minimum) or 0.0
    return (1.0, distance)


def _gravity(check: Check) -> tuple[float, float]:
    """Order of failed checks, the gravest first: by kind, then by the excess over the limit as it is printed."""
    return GRAVITY[check.name], -check.kind.severity(number(check.value) or 0.0, number(check.limit) or 0.0)


def _of_check(check: Check, report: Report, cell: Cell) -> Instant:
    """The instant of a failed check, with what it is about."""
    at_s = check.at_s or 0.0
    names = tuple(check.subject.split(" - "))
    if check.name == "clearance" and len(names) == 1:
        minimum = next(
            (minimum for kind, minimum in report.clearance.minima.items() if str(kind) == check.subject), None
        )
        if minimum is not None and minimum.at_s is not None:
            return Instant(at_s=minimum.at_s, check=check, minimum=minimum, bodies=minimum.pair or ())
    if len(names) == 2:
        return Instant(at_s=at_s, check=check, bodies=names)
    robot, _, joint = check.subject.partition("/")
    if robot in {robot.name for robot in cell.robots}:
        known = joint if joint in cell.robot(robot).model.joint_names else None
        return Instant(at_s=at_s, check=check, robot=robot, joint=known)
    task = next((task for task in cell.tasks if task.name == check.subject), None)
    if task is not None:
        return Instant(at_s=at_s, check=check, robot=task.robot, task=task.name)
    return Instant(at_s=at_s, check=check)


def heading(instant: Instant, report: Report) -> tuple[str, tuple[str, ...]]:
    """Title and the lines below it."""
    at = f"at {instant.at_s:.3f} s" + (f" of {report.phase}" if report.phase else "")
    if instant.check is not None and instant.is_failure:
        title = f"{instant.check.kind.fails} {at}"
        return title, _wrapped(instant.check.message.removeprefix(f"{instant.check.name}: "))
    if instant.minimum is not None and instant.minimum.pair is not None:
        least = "" if is_exact(instant.minimum) else "at least "
        title = f"Smallest clearance {least}{floored(MM * (instant.minimum.minimum or 0.0))} mm {at}"
        failed = () if instant.check is None else (instant.check.message,)
        return title, _wrapped(" to ".join(instant.minimum.pair), *failed)
    if instant.use is not None:
        unit, scale = instant.use.display_unit
        return f"Smallest joint margin {plain(floored(scale * instant.use.margin))} {unit} {at}", (
            f"{instant.use.robot}/{instant.use.joint}",
        )
    return f"{report.cell} {at}", ()


def _wrapped(*texts: str) -> tuple[str, ...]:
    """Texts in lines of a width; what is too long ends with an ellipsis."""
    lines = [line for text in texts for line in textwrap.wrap(text, NOTE_WIDTH, break_on_hyphens=False)]
    if len(lines) > MOST_NOTES:
        lines = [*lines[: MOST_NOTES - 1], f"{lines[MOST_NOTES - 1][: NOTE_WIDTH - 2]} …"]
    return tuple(lines)
