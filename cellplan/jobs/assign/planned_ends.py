"""Where robots leave their tasks, and when: as ``solve`` plans tools with a free spin, and retimes tasks."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Final

from cellplan.errors import InputError, NoSolutionError
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.jobs.assign.written import holder_at, task_values
from cellplan.model.cell.cell import Cell, Timing
from cellplan.model.motion.plan import Plan
from cellplan.planning.sequence.arrangement import with_tasks
from cellplan.runs.plan.program import ProgramClock
from cellplan.runs.plan.retiming import retimed
from cellplan.runs.plan.sequence import plan_work
from cellplan.search.assign.problem.instance import EndIdentity, Instance, PlannedEnd
from cellplan.search.assign.schedules.order import SequencedBlocks

FASTEST: Final = {"motion.timing": str(Timing.FASTEST)}


def planned_ends(
    draft: AssignmentDraft, instance: Instance, sequenced: SequencedBlocks
) -> Mapping[EndIdentity, PlannedEnd]:
    """What becomes known of tasks of a sequence that were not planned before, each by itself; nothing where one fails.

    Of a tool without a free spin nothing does unless its task is retimed.
    """
    is_retimed = draft.cell.motion.timing is not Timing.AS_WRITTEN
    values, identities = dict[str, object](FASTEST if is_retimed else {}), dict[str, EndIdentity]()
    for station, ends in sequenced.stops:
        for end in ends if station not in instance.columns else ():
            if end is None or end.identity in instance.planned:
                continue
            if is_retimed or draft.cell.task(end.mode.task).is_spin_free:
                values |= task_values(draft.cell, end, (), holder_at(instance, station))
                identities[end.mode.task] = end.identity
    if not identities:
        return {}
    try:
        planned = _one_by_one(with_tasks(draft.cell.with_values(values), identities))
    except (InputError, NoSolutionError):
        return {}
    return {identities[name]: end for name, end in planned.items()}


def _one_by_one(cell: Cell) -> dict[str, PlannedEnd]:
    """The tasks of a cell by name, each in a block of its own."""
    after = (replace(task, after=(before.name,)) for before, task in pairwise(cell.tasks))
    work = plan_work(replace(cell, tasks=(*cell.tasks[:1], *after)))
    plan = Plan(phases=tuple(stage.stage.phase for stage in work.stages))
    clock = ProgramClock.of(work.cell, plan, [stage.schedule for stage in work.stages])
    motions = retimed([it.scene for it in work.stages], clock, [it.motion for it in work.stages])[1]
    is_retimed = cell.motion.timing is not Timing.AS_WRITTEN
    return {
        task.name: PlannedEnd(q=motion.q[-1, cell.columns(task.robot)], steps=len(motion.q) - 1 if is_retimed else None)
        for stage, motion in zip(work.stages, motions, strict=True)
        for task in stage.stage.cell.tasks
    }
