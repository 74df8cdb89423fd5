"""Columns: blocks in which the part moves, planned as ``solve`` plans them and kept where they pass every check."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.checks.verify import completed, verify_motion
from cellplan.errors import InputError, NoSolutionError
from cellplan.files.run.joint_tables import parse_table
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.jobs.assign.written import task_values
from cellplan.model.answers import Answers
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

Configurations = dict[str, list[list[float]]]  # of robots, in the order of time, by name


def verified_columns(
    draft: AssignmentDraft, goals: Sequence[TaskGoal], scene: Scene, progress: Progress, answers: Answers
) -> list[Column]:
    """Columns of one draft: first those of tasks that have fewest so far, of many tasks at once.

    Args:
        scene: The scene of its cell.
        answers: What plans candidates, or records how they were planned.
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
        planned = None if search.meet(candidate) else _planned(cell, search.stations, candidate, answers)
        if planned is not None:
            columns.append(_column(candidate, planned, search.stations))
            alike[_who(candidate)] += 1
            of_task.update(option.mode.task for option in candidate)
    return columns


def _planned(cell: Cell, stations: Stations, candidate: Candidate, answers: Answers) -> Configurations | None:
    """Configurations of a candidate as its block is planned; None where that cannot be, or fails a check."""
    place, holder = candidate[0].mode.station, str(stations.holder)
    values: dict[str, object] = {}
    for option in candidate:
        end = End(mode=option.mode, is_reversed=option.is_reversed)
        values |= task_values(cell, end, (), (holder, stations.q[place]))
        values |= {f"tasks.{option.mode.task}.holder_moves": True}

    def planned() -> Configurations | None:
        try:
            work = plan_work(with_tasks(cell.with_values(values), [option.mode.task for option in candidate]))
        except (InputError, NoSolutionError):
            return None
        if not _passes(work.cell, work.stages[0]):
            return None
        q = work.stages[0].motion.q
        rows = spread_rows(len(q), len(candidate[0].q))
        names = [holder, *(option.mode.robot for option in candidate)]
        return {name: q[rows][:, cell.columns(name)].tolist() for name in names}

    return answers("block with a moving part", str(values), planned)


def _column(candidate: Candidate, planned: Configurations, stations: Stations) -> Column:
    """A candidate with the configurations of its block, as they were planned."""
    moved = np.array(planned[str(stations.holder)])
    in_time = {option.mode.robot: np.array(planned[option.mode.robot]) for option in candidate}
    return Column(
        modes=tuple(replace(it.mode, q=in_time[it.mode.robot][:: -1 if it.is_reversed else 1]) for it in candidate),
        begin=moved[0],
        end=moved[-1],
        X_WP=stations.X_WP[candidate[0].mode.station],
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
