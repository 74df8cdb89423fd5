"""Where robots leave their tasks: tools with a free spin turn on the way as ``solve`` plans them."""

from collections.abc import Collection, Mapping

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.arrays import Array
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.jobs.assign.written import holder_at, task_values
from cellplan.model.answers import Answers
from cellplan.model.cell.cell import Cell
from cellplan.planning.sequence.arrangement import with_tasks
from cellplan.runs.plan.sequence import plan_work
from cellplan.search.assign.problem.instance import EndIdentity, Instance
from cellplan.search.assign.schedules.order import SequencedBlocks


def planned_ends(
    draft: AssignmentDraft, answers: Answers, instance: Instance, sequenced: SequencedBlocks
) -> Mapping[EndIdentity, Array]:
    """Where tasks of a sequence with a free spin end, in [rad] or [m], shape (n,) each, of those not planned before.

    There are none where one of them cannot be planned.
    """
    values, identities = dict[str, object](), dict[str, EndIdentity]()
    for station, ends in sequenced.stops:
        for end in ends if station not in instance.columns else ():
            if end is not None and draft.cell.task(end.mode.task).is_spin_free and end.identity not in instance.planned:
                values |= task_values(draft.cell, end, (), holder_at(instance, station))
                identities[end.mode.task] = end.identity
    if not identities:
        return {}
    ends = answers("planned ends", str(values), lambda: _ends_of(draft.cell, values, identities))
    return {identities[task]: np.array(q, dtype=float) for task, q in ends.items()}


def _ends_of(cell: Cell, values: Mapping[str, object], tasks: Collection[str]) -> dict[str, list[float]]:
    """Where the robots of some tasks end, by task, planned with some values of the cell file."""
    try:
        work = plan_work(with_tasks(cell.with_values(values), tasks))
    except (InputError, NoSolutionError):
        return {}
    return {
        task.name: stage.motion.q[-1, stage.stage.cell.columns(task.robot)].tolist()
        for stage in work.stages
        for task in stage.stage.cell.tasks
    }
