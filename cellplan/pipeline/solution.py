"""Solution: what solving a cell gives: one verified run, or one per task."""

from dataclasses import dataclass

from cellplan.model.cell import Cell
from cellplan.model.motion import Motion, Program, Schedule
from cellplan.model.report import Report


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Run:
    """One motion of the cell and its proof.

    Attributes:
        name: Name of the only task in a run of its own; None when all tasks are worked on together.
        moving: Names of the robots that may move.
        schedule: Where every tool must be.
        motion: What all joints do.
        program: The joint tables as text; the report speaks of these.
        report: What the checks found.
    """

    name: str | None
    moving: tuple[str, ...]
    schedule: Schedule
    motion: Motion
    program: Program
    report: Report


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solution:
    """A solved cell.

    Attributes:
        cell: The cell that was solved, with every start posture filled in.
        runs: One run, or one per task in the pairwise mode.
        remark: What to know of the start that was chosen when no trial of one was without fault.
    """

    cell: Cell
    runs: tuple[Run, ...]
    remark: str | None = None

    @property
    def passed(self) -> bool:
        """Whether every check of every run passed."""
        return all(run.report.passed for run in self.runs)
