"""Where robots leave their tasks: tools with a free spin turn on the way as ``solve`` plans them."""

from collections.abc import Mapping

from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.arrays import Array
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.jobs.assign.written import holder_at, task_values
from cellplan.planning.sequence.arrangement import with_tasks
from cellplan.runs.plan.sequence import plan_work
from cellplan.search.assign.problem.instance import EndIdentity, Instance
from cellplan.search.assign.schedules.order import SequencedBlocks


def planned_ends(draft: AssignmentDraft, instance: Instance, sequenced: SequencedBlocks) -> Mapping[EndIdentity, Array]:
    """Where tasks of a sequence with a free spin end, in [rad] or [m], shape (n,) each, of those not planned before.

    There are none where one of them cannot be planned.
    """
    values, identities = dict[str, object](), dict[str, EndIdentity]()
    for station, ends in sequenced.stops:
        for end in ends if station not in instance.columns else ():
            if end is not None and draft.cell.task(end.mode.task).is_spin_free and end.identity not in instance.planned:
                values |= task_values(draft.cell, end, (), holder_at(instance, station))
                identities[end.mode.task] = end.identity
    try:
        work = plan_work(with_tasks(draft.cell.with_values(values), identities)) if identities else None
    except (InputError, NoSolutionError):
        return {}
    return {
        identities[task.name]: stage.motion.q[-1, stage.stage.cell.columns(task.robot)]
        for stage in (work.stages if work else ())
        for task in stage.stage.cell.tasks
    }
