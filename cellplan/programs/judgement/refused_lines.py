"""Lines that bodies refuse: tasks whose tools come through by joints only."""

from collections.abc import Sequence

from cellplan.cache import without_cache
from cellplan.model.report.exported import ExportJob, ProgramRows
from cellplan.model.task.task import Task
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.judgement.judge import judged_stretches, played_programs
from cellplan.programs.judgement.judge_path import clearance_findings, line_steps, path_rows, place_on_seam
from cellplan.programs.promises.orders import Orders, blocked_orders
from cellplan.programs.rows.margins import robot_corners
from cellplan.programs.rows.played import ExecutedProgram
from cellplan.programs.shared import Shared


def refused_lines(
    shared: Shared, dialect: Dialect, job: ExportJob, executed: Sequence[ProgramRows], *, orders: Sequence[Orders]
) -> dict[str, str]:
    """Why bodies come too near while tools move on lines, by the names of the tasks; every order of robots counts.

    Where no robot that works carries one of the bodies, all that move on lines in the phase are meant.

    Args:
        job: What was written.
        executed: Its rows as controllers execute them.
        orders: Marks of its programs; empty where robots do not wait for one another.
    """
    refused: dict[str, str] = {}
    with without_cache():
        played = played_programs(shared.run, dialect, job, executed, lead=0.0)
        for place, program in enumerate(played):
            lines = _by_clearance(program, shared, refused)
            if orders and not refused:
                _by_orders(program, shared, lines, (orders[place], executed[place]), refused)
    return refused


def _by_clearance(program: ExecutedProgram, shared: Shared, refused: dict[str, str]) -> dict[int, list[Task]]:
    """Add what refuses lines on the clock of the rows; the tasks that have lines, by the place of their phase."""
    lines: dict[int, list[Task]] = {}
    for stretch in judged_stretches(program):
        rows = path_rows(program, stretch, shared)
        tasks = [scheduled.task for scheduled in rows.schedule.tasks if len(line_steps(rows, scheduled.task))]
        lines[stretch.place] = tasks
        for finding in clearance_findings(rows) if tasks else ():
            for task in [task for task in tasks if task.robot in finding.robots] or tasks:
                refused.setdefault(task.name, place_on_seam(rows, task, finding.at_s) + finding.text)
    return lines


def _by_orders(
    program: ExecutedProgram,
    shared: Shared,
    lines: dict[int, list[Task]],
    marked: tuple[Orders, ProgramRows],
    refused: dict[str, str],
) -> None:
    """Add what refuses lines in another order of the robots between two marks."""
    orders, rows = marked
    blocked = blocked_orders(shared.run, orders, rows, robot_corners(program), known=shared.known_orders)
    for count, finding in blocked:
        movers = {robot for pair in orders.stretches[count].pairs for robot in pair}
        for task in lines.get(orders.stretches[count].place, ()):
            if task.robot in movers:
                refused.setdefault(task.name, finding)
