"""A cell made ready for a map: its phases of work, its bodies, and the places of one base."""

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
from cellplan.model.progress import Progress, silent
from cellplan.model.task.task import Frame
from cellplan.planning.modes import plan_phases
from cellplan.planning.start.given import part_pose
from cellplan.runs.overrides import with_overrides
from cellplan.runs.plan.work_phases import WorkPhase, work_phases
from cellplan.runs.run_lengths import refuse_open_runs
from cellplan.scene.mounting import Mount, MountedPair
from cellplan.scene.scene import Scene
from cellplan.search.base_map.starts import StartGoal, starts_at
from cellplan.search.base_map.verdicts import MapJob
from cellplan.search.kernel.job import MOST, Job, Layouts, enough_nodes
from cellplan.search.kernel.run import run
from cellplan.search.synchronous import refuse_other_methods
from cellplan.study.bundle import Bundle

NODES: Final = 65  # [-] of a motion at least: with parabolas through them speeds are good to 0.5 %, margins to 0.1 deg


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
    phases: tuple[WorkPhase, ...]  # its phases of work at the present base
    jobs: tuple[MapJob, ...]  # the same with the places

    @property
    def first(self) -> int:
        """The first phase in which the robot works."""
        return next(phase for phase, job in enumerate(self.jobs) if job.works)

    def starts(self) -> list[tuple[Array, Indices]]:
        """For each phase start postures at all places, and the places; see ``starts_at``."""
        return [self._starts(job) for job in self.jobs]

    def _starts(self, job: MapJob) -> tuple[Array, Indices]:
        """Those of one phase; the home everywhere while the robot is idle."""
        placed = job.scene.cell.robot(job.robot)
        if not job.works:
            at = np.arange(len(job.places))
            return np.tile(job.start[job.scene.cell.columns(job.robot)], (len(at), 1)), at
        return starts_at(_goal(job), job.places, placed.model, placed.X_WB, seed=self.cell.solver.seed)


def prepared(cell: Cell, robot: str, grid: BaseGrid, progress: Progress = silent) -> PreparedMap:
    """The scene and the job of each phase of work at its nodes, its start at the present base, and the places.

    Raises:
        InputError: There is no such operator, the grid is not usable, or the cell is of a kind that is not mapped.
        NoSolutionError: The other robots have no start posture, or the part cannot be gripped or put down.
    """
    refuse_map(cell, robot, grid)
    phases = tuple(work_phases(cell, robot, progress))
    first = next(work for work in phases if robot not in work.phase.idle)
    places = grid.places(cell.robot(robot), _part_at(first.scene.cell)[:3, 3])
    jobs = [
        MapJob(
            name=work.name,
            job=_job(work),
            scene=replace(work.scene, mounted=_standing(work.scene, robot)),
            robot=robot,
            start=work.start,
            places=places,
        )
        for work in phases
    ]
    return PreparedMap(cell=cell, phases=phases, jobs=tuple(jobs))


@lru_cache(maxsize=1)
def prepared_request(request: MapRequest) -> PreparedMap:
    """What a request is about; made once in each process, see ``prepared``."""
    return prepared(requested_cell(request), request.robot, request.grid)


def requested_cell(request: MapRequest) -> Cell:
    """The cell with all that the request sets in it."""
    cell = load_cell(request.cell, allow_dirs=request.allow_dirs)
    return with_overrides(cell, request.settings, mode=request.mode)


def files_of(request: MapRequest) -> Bundle:
    """The files that a map reads."""
    return Bundle.of([(request.cell, requested_cell(request))], allow_dirs=request.allow_dirs)


def refuse_map(cell: Cell, name: str, grid: BaseGrid) -> None:
    """Refuse a map that cannot be made; call it early, before any long work.

    Raises:
        InputError: The robot is not an operator, the grid is not usable, or the motion is none of the pseudo-inverse
            as written.
    """
    operators = [task.robot for task in cell.tasks if task.robot not in cell.positioners]
    if name not in operators:
        raise InputError(
            f"--robot: expected a robot with a task that does not hold the part "
            f"({', '.join(dict.fromkeys(operators)) or 'there is none'}), got '{name}'"
        )
    refuse_other_methods(cell, "a map of bases")
    refuse_open_runs(cell, "a map of bases")
    if not cell.program.is_home_to_home:
        plan_phases(cell)  # refuses modes that need a program, and robots with two tasks at once
    grid.refuse(cell.robot(name))


def _job(work: WorkPhase) -> Job:
    """The job of a phase, its nodes doubled until its present motion is followed, or lost at the same time again."""
    cell, nodes, lost_before = work.scene.cell, enough_nodes(work.schedule, NODES), np.nan
    while True:
        job = Job.of(cell, work.schedule, moving=work.phase.moving, nodes=nodes)
        lost_at = float(run(job, Layouts.of([cell], work.start[None])).lost_at[0])
        is_certain = lost_at == lost_before or abs(lost_at - lost_before) <= job.times[-1] / nodes
        if is_certain or np.isposinf(lost_at) or nodes >= MOST:
            return job
        nodes, lost_before = 2 * nodes - 1, lost_at


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
