"""Motion of a block of a live cell: near the last one by the kernel, by the planner where the kernel does not apply."""

from collections.abc import Iterator
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
    is_awaited: bool = False  # whether it is still worked out; the only row is its start then

    @property
    def is_followed(self) -> bool:
        """Whether the whole job is done."""
        return self.lost_at is None

    def point(self) -> Point:
        """The same for the programs of a search, without the derivatives that are known."""
        return Point(x=self.x, start=self.q[0], q=self.q, qd=self.qd, qdd=self.qdd)


def follow(block: Block, x: Array, near: LiveMotion | None = None) -> LiveMotion:
    """The motion of a block at values of the variables by the kernel; of one that takes long its start alone.

    It begins on the branch of the start that is held to; where that leads nowhere, on that of the motion nearby.

    Args:
        x: The variables of the layout in [m] and [rad], shape (n,).
        near: A motion nearby, which makes it quicker.
    """
    starts = [block.start]
    if near is not None and near.is_begun and np.abs(near.q[0] - block.start).max() > APART:
        starts.append(near.q[0])
    if block.live is not None:
        return _by_kernel(block.live, x, np.array(starts), near)
    motions = [_at_start(block, x, start) for start in starts]
    return next((motion for motion in motions if motion.is_begun), motions[0])


def worked_out(block: Block, motion: LiveMotion) -> Iterator[LiveMotion]:
    """A motion that is awaited, by the kernel, or by the planner where the kernel does not apply."""
    if block.problem is not None:
        yield _by_kernel(block.problem, motion.x, motion.q, None)
        return
    try:
        rows = plan_run(_begun(block, motion.x, motion.q[0]), block.paths, block.stage.phase).motion
    except (InputError, NoSolutionError) as error:
        yield replace(motion, lost_at=0.0, is_begun=False, why=str(error).splitlines()[0], is_awaited=False)
    else:
        yield of_rows(motion.x, rows.times, rows.q)


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


def _at_start(block: Block, x: Array, start: Array) -> LiveMotion:
    """Where the motion begins that the planner has to work out; all tools are at the starts of their paths."""
    cell = _begun(block, x, start)
    try:
        toolpaths = {name: path.toolpath for name, path in block.paths.items()}
        cell, _ = with_seeds(cell, toolpaths, of_run=[robot.name for robot in cell.robots])
    except NoSolutionError:
        return replace(standing(x, _start_of(cell)), lost_at=0.0, is_begun=False, is_awaited=False)
    return standing(x, _start_of(cell))


def standing(x: Array, q: Array) -> LiveMotion:
    """A motion that is awaited, of which the start in [rad] or [m] is known alone, shape (nq,)."""
    still = np.zeros_like(q[None])
    return LiveMotion(x=x, times=np.zeros(1), q=q[None], qd=still, qdd=still, is_awaited=True)


def _start_of(cell: Cell) -> Array:
    """The starts of all robots, shape (nq,)."""
    return np.concatenate([robot.start for robot in cell.robots if robot.start is not None])


def of_rows(x: Array, times: Array, q: Array) -> LiveMotion:
    """A motion of planned rows with times of shape (N,) in [s] and joints of shape (N, nq)."""
    qd = np.gradient(q, times, axis=0)
    return LiveMotion(x=x, times=times, q=q, qd=qd, qdd=np.gradient(qd, times, axis=0), is_planned=True)


def _begun(block: Block, x: Array, start: Array) -> Cell:
    """The cell of a block at values of the variables, its robots on the branches of a start.

    Its steps are as coarse as its method allows.
    """
    placed, given = block.variables.placed(x), block.cell
    start = block.variables.layouts(x[None], start[None]).start[0]
    robots = tuple(replace(robot, start=start[placed.columns(robot.name)]) for robot in placed.robots)
    step = coarser(given, len(block.schedule.times) - 1) * given.motion.step
    return replace(given, robots=robots, part=placed.part, motion=replace(given.motion, step=step))


def coarser(cell: Cell, *counts: int) -> int:
    """How many times as long steps an answer plans motions of so many in: 1 where its method depends on them."""
    if not cell.solver.is_accurate or cell.motion.finer is not None or open_feeds(cell):
        return 1
    whole = (factor for factor in FACTORS if all(count % factor == 0 for count in counts))
    return next((factor for factor in whole if min(counts) // factor >= ROWS), 1)
