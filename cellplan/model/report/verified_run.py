"""Verified run: controller programs are made from nothing else."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import InitVar, dataclass, field, replace
from pathlib import Path
from typing import Final

from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import ClockTable, JointTable, Motion, Schedule
from cellplan.model.motion.plan import Phase
from cellplan.model.presented import Presented
from cellplan.model.report.report import Report, verdict

ACCESS_TOKEN: Final = object()  # known to ``open_gate`` only


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReadRun:
    """What the files of a run say before anything in them is verified: enough to refuse what cannot be done with it."""

    folder: Path  # the run folder
    digest: str  # SHA-256 of its manifest
    cell: Cell  # the cell that was solved
    motions: tuple[str, ...]  # names of its phases, empty for the only one
    phases: tuple[Phase, ...]  # the phases of its program as the cell has them, not yet on a clock
    end: Callable[[], float]  # reads the time of its last row in [s] alone
    clock: Callable[[], ClockTable]  # reads the clock of the program, which is compared with the cell with its rows
    rows: Callable[[], Motion]  # reads all rows of the program, once: many refusals need none of them
    names: Mapping[str, str] = field(default_factory=dict)  # SHA-256 of files of other names than those of the run

    @property
    def motion(self) -> Motion:
        """All rows of the program; an ``InputError`` has file and line where they are not those of the cell."""
        return self.rows()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UnsolvedRun:
    """A cell that was not solved, in place of a run: enough to say what programs need of it whatever its motion."""

    cell: Cell


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VerifiedMotion:
    """One phase of a verified run, on its own time, which starts at 0."""

    name: str | None  # name of the phase among several; None for the only one of a program
    cell: Cell  # the cell as it is in this phase
    moving: tuple[str, ...]  # names of the robots that may move
    schedule: Schedule  # desired tool poses
    tables: Mapping[str, JointTable]  # joint positions of each robot, read back from its table, by robot name
    report: Report  # what the checks found when the run was verified


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VerifiedRun(Presented):
    """A run folder that was read back, recomputed and found to be what its report says.

    Only ``cellplan.runs.gate.open_gate.open_gate`` makes one.

    Attributes:
        folder: The run folder.
        digest: SHA-256 of its manifest, which stands for the whole run.
        cell: The cell that was solved.
        motion: All rows of the program, as written in its tables, and its plan, as the cell requires it.
        motions: One for each phase: one, or one per task in the pairwise mode.
        file_count: Files that were compared with the manifest.
        inputs_compared: Names of the files the run rests on that were found unchanged.
        remarks: What to know before relying on the run.
        names: SHA-256 of files that name tasks, signals, tools and frames otherwise than the run, by name.
    """

    folder: Path
    digest: str
    cell: Cell
    motion: Motion
    motions: tuple[VerifiedMotion, ...]
    file_count: int
    inputs_compared: tuple[str, ...]
    remarks: tuple[str, ...]
    token: InitVar[object]
    names: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self, token: object) -> None:
        """Refuse construction outside of ``open_gate``, or of a run with a failed check."""
        if token is not ACCESS_TOKEN:
            raise TypeError("a verified run is created by cellplan.open_gate only")
        if not self.motions or not all(motion.report.passed for motion in self.motions):
            raise ValueError("a verified run has motions whose checks all passed")

    @property
    def programs(self) -> Mapping[str | None, Mapping[str, JointTable]]:
        """What is played from begin to end, by name: every phase, or all of a program from home to home as None."""
        if len(self.motion.pieces) == len(self.motions):
            return {motion.name: motion.tables for motion in self.motions}
        times, q = self.motion.times, self.motion.q
        tables = self.motions[0].tables
        return {
            None: {name: replace(table, times=times, q=q[:, self.cell.columns(name)]) for name, table in tables.items()}
        }

    def __repr__(self) -> str:
        """One line without arrays."""
        judgement = verdict([motion.report for motion in self.motions])
        return f"<Verified run of '{self.cell.name}', {float(self.motion.times[-1]):g} s, {judgement}>"

    def by_phase(self, programs: Sequence[Mapping[str, JointTable]]) -> tuple[dict[str, JointTable], ...]:
        """Tables of every motion, each on its own time.

        Args:
            programs: Tables by robot of each of the ``programs``, as they were read back.
        """
        if len(programs) == len(self.motions):
            return tuple(map(dict, programs))
        places = [self.motion.rows(phase) for phase in self.motion.plan.program[: len(self.motions)]]
        return tuple(
            {
                name: replace(table, times=table.times[rows] - table.times[rows.start], q=table.q[rows])
                for name, table in programs[0].items()
            }
            for rows in places
        )


AnyRun = VerifiedRun | ReadRun | UnsolvedRun
