"""Map of a base: what becomes of the whole job of a cell when one of its robots stands elsewhere in the plane."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from cellplan.errors import InputError
from cellplan.io.cell.write import written_document
from cellplan.io.run.folder import RunFolder
from cellplan.model.cell import Cell
from cellplan.model.motion import Schedule
from cellplan.model.progress import Progress, silent
from cellplan.model.task import Frame
from cellplan.model.units import DEG, MM
from cellplan.pipeline.base_map.grid import BaseGrid
from cellplan.pipeline.base_map.record import map_record
from cellplan.pipeline.drawing import drawing
from cellplan.pipeline.outcome import solved_outcome
from cellplan.pipeline.plan.rounded import rounded
from cellplan.pipeline.plan.start import chosen_start
from cellplan.pipeline.solution import Solution
from cellplan.pipeline.synchronous import refuse_other_jobs
from cellplan.pipeline.write_run import versions
from cellplan.planning.modes import plan_phases
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.start.given import part_pose
from cellplan.planning.timing.schedule import clock_paths, schedule_paths
from cellplan.report.page.base_map import map_files
from cellplan.report.record.common import Record, number
from cellplan.report.record.key_figures import KeyFigures, key_figures
from cellplan.scene.mounting import Mount, MountedPair
from cellplan.scene.scene import Scene
from cellplan.search.base_map.starts import StartGoal, starts_at
from cellplan.search.base_map.verdicts import MapJob, PlaceVerdict, best_first, judge
from cellplan.search.kernel.job import Job

NODES: Final = 65  # [-] of a motion: with parabolas through them speeds are good to 0.5 %, margins to 0.1 deg
BEST: Final = 10  # [-] places that are listed with their settings
SAME_ANGLE: Final = 1e-9  # [deg]


def base_map(
    cell: Cell, robot: str, grid: BaseGrid | None = None, *, certify: int = 0, progress: Progress = silent
) -> Record:
    """Judge the whole job of a cell with the base of one robot at each place of a grid.

    All other robots, the height and the tilt of the base stay. The motion of every place is worked out anew at 65 nodes
    with the pseudo-inverse of the cell, and judged by position limits, speeds, accelerations and, at up to 33 nodes, by
    the distances that the cell demands. Of several start postures at a place the one that is nearest to the present
    start is tried first, and the first that passes is kept.

    Args:
        cell: The cell, as ``load_cell`` gives it.
        robot: Name of an operator: a robot with a task that does not hold the part.
        grid: Where its base is tried.
        certify: How many of the best places are solved and verified.
        progress: Called with the stage and the fraction done.

    Returns:
        The record of ``map.json``.

    Raises:
        InputError: There is no such operator, the grid is not usable, or the cell is of a kind that is not mapped.
        StartNotFoundError: A start posture is to be found, and there is none at the present base.
    """
    _refuse_other_jobs(cell, robot)
    asked, schedule = _prepared(cell, robot, grid or BaseGrid(), progress)
    progress("finding starts", 0.0)
    placed = asked.scene.cell.robot(robot)
    q, at = starts_at(_goal(asked), asked.places, placed.model, placed.X_WB, seed=cell.solver.seed)
    found = judge(asked, q, at, lambda share: progress("judging places", share))
    best = best_first(found)[: max(BEST, certify)]
    settings = [place_settings(asked, found[place], place) for place in best]
    certified = []
    for done, values in enumerate(settings[:certify]):
        progress("certifying", done / certify)
        outcome = solved_outcome(partial(cell.with_values, values), _figures, file=Path(cell.origin.file))
        certified.append({"status": str(outcome.status), "reason": outcome.reason, "figures": dict(outcome.figures)})
    return map_record(
        asked,
        found,
        best=list(zip(best, settings, strict=True)),
        certified=certified,
        drawn=drawing(asked.scene, asked.start, schedule),
        versions=versions(),
    )


def write_base_map(record: Record, folder: Path) -> None:
    """Write ``map.json``, ``map.html``, ``map.svg`` and ``map.png`` into a folder, which appears whole or not at all.

    Args:
        record: As ``base_map`` returns it.
        folder: The folder; an earlier map there is replaced.

    Raises:
        InputError: The folder cannot be written, or holds something that cellplan did not write.
    """
    with RunFolder(folder) as target:
        for name, content in map_files(record).items():
            target.write_bytes(name, content)


def place_settings(asked: MapJob, found: PlaceVerdict, place: int) -> dict[str, Any]:
    """Values of the cell file that put the robot to a place, with its start posture there, by address."""
    cell, robot, places = asked.scene.cell, asked.scene.cell.robot(asked.robot), asked.places
    xy, base = MM * places.X_WB[place, :2, 3], f"robots.{robot.name}.base"
    values: dict[str, Any] = {f"{base}.x_mm": number(xy[0]), f"{base}.y_mm": number(xy[1])}
    yaw = DEG * places.yaw[place]
    if abs(yaw - DEG * float(np.arctan2(robot.X_WB[1, 0], robot.X_WB[0, 0]))) > SAME_ANGLE:
        values[f"{base}.yaw_deg"] = number(yaw)
    if found.start is not None:
        started = replace(robot, start=rounded(robot, found.start))
        others = tuple(started if each.name == robot.name else each for each in cell.robots)
        entry = written_document(replace(cell, robots=others))["robots"][robot.name]
        values |= {f"robots.{robot.name}.{key}": entry[key] for key in ("start", "start_deg") if key in entry}
    return values


def _figures(solution: Solution) -> KeyFigures:
    """Key figures of a certified place."""
    return key_figures([run.report for run in solution.runs])


def _refuse_other_jobs(cell: Cell, name: str) -> None:
    """Refuse robots that are no operators, and jobs whose motion is not one synchronous pseudo-inverse motion."""
    operators = [task.robot for task in cell.tasks if task.robot not in cell.positioners]
    if name not in operators:
        raise InputError(
            f"--robot: expected a robot with a task that does not hold the part "
            f"({', '.join(dict.fromkeys(operators)) or 'there is none'}), got '{name}'"
        )
    refuse_other_jobs(cell, "a map of bases")


def _prepared(cell: Cell, robot: str, grid: BaseGrid, progress: Progress) -> tuple[MapJob, Schedule]:
    """The scene, the job at its nodes, the start at the present base, and the places."""
    scene = Scene.from_cell(cell)
    paths = clock_paths(cell, [build_toolpath(task, cell.part) for task in cell.tasks])
    start = chosen_start(scene, paths, progress=progress).start
    cell = replace(cell, robots=tuple(replace(each, start=start[cell.columns(each.name)]) for each in cell.robots))
    phase = plan_phases(cell).program[0]
    schedule = schedule_paths(cell, [paths[name] for name in phase.tasks])
    job = Job.of(cell, schedule, moving=phase.moving, nodes=NODES)
    places = grid.places(cell.robot(robot), _part_at(cell)[:3, 3])
    scene = replace(scene, cell=cell, mounted=_standing(scene, robot))
    return MapJob(job=job, scene=scene, robot=robot, start=start, places=places), schedule


def _standing(scene: Scene, robot: str) -> tuple[MountedPair, ...]:
    """Pairs of what never moves that depend on where a robot stands; how deep they may be in each other is judged."""
    return tuple(
        pair
        for pair in scene.mounted
        if pair.mount is Mount.STANDING and robot in {scene.bodies[end].robot for end in (pair.first, pair.second)}
    )


def _goal(asked: MapJob) -> StartGoal:
    """What the robot's tool is to reach at the start."""
    cell, job = asked.scene.cell, asked.job
    place = next(place for place, each in enumerate(job.relations) if each.robot == asked.robot)
    relation = job.relations[place]
    return StartGoal(
        robot=cell.robot(asked.robot),
        chain=asked.scene.chains[asked.robot],
        relation=relation,
        X_RT=job.X[:, :, place, 0],
        X_WR=_part_at(cell) if relation.relative_to is Frame.PART else np.eye(4),
        given=asked.start[cell.columns(asked.robot)],
    )


def _part_at(cell: Cell) -> Any:
    """The part at the start, shape (4, 4)."""
    return part_pose(cell, None if cell.carrier is None else cell.robots[cell.carrier].start)
