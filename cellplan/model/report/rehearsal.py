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
    """Figures of ISO 9283:1998 at one programmed pose, in [m] and [rad]; RP is None for a single trial."""

    at_s: float  # instant of the pose in [s]
    AP_p: float  # distance of the attained positions' barycentre from the commanded position
    AP_abc: Angles  # the same of the three angles, as amounts
    RP_l: float | None  # mean distance from the barycentre plus three standard deviations
    RP_abc: Angles | None  # three standard deviations of the three angles


@dataclass(frozen=True, slots=True, kw_only=True)
class PathFigures:
    """Figures of ISO 9283:1998 along one path, in [m] and [rad]; RT is None for a single trial."""

    AT_p: float  # largest distance of the barycentre line from the commanded path
    AT_p_at_s: float  # time of it in [s]
    AT_abc: Angles  # largest mean deviation of the three angles
    RT_p: float | None  # largest mean distance from the barycentre plus three standard deviations
    RT_p_at_s: float | None  # time of it in [s]
    RT_abc: Angles | None  # largest three standard deviations of the three angles


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
    """One execution on the real cell."""

    number: int  # 0 is the program as it was solved
    position: Mapping[str, float]  # largest true position error by task in [m]
    orientation: Mapping[str, float]  # largest true orientation error by task in [rad]
    share: float  # largest true error as a share of its tolerance
    measured_share: float  # the same of the measured errors, noise included, which the correction uses


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Correction:
    """Result of the correction from pass to pass on one real cell."""

    outcome: Outcome  # how it ended
    rounds: tuple[Round, ...]  # every execution
    best: int  # number of the round with the smallest measured error: the one that is kept
    accuracy: tuple[TaskAccuracy, ...]  # true errors of that round
    references: Schedule  # references of the nominal cell in this pass
    q: Array  # its joint positions in [rad] or [m], shape (N, nq)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointExecution:
    """How joints execute commanded positions; columns are those of the stacked joint vector."""

    commanded: Array  # in [rad] or [m], shape (N, nq)
    executed: Array  # positions of the links, shape (N, nq)
    torque: Array  # torques in [N m] or forces in [N]; 0 of robots that are not simulated, shape (N, nq)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trial:
    """One real cell."""

    draw: Draw  # how it differs from the written one
    before: tuple[TaskAccuracy, ...]  # true errors of the program as it was solved
    correction: Correction | None  # result of the correction; None when it was not requested
    # true errors with correction within the pass; None when it was not requested or diverged
    in_pass: tuple[TaskAccuracy, ...] | None
    # joints of simulated arms as solved, and with correction within the pass; None without such arms
    joints: JointExecution | None = None
    joints_in_pass: JointExecution | None = None

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
    """One run of the cell, rehearsed."""

    name: str | None  # name of the only task in a run of its own; None when all tasks are worked on together
    times: Array  # times in [s], shape (N,)
    # first sample that is judged, by task: before it the tool may still be coming to its path
    judged_from: Mapping[str, int]
    trials: tuple[Trial, ...]  # the real cells
    before: Mapping[str, IsoFigures]  # figures over all trials by task, as solved
    after: Mapping[str, IsoFigures] | None  # the same after the correction; None when it was not requested
    corrected: CorrectedProgram | None  # the corrected program; None when there is not one for one real cell


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rehearsal(Presented):
    """A program rehearsed on real cells."""

    cell: Cell  # the cell that was solved, with every start posture filled in
    errors: CellErrors  # what was stated of the real one
    runs: tuple[RunRehearsal, ...]  # one, or one per task in the pairwise mode
    # every verified statement: true errors over all trials, then what the program, or the corrected one, fails on the
    # written cell
    checks: tuple[Check, ...]
    has_feedback: bool  # whether correction from pass to pass was requested
    has_in_pass: bool  # whether correction within the pass was requested

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
