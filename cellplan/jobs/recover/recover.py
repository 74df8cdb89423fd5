"""Recover: retract-and-home joint tables from where a cell has stopped, planned, then verified from the tables."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from cellplan.errors import NotVerifiedError, TransferNotFoundError
from cellplan.files.run.joint_tables import TableHeader, program_digest, render_table, replace_header
from cellplan.jobs.recover.judge import RecoveryJudgement, judged
from cellplan.jobs.recover.phases import RecoveryPhase
from cellplan.jobs.recover.planner import RecoveryPlanner
from cellplan.jobs.recover.state import RunPlaces, StoppedState, stopped_state
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import Progress, silent
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.model.settings.program import TransferEntry
from cellplan.planning.timing.schedule import TIME_DECIMALS
from cellplan.planning.transfer.best_try import BlockedTransferError
from cellplan.report.record.sections.rests_on import zero_text


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recovery:
    """What came of a recovery.

    Attributes:
        cell: The cell; its ``program.transfer`` says how fast the moves are at most.
        run: SHA-256 of the manifest of the run.
        state: Where the cell has stopped.
        tables: Text of the joint table of each robot, by its name; empty where no recovery was found.
        judgement: What was found on these tables; None where no recovery was found.
        reason: Why none was found; empty otherwise.
        tried: What was tried before the way that was taken, and why it was not.
        blocked: The first transfer move that was not found, where no recovery was.
        phases: What is done, with its rows; empty where no recovery was found.
    """

    cell: Cell
    run: str
    state: StoppedState
    tables: Mapping[str, str]
    judgement: RecoveryJudgement | None
    reason: str
    tried: tuple[str, ...]
    blocked: BlockedTransferError | None = None
    phases: tuple[RecoveryPhase, ...] = ()

    @property
    def succeeded(self) -> bool:
        """Whether there is a recovery."""
        return self.judgement is not None

    @property
    def duration(self) -> float:
        """Its length in [s]; zero where there is none."""
        return 0.0 if self.judgement is None else self.judgement.phases[-1].end

    def __repr__(self) -> str:
        """One line without arrays."""
        what = f"{self.duration:g} s" if self.succeeded else f"not found: {self.reason}"
        return f"<Recovery of '{self.cell.name}' from {self.state.at:g} s, {what}>"


def recover(
    run: VerifiedRun,
    *,
    at: float,
    frozen: Mapping[str, float] | None = None,
    keep: Collection[str] = (),
    transfer: TransferEntry | None = None,
    progress: Progress = silent,
) -> Recovery:
    """Plan a recovery of a verified run and verify its tables.

    Each robot stands where the program has it at ``at``, those of ``frozen`` at their own time. Tools that are too near
    to something go straight off it, then all robots move to their homes. Where that is not found, and all robots stand
    at one time, the program is played backwards first.

    Args:
        run: The verified run.
        at: Time of the program in [s], linear between rows.
        frozen: Time of the program at which a robot stands instead, by its name.
        keep: Names of the robots that are to stand still.
        transfer: How fast all moves are at most; None for ``program.transfer`` of the cell.
        progress: Called with the stage and the fraction done.

    Returns:
        The tables and what was found on them; without tables, and with the reason, where no recovery was found.

    Raises:
        InputError: A time is outside of the program, or there is no such robot.
        NotVerifiedError: A check fails on the tables that were planned.
    """
    places = RunPlaces.of(run, transfer)
    state = stopped_state(places, at=at, frozen=frozen or {}, keep=keep)
    planner = RecoveryPlanner(places, state, progress)
    try:
        phases = planner.phases()
    except TransferNotFoundError as error:
        return Recovery(
            cell=places.cell,
            run=run.digest,
            state=state,
            tables={},
            judgement=None,
            reason=str(error),
            tried=(),
            blocked=planner.blocked,
        )
    tables = _tables(places.cell, phases, state, run=run.digest)
    progress("verifying the recovery", 0.0)
    judgement = judged(tables, phases, places=places, state=state)
    if not judgement.passed:
        raise NotVerifiedError([f"recovery: {check.message}" for check in judgement.checks if not check.passed])
    return Recovery(
        cell=places.cell,
        run=run.digest,
        state=state,
        tables=tables,
        judgement=judgement,
        reason="",
        tried=tuple(planner.refused),
        phases=phases,
    )


def _tables(cell: Cell, phases: tuple[RecoveryPhase, ...], state: StoppedState, *, run: str) -> dict[str, str]:
    """The joint tables of all phases one after the other."""
    q = np.concatenate([phases[0].q, *(phase.q[1:] for phase in phases[1:])])
    times = np.round(np.arange(len(q)) * cell.motion.step, TIME_DECIMALS)
    texts, remark = {}, f"recovery from {state.at:g} s of the program"
    header = TableHeader(cell=cell.name, mode=str(cell.motion.mode), digests={"run": run}, remark=remark)
    for robot in cell.robots:
        texts[robot.name] = render_table(robot, times, q[:, cell.columns(robot.name)], header=header)
    digests = {"run": run, "program": program_digest(texts)}
    for robot in cell.robots:
        table_header = replace(header, verdict="passed", digests=digests, zero=zero_text(robot.model))
        texts[robot.name] = replace_header(texts[robot.name], header=table_header)
    return texts
