"""Solution: what solving a cell gives: a program of one or several phases, each of them verified."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from cellplan.model.cell.cell import Cell
from cellplan.model.motion.branches import MovedStart
from cellplan.model.motion.motion import Motion, Program, Schedule
from cellplan.model.motion.plan import Phase, Plan
from cellplan.model.presented import Presented
from cellplan.model.report.report import Report, verdict
from cellplan.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Run:
    """One phase of the program and its proof, on the phase's own time, which starts at 0."""

    phase: Phase  # the phase on the clock of the program
    schedule: Schedule  # desired tool poses
    motion: Motion  # joint positions of all robots, as they were planned
    program: Program  # the program as text, in which this phase has its rows
    report: Report  # result of the checks on these rows
    scene: Scene  # the scene that it is judged in, with the cell as it is in this phase
    # how the transfer move of each robot was found, by robot; empty without transfer moves
    rungs: Mapping[str, str] = field(default_factory=dict)
    moved: tuple[MovedStart, ...] = ()  # how far its starts were moved

    def __repr__(self) -> str:
        """One line without arrays."""
        return (
            f"<Run of '{self.report.cell}', {self.phase.name}, {self.report.cycle_time:g} s, {verdict([self.report])}>"
        )

    @property
    def cell(self) -> Cell:
        """The cell as it is in this phase."""
        return self.scene.cell

    @property
    def transfers(self) -> dict[str, str]:
        """How its transfer moves were found, in words, by the name of the phase; empty without any."""
        words = ", ".join(f"{robot} {rung}" for robot, rung in self.rungs.items())
        return {self.phase.name: words} if words else {}

    @property
    def name(self) -> str | None:
        """Name of the phase among several; None for the only one of a program."""
        return self.phase.label

    @property
    def moving(self) -> tuple[str, ...]:
        """Names of the robots that may move."""
        return self.phase.moving


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solution(Presented):
    """A solved cell.

    Attributes:
        cell: The cell that was solved, with every start posture filled in.
        motion: Joint positions in all rows of the program, and its plan.
        runs: One run for each phase of the program: one, or one per task in the pairwise mode; of a program of several
            cycles those of the first one, which the others repeat row by row.
        remark: Note on the chosen start when no trial of a start was free of faults.
    """

    cell: Cell
    motion: Motion
    runs: tuple[Run, ...]
    remark: str | None = None

    @property
    def plan(self) -> Plan:
        """The phases of the program on its nominal time."""
        return self.motion.plan

    @property
    def program(self) -> Program:
        """The program as text: one joint table per robot, and their clock."""
        return self.runs[0].program

    @property
    def passed(self) -> bool:
        """Whether every check of every phase passed."""
        return all(run.report.passed for run in self.runs)

    def __repr__(self) -> str:
        """One line without arrays."""
        runs = ", ".join(run.name for run in self.runs if run.name is not None)
        cycle, outcome = float(self.motion.times[-1]), verdict([run.report for run in self.runs])
        mode = f"{self.cell.motion.mode}{f': {runs}' if runs else ''}"
        return f"<Solution of '{self.cell.name}', {mode}, {cycle:g} s, {outcome}>"
