"""A cell made ready for a map: its job, its bodies, and the places of one base."""

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell
from cellplan.geometry.arrays import Array, Indices
from cellplan.jobs.base_map.grid import BaseGrid
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Schedule
from cellplan.model.progress import Progress, silent
from cellplan.model.task.task import Frame
from cellplan.planning.modes import plan_phases
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.start.given import part_pose
from cellplan.planning.timing.schedule import clock_paths, schedule_paths
from cellplan.runs.overrides import with_overrides
from cellplan.runs.plan.start import chosen_start
from cellplan.scene.mounting import Mount, MountedPair
from cellplan.scene.scene import Scene
from cellplan.search.base_map.starts import StartGoal, starts_at
from cellplan.search.base_map.verdicts import MapJob
from cellplan.search.kernel.job import Job, enough_nodes
from cellplan.search.synchronous import refuse_other_jobs

NODES: Final = 65  # [-] of a motion: with parabolas through them speeds are good to 0.5 %, margins to 0.1 deg


@dataclass(frozen=True, slots=True, kw_only=True)
class MapRequest:
    """What a map is made of, in plain data that a worker process can be sent.

    Attributes:
        cell: The cell file.
        robot: Name of an operator: a robot with a task that does not hold the part.
        grid: Where its base is tried.
        allow_dirs: Further folders that the files it names may lie in.
        settings: Values set in the cell, each as ``KEY=VALUE``.
        mode: Mode of the motion; None for that of the cell.
        formats: Formats of the picture beside SVG.
    """

    cell: Path
    robot: str
    grid: BaseGrid = BaseGrid()  # noqa: RUF009 - frozen
    allow_dirs: tuple[Path, ...] = ()
    settings: tuple[str, ...] = ()
    mode: str | None = None
    formats: tuple[str, ...] = ()

    @property
    def anywhere(self) -> "MapRequest":
        """The same request for processes that run in other folders."""
        folders = tuple(path.absolute() for path in self.allow_dirs)
        return replace(self, cell=self.cell.absolute(), allow_dirs=folders)

    @property
    def record(self) -> dict[str, Any]:
        """The request as it stands in a study."""
        grid = self.grid
        spans = {"x_mm": grid.x and list(grid.x), "y_mm": grid.y and list(grid.y)}
        return {
            "robot": self.robot,
            **spans,
            "grid_mm": grid.step,
            "yaw_deg": grid.yaw,
            "settings": list(self.settings),
            "mode": self.mode,
        }


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PreparedMap:
    """A cell of which a map is made."""

    cell: Cell  # the cell as it is asked for
    job: MapJob  # its job and the places
    schedule: Schedule  # the tasks on the common clock

    def starts(self) -> tuple[Array, Indices]:
        """Start postures at all places, and the places; see ``starts_at``."""
        job = self.job
        placed = job.scene.cell.robot(job.robot)
        return starts_at(_goal(job), job.places, placed.model, placed.X_WB, seed=self.cell.solver.seed)


def prepared(cell: Cell, robot: str, grid: BaseGrid, progress: Progress = silent) -> PreparedMap:
    """The scene, the job at its nodes, the start at the present base, and the places.

    Raises:
        InputError: There is no such operator, the grid is not usable, or the cell is of a kind that is not mapped.
        StartNotFoundError: A start posture is to be found, and there is none at the present base.
    """
    refuse_map(cell, robot, grid)
    scene = Scene.from_cell(cell)
    paths = clock_paths(cell, [build_toolpath(task, cell.part) for task in cell.tasks])
    start = chosen_start(scene, paths, progress=progress).start
    robots = tuple(replace(robot, start=start[cell.columns(robot.name)]) for robot in cell.robots)
    placed = replace(cell, robots=robots)
    phase = plan_phases(placed).program[0]
    schedule = schedule_paths(placed, [paths[name] for name in phase.tasks])
    job = Job.of(placed, schedule, moving=phase.moving, nodes=enough_nodes(schedule, NODES))
    places = grid.places(placed.robot(robot), _part_at(placed)[:3, 3])
    scene = replace(scene, cell=placed, mounted=_standing(scene, robot))
    map_job = MapJob(job=job, scene=scene, robot=robot, start=start, places=places)
    return PreparedMap(cell=cell, job=map_job, schedule=schedule)


@lru_cache(maxsize=1)
def prepared_request(request: MapRequest) -> PreparedMap:
    """What a request is about; made once in each process, see ``prepared``."""
    return prepared(requested_cell(request), request.robot, request.grid)


def requested_cell(request: MapRequest) -> Cell:
    """The cell with all that the request sets in it."""
    cell = load_cell(request.cell, allow_dirs=request.allow_dirs)
    return with_overrides(cell, request.settings, mode=request.mode)


def refuse_map(cell: Cell, name: str, grid: BaseGrid) -> None:
    """Refuse a map that cannot be made; call it early, before any long work.

    Raises:
        InputError: The robot is not an operator, the grid is not usable, or the job is not one synchronous
            pseudo-inverse motion.
    """
    operators = [task.robot for task in cell.tasks if task.robot not in cell.positioners]
    if name not in operators:
        raise InputError(
            f"--robot: expected a robot with a task that does not hold the part "
            f"({', '.join(dict.fromkeys(operators)) or 'there is none'}), got '{name}'"
        )
    refuse_other_jobs(cell, "a map of bases")
    grid.refuse(cell.robot(name))


def _standing(scene: Scene, robot: str) -> tuple[MountedPair, ...]:
    """Pairs of what never moves that depend on where a robot stands; how deep they may be in each other is judged."""
    return tuple(
        pair
        for pair in scene.mounted
        if pair.mount is Mount.STANDING and robot in {scene.bodies[end].robot for end in (pair.first, pair.second)}
    )


def _goal(map_job: MapJob) -> StartGoal:
    """What the robot's tool is to reach at the start."""
    cell, job = map_job.scene.cell, map_job.job
    place = next(place for place, relation in enumerate(job.relations) if relation.robot == map_job.robot)
    relation = job.relations[place]
    return StartGoal(
        robot=cell.robot(map_job.robot),
        chain=map_job.scene.chains[map_job.robot],
        relation=relation,
        X_RT=job.X[:, :, place, 0],
        X_WR=_part_at(cell) if relation.relative_to is Frame.PART else np.eye(4),
        given=map_job.start[cell.columns(map_job.robot)],
    )


def _part_at(cell: Cell) -> Any:
    """The part at the start, shape (4, 4)."""
    return part_pose(cell, None if cell.carrier is None else cell.robots[cell.carrier].start)
