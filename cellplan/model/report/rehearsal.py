"""Rehearsal: execution of a program on real cells, before and after correction of its references."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.cell_errors import CellErrors, Draw
from cellplan.model.motion.motion import Program, Schedule
from cellplan.model.presented import Presented
from cellplan.model.report.report import Check, Report, TaskAccuracy

Angles = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseFigures:
    """Figures of ISO 9283:1998 at one programmed pose, in [m] and [rad]; RP is None for a single trial.

    Attributes:
        at_s: Instant of the pose in [s].
        AP_p: Distance of the attained positions' barycentre from the commanded position.
        AP_abc: The same of the three angles, as amounts.
        RP_l: Mean distance from the barycentre plus three standard deviations.
        RP_abc: Three standard deviations of the three angles.
    """

    at_s: float
    AP_p: float
    AP_abc: Angles
    RP_l: float | None
    RP_abc: Angles | None


@dataclass(frozen=True, slots=True, kw_only=True)
class PathFigures:
    """Figures of ISO 9283:1998 along one path, in [m] and [rad]; RT is None for a single trial.

    Attributes:
        AT_p: Largest distance of the barycentre line from the commanded path.
        AT_p_at_s: Time of it in [s].
        AT_abc: Largest mean deviation of the three angles.
        RT_p: Largest mean distance from the barycentre plus three standard deviations.
        RT_p_at_s: Time of it in [s].
        RT_abc: Largest three standard deviations of the three angles.
    """

    AT_p: float
    AT_p_at_s: float
    AT_abc: Angles
    RT_p: float | None
    RT_p_at_s: float | None
    RT_abc: Angles | None


@dataclass(frozen=True, slots=True, kw_only=True)
class IsoFigures:
    """Figures of one task over all trials: its programmed poses (start, corners, end) and its path."""

    poses: tuple[PoseFigures, ...]
    path: PathFigures


class Outcome(StrEnum):
    """Outcome of a correction.

    Attributes:
        CONVERGED: The error is far within tolerance, or within tolerance and falls no more.
        STALLED: The error falls no more and is beyond the tolerance.
        DIVERGED: The error grew, or the corrected references cannot be followed.
        UNFINISHED: The rounds are used up and the error still falls.
    """

    CONVERGED = "converged"
    STALLED = "stalled"
    DIVERGED = "diverged"
    UNFINISHED = "unfinished"


@dataclass(frozen=True, slots=True, kw_only=True)
class Round:
    """One execution on the real cell.

    Attributes:
        number: 0 is the program as it was solved.
        position: Largest true position error by task in [m].
        orientation: Largest true orientation error by task in [rad].
        share: Largest true error as a share of its tolerance.
        measured_share: The same of the measured errors, noise included, which the correction uses.
    """

    number: int
    position: Mapping[str, float]
    orientation: Mapping[str, float]
    share: float
    measured_share: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Correction:
    """Result of the correction from pass to pass on one real cell.

    Attributes:
        outcome: How it ended.
        rounds: Every execution.
        best: Number of the round with the smallest measured error: the one that is kept.
        accuracy: True errors of that round.
        references: References of the nominal cell in this pass.
        q: Its joint positions in [rad] or [m], shape (N, nq).
    """

    outcome: Outcome
    rounds: tuple[Round, ...]
    best: int
    accuracy: tuple[TaskAccuracy, ...]
    references: Schedule
    q: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trial:
    """One real cell.

    Attributes:
        draw: How it differs from the written one.
        before: True errors of the program as it was solved.
        correction: Result of the correction; None when it was not requested.
        in_pass: True errors with correction within the pass; None when it was not requested or diverged.
    """

    draw: Draw
    before: tuple[TaskAccuracy, ...]
    correction: Correction | None
    in_pass: tuple[TaskAccuracy, ...] | None

    @property
    def final(self) -> tuple[TaskAccuracy, ...]:
        """The errors that are judged: after the correction where it was requested."""
        return self.before if self.correction is None else self.correction.accuracy


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CorrectedProgram:
    """The corrected joint tables and what the checks of the written cell say of them."""

    program: Program
    report: Report


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunRehearsal:
    """One run of the cell, rehearsed.

    Attributes:
        name: Name of the only task in a run of its own; None when all tasks are worked on together.
        times: Times in [s], shape (N,).
        judged_from: First sample that is judged, by task: before it the tool may still be coming to its path.
        trials: The real cells.
        before: Figures over all trials by task, as solved.
        after: The same after the correction; None when it was not requested.
        corrected: The corrected program; None when there is not one for one real cell.
    """

    name: str | None
    times: Array
    judged_from: Mapping[str, int]
    trials: tuple[Trial, ...]
    before: Mapping[str, IsoFigures]
    after: Mapping[str, IsoFigures] | None
    corrected: CorrectedProgram | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rehearsal(Presented):
    """A program rehearsed on real cells.

    Attributes:
        cell: The cell that was solved, with every start posture filled in.
        errors: What was stated of the real one.
        runs: One, or one per task in the pairwise mode.
        checks: Every verified statement: true errors over all trials, then what the program, or the corrected one,
            fails on the written cell.
        has_feedback: Whether correction from pass to pass was requested.
        has_in_pass: Whether correction within the pass was requested.
    """

    cell: Cell
    errors: CellErrors
    runs: tuple[RunRehearsal, ...]
    checks: tuple[Check, ...]
    has_feedback: bool
    has_in_pass: bool

    @property
    def passed(self) -> bool:
        """Whether the program is sound on the written cell and within tolerance on every real one."""
        return all(check.passed for check in self.checks)

    def __repr__(self) -> str:
        """One line without arrays."""
        failed = [check.message for check in self.checks if not check.passed]
        outcome = f"failed: {failed[0]}" if failed else f"passed: {len(self.checks)} checks"
        trials = len(self.runs[0].trials)
        return f"<Rehearsal of '{self.cell.name}' on {trials} real {'cell' if trials == 1 else 'cells'}, {outcome}>"

    @property
    def is_released(self) -> bool:
        """Whether there are corrected joint tables that may be used."""
        return self.passed and all(run.corrected is not None for run in self.runs)
