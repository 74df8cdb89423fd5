"""Lines that bodies refuse: tasks whose tools come through by joints only."""

from collections.abc import Iterator, Sequence
from functools import partial

from cellplan.cache import without_cache
from cellplan.model.report.exported import ExportJob, ProgramRows
from cellplan.model.task.task import Task
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.judgement.judge import judged_stretches, played_programs
from cellplan.programs.judgement.judge_path import clearance_findings, line_steps, line_width, path_rows, place_on_seam
from cellplan.programs.promises.orders import Orders, blocked_orders
from cellplan.programs.rows.margins import robot_corners
from cellplan.programs.rows.played import ExecutedProgram
from cellplan.programs.shared import Shared


def refused_lines(
    shared: Shared, dialect: Dialect, job: ExportJob, executed: Sequence[ProgramRows], *, orders: Sequence[Orders]
) -> dict[str, str]:
    """Why bodies come too near while tools move on lines, by the names of the tasks; every order of robots counts.

    Of two tools on lines the one is meant whose joints these lead farther astray: it may do that one of them moves by
    joints. Where no robot that works carries one of the bodies, all that move on lines in the phase are meant.

    Args:
        job: What was written.
        executed: Its rows as controllers execute them.
        orders: Marks of its programs; empty where robots do not wait for one another.
    """
    refused: dict[str, str] = {}
    with without_cache():
        for place, program in enumerate(played_programs(shared.run, dialect, job, executed, lead=0.0)):
            marked = (orders[place], executed[place]) if orders and not refused else None
            for tasks, reasons in _reasons(program, shared, marked):
                if refused.keys().isdisjoint(tasks):
                    refused |= reasons
    return refused


def _reasons(
    program: ExecutedProgram, shared: Shared, marked: tuple[Orders, ProgramRows] | None
) -> Iterator[tuple[frozenset[str], dict[str, str]]]:
    """Tasks whose lines bring bodies too near, and why some of them, by name, move by joints.

    That is on the clock of the rows, or else between marks in another order.
    """
    lines, is_clear = dict[int, list[Task]](), True
    for stretch in judged_stretches(program):
        rows = path_rows(program, stretch, shared)
        tasks = [scheduled.task for scheduled in rows.schedule.tasks if len(line_steps(rows, scheduled.task))]
        lines[stretch.place] = sorted(tasks, key=partial(line_width, rows), reverse=True)
        for finding in clearance_findings(rows) if tasks else ():
            is_clear = False
            carrying = [task for task in tasks if task.robot in finding.robots]
            widest = max(carrying, key=partial(line_width, rows, at_s=finding.at_s), default=None)
            reasons = {
                task.name: place_on_seam(rows, task, finding.at_s) + finding.text
                for task in ([widest] if widest is not None else tasks)
            }
            yield frozenset(task.name for task in carrying or tasks), reasons
    if marked is None or not is_clear:
        return
    orders, read = marked
    for count, text in blocked_orders(shared.run, orders, read, robot_corners(program), known=shared.known_orders):
        between = orders.stretches[count]
        movers = {robot for pair in between.pairs for robot in pair}
        names = [task.name for task in lines.get(between.place, ()) if task.robot in movers]
        yield frozenset(names), dict.fromkeys(names[:1], text)
