"""Columns: blocks in which the part moves, planned as ``solve`` plans them and kept where they pass every check."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from cellplan.checks.verify import completed, verify_motion
from cellplan.errors import InputError, NoSolutionError
from cellplan.files.run.joint_tables import parse_table
from cellplan.geometry.arrays import Array
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.jobs.assign.written import task_values
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import Progress
from cellplan.planning.sequence.arrangement import with_tasks
from cellplan.runs.early_clearance import without_curves
from cellplan.runs.plan.sequence import PlannedStage, plan_work
from cellplan.runs.solve import render_program
from cellplan.scene.scene import Scene
from cellplan.search.assign.problem.clearance import ScenesByRobot, spread_rows
from cellplan.search.assign.problem.goals import Stations, TaskGoal
from cellplan.search.assign.problem.instance import End
from cellplan.search.assign.problem.moving_blocks import Candidate, Column, MovingBlockSearch

MOST_PLANNED: Final = 40  # candidates
MOST_ALIKE: Final = 2  # columns of the same tasks by the same robots


def verified_columns(
    draft: AssignmentDraft, goals: Sequence[TaskGoal], scene: Scene, progress: Progress
) -> list[Column]:
    """Columns of one draft: first those of tasks that have fewest so far, of many tasks at once.

    Args:
        scene: The scene of its cell.
    """
    cell = draft.cell
    search = MovingBlockSearch(
        cell=cell,
        goals=goals,
        stations=draft.stations(),
        spins=draft.spins(),
        scenes=ScenesByRobot(scene),
        home=draft.home,
        conflict=draft.settings.conflict_mm.si,
    )
    left, columns = search.candidates(), list[Column]()
    of_task, alike = Counter[str](), Counter[frozenset[tuple[str, str]]]()
    tried = set[frozenset[tuple[str, str, int, float]]]()
    for number in range(MOST_PLANNED):
        left = [it for it in left if alike[_who(it)] < MOST_ALIKE and _how(it) not in tried]
        if not left:
            break
        progress("blocks with a moving part", number / MOST_PLANNED)
        candidate = min(left, key=lambda it: (sum(of_task[option.mode.task] for option in it) / len(it), -len(it)))
        tried.add(_how(candidate))
        column = None if search.meet(candidate) else verified_column(cell, search.stations, candidate)
        if column is not None:
            columns.append(column)
            alike[_who(candidate)] += 1
            of_task.update(option.mode.task for option in candidate)
    return columns


def verified_column(cell: Cell, stations: Stations, candidate: Candidate) -> Column | None:
    """A candidate as its block is planned; None where that cannot be, or fails a check."""
    place, holder = candidate[0].mode.station, str(stations.holder)
    values: dict[str, object] = {}
    for option in candidate:
        end = End(mode=option.mode, is_reversed=option.is_reversed)
        values |= task_values(cell, end, (), (holder, stations.q[place]))
        values |= {f"tasks.{option.mode.task}.holder_moves": True}
    names = [option.mode.task for option in candidate]
    try:
        work = plan_work(with_tasks(cell.with_values(values), names))
    except (InputError, NoSolutionError):
        return None
    stage, q = work.stages[0], work.stages[0].motion.q
    if not _passes(work.cell, stage):
        return None
    moved = q[:, cell.columns(holder)]
    rows = spread_rows(len(q), len(candidate[0].q))

    def resolved(name: str, *, is_reversed: bool) -> Array:
        in_time: Array = q[rows][:, cell.columns(name)]
        return in_time[::-1] if is_reversed else in_time

    return Column(
        modes=tuple(replace(it.mode, q=resolved(it.mode.robot, is_reversed=it.is_reversed)) for it in candidate),
        begin=moved[0],
        end=moved[-1],
        X_WP=stations.X_WP[place],
    )


def _passes(cell: Cell, planned: PlannedStage) -> bool:
    """Whether the rows of a stage pass every check of a run."""
    tables = render_program(cell, planned.motion).tables.items()
    rows = [parse_table(text, f"tables/{robot}.csv") for robot, text in tables]
    phase = planned.stage.phase
    report = verify_motion(planned.scene, planned.schedule, rows, moving=phase.moving, idle=phase.idle)
    clearance = without_curves(planned.scene, planned.schedule, planned.motion.q)
    return all(check.passed for check in completed(report, clearance).checks)


def _who(candidate: Candidate) -> frozenset[tuple[str, str]]:
    """Tasks of a candidate and their robots."""
    return frozenset((option.mode.task, option.mode.robot) for option in candidate)


def _how(candidate: Candidate) -> frozenset[tuple[str, str, int, float]]:
    """The same with the place of the begin and the spins: other branches hardly move in another way."""
    modes = (option.mode for option in candidate)
    return frozenset((mode.task, mode.robot, mode.station, mode.spin) for mode in modes)
