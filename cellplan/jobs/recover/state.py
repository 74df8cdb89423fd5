"""Stopped state: where every robot of a verified run stands, where the part is, and what scene that is judged in."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.certify.growth import scene_at_stop
from cellplan.certify.run_pairs import scene_of_rows, scene_of_run
from cellplan.geometry.shapes import Sphere
from cellplan.geometry.transforms import Array
from cellplan.jobs.recover.refusals import END, refuse_state, standing_times
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.motion.motion import Motion
from cellplan.model.motion.plan import Phase
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.model.robot.robot import BASE, Body
from cellplan.model.settings.program import PartPlaceEntry, TransferEntry
from cellplan.model.task.task import Frame
from cellplan.planning.sequence.scenes import StageScenes
from cellplan.planning.sequence.stages import Stage, program_stages
from cellplan.scene.bodies import Kind
from cellplan.scene.scene import Scene

TIP: Final = "tool tip"  # no body of a file has a name with a space
TIP_RADIUS: Final = 1e-5  # [m]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunPlaces:
    """The phases of a run and their scenes."""

    cell: Cell  # the cell, in which no cycle is to be closed any more
    motion: Motion  # all rows of the program
    phases: tuple[Phase, ...]  # its phases with rows, those of all cycles
    stages: tuple[Stage, ...]  # the stages of one cycle of a program from home to home; empty for any other
    scenes: StageScenes  # what the scenes are made by
    tipped: StageScenes  # the same with a small ball at tool tips that work on the part: not all have a body there

    @classmethod
    def of(cls, run: VerifiedRun, transfer: TransferEntry | None = None) -> "RunPlaces":
        """Those of a verified run, and how fast moves off its program may be; None for what the cell says."""
        program = run.cell.program
        program = program if transfer is None else program.model_copy(update={"transfer": transfer})
        cell = replace(run.cell, program=program, motion=replace(run.cell.motion, cyclic=False))
        return cls(
            cell=cell,
            motion=run.motion,
            phases=run.motion.plan.program,
            stages=program_stages(run.cell),
            scenes=StageScenes.of(cell),
            tipped=StageScenes.of(with_tips(cell)),
        )

    def rows(self, place: int) -> slice:
        """The rows of a phase."""
        return self.motion.rows(self.phases[place])

    def at(self, time: float) -> int:
        """Place of the phase that a time of the program belongs to; at a boundary the later one."""
        begins = [float(self.motion.times[self.rows(place).start]) for place in range(len(self.phases))]
        return max(0, int(np.searchsorted(begins, time + END, side="right")) - 1)

    def lying_at(self, place: int) -> PartPlaceEntry | None:
        """Where the part lies in a phase; None while it is held, or fixed anyway."""
        return self.stages[place % len(self.stages)].place if self.stages else None

    def scene_while_stopped(self, lying: PartPlaceEntry | None) -> Scene:
        """The scene of a recovery: the full distance is demanded of all pairs."""
        scene = self.tipped.held if lying is None else self.tipped.with_part_at(lying)
        cell = replace(scene.cell, motion=self.cell.motion)
        return _tips_and_part(scene_at_stop(replace(scene, cell=cell)))

    def scene_of_phase(self, place: int) -> Scene:
        """The scene that the rows of a phase were verified in; their rules are those of its tasks."""
        if not self.stages:
            return scene_of_run(self.scenes.held, self.phases[place].tasks)
        stage = self.stages[place % len(self.stages)]
        scene = scene_of_run(self.scenes.of_stage(stage), self.phases[place].tasks)
        return replace(scene, cell=replace(scene.cell, motion=replace(scene.cell.motion, cyclic=False)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoppedState:
    """Where a cell has stopped."""

    at: float  # time of the program in [s]
    times: Mapping[str, float]  # time of the program at which each robot stands, by its name
    standing: tuple[str, ...]  # names of the robots that are to stand still
    q: Array  # stacked joint positions in [rad] or [m], shape (nq,)
    place: int  # place of the phase of ``at``
    lying: PartPlaceEntry | None  # where the part lies; None while it is held, or fixed anyway

    @property
    def is_on_program(self) -> bool:
        """Whether all robots are where the program has them at one time."""
        return all(time == self.at for time in self.times.values())


def with_tips(cell: Cell) -> Cell:
    """The cell with a small ball at the tip of every tool that works on the part."""
    at_work = {task.robot for task in cell.tasks if task.relative_to is Frame.PART}
    return replace(cell, robots=tuple(_with_tip(robot) if robot.name in at_work else robot for robot in cell.robots))


def _with_tip(robot: Robot) -> Robot:
    """A robot with a ball at the tip of its tool."""
    ball = Body(name=TIP, link=BASE, shape=Sphere(TIP_RADIUS), X_BS=robot.tool.X_FT, accuracy=0.0)
    return replace(robot, tool=replace(robot.tool, bodies=(*robot.tool.bodies, ball)))


def _tips_and_part(scene: Scene) -> Scene:
    """The scene in which a tip is watched beside the part only: to other things it is no body."""
    ball, bodies = f"/{TIP}", list(scene.bodies)
    kinds = [body.kind for body in bodies]
    for robot in scene.cell.robots:
        number = len(robot.tool.bodies)
        if number and robot.tool.bodies[-1].name == TIP:
            name = f"{robot.name}/tool" if number == 1 else f"{robot.name}/tool_{number}"
            place = next(index for index, body in enumerate(bodies) if body.name == name)
            bodies[place] = replace(bodies[place], name=f"{robot.name}{ball}")
    tips = {index for index, body in enumerate(bodies) if body.name.endswith(ball)}
    ends = [(pair.first, pair.second) for pair in scene.pairs]
    free = [
        row for row, both in enumerate(ends) if not tips & set(both) or Kind.PART in {kinds[index] for index in both}
    ]
    return replace(scene_of_rows(scene, free), bodies=tuple(bodies))


def stopped_state(
    places: RunPlaces, *, at: float, frozen: Mapping[str, float], keep: Collection[str] = ()
) -> StoppedState:
    """The state of a run at a time, some robots at another one.

    Args:
        at: Time of the program in [s].
        frozen: Time of the program at which a robot stands instead, by its name.
    """
    cell, motion = places.cell, places.motion
    refuse_state(cell, motion, at=at, frozen=frozen, keep=keep)
    times = standing_times(cell, at, frozen)
    q = np.concatenate([_at(motion, times[robot.name])[cell.columns(robot.name)] for robot in cell.robots])
    held_at = next((times[name] for name in cell.positioners), at)
    return StoppedState(
        at=float(at),
        times=times,
        standing=tuple(name for name in times if name in set(keep)),
        q=q,
        place=places.at(at),
        lying=places.lying_at(places.at(held_at)),
    )


def _at(motion: Motion, time: float) -> Array:
    """Stacked joint positions at a time, linear between rows, shape (nq,)."""
    return np.array([np.interp(time, motion.times, column) for column in motion.q.T])
