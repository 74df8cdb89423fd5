"""Motion of a block of a live cell: near the last one by the kernel, by the planner where the kernel does not apply."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Cell
from cellplan.planning.start.seeds import with_seeds
from cellplan.runs.greatest_feeds import open_feeds
from cellplan.runs.plan.run import plan_run
from cellplan.search.kernel.run import Motions, run, run_near
from cellplan.search.programs.layout_problem import LayoutProblem
from cellplan.search.programs.problem import Point
from cellplan.session.blocks import Block

ROWS: Final = 400  # [-] of a motion that is planned anew for an answer, where the steps of its cell are finer
PASSED: Final = 1e-5  # [rad] and [m] that the last pass of the kernel may still change
APART: Final = 1e-6  # [rad] or [m] between two starts that are the same
FACTORS: Final = (50, 40, 25, 20, 16, 10, 8, 5, 4, 2)  # [-] times as long steps, the longest first


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LiveMotion:
    """A motion of all joints as far as all tools follow their paths."""

    x: Array  # the variables of the layout in [m] and [rad], shape (n,)
    times: Array  # in [s] on the clock of the block, shape (N,); two may be equal where speeds jump
    q: Array  # stacked joint positions in [rad] or [m], shape (N, nq)
    qd: Array  # their speeds, shape (N, nq)
    qdd: Array  # their accelerations, shape (N, nq)
    lost_at: float | None = None  # when a tool loses its path in [s]; None where all are followed
    is_begun: bool = True  # whether all tools come to the starts of their paths
    why: str = ""  # what the planner says of a motion that there is not
    is_planned: bool = False  # whether its rows are those of the planner

    @property
    def is_followed(self) -> bool:
        """Whether the whole job is done."""
        return self.lost_at is None

    def point(self) -> Point:
        """The same for the programs of a search, without the derivatives that are known."""
        return Point(x=self.x, start=self.q[0], q=self.q, qd=self.qd, qdd=self.qdd)


def follow(block: Block, x: Array, near: LiveMotion | None = None) -> LiveMotion:
    """The motion of a block at values of the variables.

    It begins on the branch of the start that is kept to; where that leads nowhere, on that of the motion nearby.

    Args:
        x: The variables of the layout in [m] and [rad], shape (n,).
        near: A motion nearby, which makes it quicker.
    """
    starts = [block.start]
    if near is not None and near.is_begun and np.abs(near.q[0] - block.start).max() > APART:
        starts.append(near.q[0])
    if block.problem is not None:
        return _by_kernel(block.problem, x, np.array(starts), near)
    best: LiveMotion | None = None
    for start in starts:
        motion = _planned(block, x, start)
        if motion.is_followed:
            return motion
        if best is None or (motion.lost_at or 0.0) > (best.lost_at or 0.0):
            best = motion
    return best or motion


def _by_kernel(problem: LayoutProblem, x: Array, starts: Array, near: LiveMotion | None) -> LiveMotion:
    """The motion at the nodes of the kernel, from the first of some starts that leads farthest, shape (K, nq)."""
    job, layouts = problem.job, problem.variables.layouts(np.tile(x, (len(starts), 1)), starts)
    first = layouts.of_places(slice(1))
    is_near = near is not None and near.is_followed and len(near.q) == len(job.times)
    motions = run_near(job, first, near.q[None], accuracy=PASSED) if near is not None and is_near else None
    if motions is None or not motions.is_followed[0]:
        several = run(job, layouts)
        best = int(np.argmax(several.lost_at))
        first = layouts.of_places(slice(best, best + 1))
        motions = Motions(q=several.q[[best]], qd=several.qd[[best]], lost_at=several.lost_at[[best]])
        if motions.is_followed[0]:  # the integral of the passes, whatever a motion came from
            motions = run_near(job, first, motions.q, accuracy=PASSED)
    q, qd, lost_at = _followed(motions, job.times)
    count = len(q)
    rates = job.rates[:count, :count] if count == len(job.times) else np.zeros((count, count))
    is_begun = bool(np.isfinite(lost_at) or np.isposinf(lost_at))
    if not is_begun:
        q, qd = first.start, np.zeros_like(first.start)
    return LiveMotion(
        x=x,
        times=job.times[:count],
        q=q,
        qd=qd,
        qdd=rates @ qd,
        lost_at=None if np.isposinf(lost_at) else max(float(lost_at), 0.0),
        is_begun=is_begun,
    )


def _followed(motions: Motions, times: Array) -> tuple[Array, Array, float]:
    """Joints and speeds at the nodes up to where the tools follow, one at least, and when one is lost in [s]."""
    lost_at = float(motions.lost_at[0])
    count = len(times) if np.isposinf(lost_at) else max(1, int(np.searchsorted(times, lost_at)))
    q, qd = (np.ascontiguousarray(part[0, :count]) for part in (motions.q, motions.qd))
    return q, qd, lost_at


def _planned(block: Block, x: Array, start: Array) -> LiveMotion:
    """The motion as the planner has it, in steps that are as coarse as its method allows."""
    cell = _begun(block, x, start)
    toolpaths = {name: path.toolpath for name, path in block.paths.items()}
    try:
        seeded, _ = with_seeds(cell, toolpaths, of_run=[robot.name for robot in cell.robots])
    except NoSolutionError:
        return _at_start(x, cell, "the start of a path is out of reach on the branch of the start")
    try:
        rows = plan_run(seeded, block.paths, block.stage.phase).motion
    except (InputError, NoSolutionError) as error:
        return _at_start(x, cell, str(error).splitlines()[0])
    return of_rows(x, rows.times, rows.q)


def _at_start(x: Array, cell: Cell, why: str) -> LiveMotion:
    """All robots where a cell begins, as there is no motion."""
    q = np.concatenate([robot.start for robot in cell.robots if robot.start is not None])[None]
    still = np.zeros_like(q)
    return LiveMotion(x=x, times=np.zeros(1), q=q, qd=still, qdd=still, lost_at=0.0, is_begun=False, why=why)


def of_rows(x: Array, times: Array, q: Array) -> LiveMotion:
    """A motion of planned rows with times of shape (N,) in [s] and joints of shape (N, nq)."""
    qd = np.gradient(q, times, axis=0)
    return LiveMotion(x=x, times=times, q=q, qd=qd, qdd=np.gradient(qd, times, axis=0), is_planned=True)


def _begun(block: Block, x: Array, start: Array) -> Cell:
    """The cell of a block at values of the variables, its robots on the branches of a start, its steps coarser."""
    placed, given = block.variables.placed(x), block.cell
    start = block.variables.layouts(x[None], start[None]).start[0]
    robots = tuple(replace(robot, start=start[placed.columns(robot.name)]) for robot in placed.robots)
    step = coarser(given, len(block.schedule.times) - 1) * given.motion.step
    return replace(given, robots=robots, part=placed.part, motion=replace(given.motion, step=step))


def coarser(cell: Cell, count: int) -> int:
    """How many times as long steps an answer plans a motion of so many in: 1 where its method depends on them."""
    if not cell.solver.is_accurate or cell.motion.finer is not None or open_feeds(cell):
        return 1
    return next((factor for factor in FACTORS if count % factor == 0 and count // factor >= ROWS), 1)
