"""Job: the clocked tasks of one cell at the nodes that the motions of all its layouts are worked out at."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.model.cell.cell import Cell, Relation
from cellplan.model.motion.motion import Schedule
from cellplan.model.robot.robot import JointLimits
from cellplan.planning.collocation.batch_targets import desired_motion
from cellplan.planning.collocation.batch_tasks import BatchTasks
from cellplan.planning.collocation.start_offset import settling_joints
from cellplan.planning.tracking.given_path import GivenVelocities
from cellplan.planning.tracking.motion_task import closures
from cellplan.planning.tracking.task_constraints import TaskConstraints
from cellplan.scene.kinematics.batched import Placement

SAME_TWIST: Final = 1e-9  # [m/s] and [rad/s] by which a desired twist may differ on both sides of a time and not jump
STRAIGHT: Final = 0.1  # [-] of the largest twist: up to that parabolas through nodes are good to 1 %
PER_KNOT: Final = 16  # [-] nodes between two knots of a path at most: a cubic piece is straight enough by then
MOST: Final = 1025  # [-] nodes; the matrices of a job have as many rows and columns
ORDER: Final = 3  # of the multistep rule: nodes that a prediction looks back on


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Job:
    """What the motions of all layouts of a cell share.

    Where a desired twist jumps there are two nodes at one time, which see it from either side.
    """

    cell: Cell  # the cell: its robots, part, limits and the weights that layouts have unless they state their own
    relations: tuple[Relation, ...]  # the tasks, then the grasps of further holders that move
    moving: tuple[str, ...]  # names of the robots that move
    tasks: BatchTasks  # pose errors and linearisation of the relations
    constraints: TaskConstraints  # which components they constrain, by which joints
    settling: Array  # 1 for joints that bring the tools to the starts of their paths, shape (nq,)
    limits: JointLimits  # limits of the stacked joints
    times: Array  # times of the nodes in [s], shape (N,), from 0 to the end
    X: Array  # desired tool poses in the frames of the relations, shape (4, 4, relations, N)
    V: Array  # their twists, linear part first, along the axes of these frames, in [m/s] and [rad/s], (6, relations, N)
    is_begin: Array  # whether a node begins a stretch on which the desired twists are continuous, shape (N,)
    steps: Array  # weights in [s] of the rates at a node and the two before in the multistep rule, shape (N - 1, 3)
    rates: Array  # derivatives by time in [1/s] at the nodes, of what is given at them, shape (N, N)
    integral: Array  # integrals in [s] from the first node to each, of what is given at the nodes, shape (N, N)
    # velocities in [rad/s] or [m/s] that are added in the null space at the nodes, shape (N, nq); None for none
    drift: Array | None = None

    @classmethod
    def of(
        cls, cell: Cell, schedule: Schedule, *, moving: Sequence[str], nodes: int, denser: Sequence[float] = ()
    ) -> "Job":
        """Place nodes evenly between the times at which the desired motion is not smooth.

        Args:
            denser: Times in [s] about which there are more: the steps there are a third as long.
        """
        if any(robot.path is not None for robot in cell.robots):
            raise ValueError("job: expected joints that follow from the tasks, got a given path of the positioner's")
        times, begins, ends = _nodes(schedule.jumps, nodes, denser)
        _, V = desired_motion(schedule.paths, closures(cell, moving))(times, begins, ends)
        is_double = np.append(np.diff(times) == 0.0, False)
        is_smooth = np.abs(V[..., 1:] - V[..., :-1]).max(axis=(0, 1)) <= SAME_TWIST
        is_distinct = ~(is_double & np.append(is_smooth, False))
        return cls.at_nodes(
            cell, schedule, moving=moving, nodes=(times[is_distinct], begins[is_distinct], ends[is_distinct])
        )

    @classmethod
    def at_nodes(
        cls, cell: Cell, schedule: Schedule, *, moving: Sequence[str], nodes: tuple[Array, Array, Array]
    ) -> "Job":
        """The job at given nodes.

        Args:
            nodes: Times of the nodes in [s], never falling, and begin and end of the stretch of each, shape (N,) each.
        """
        grasps = closures(cell, moving)
        relations: tuple[Relation, ...] = (*(path.task for path in schedule.paths), *grasps)
        times, begins, ends = nodes
        X, V = desired_motion(schedule.paths, grasps)(times, begins, ends)
        is_begin = np.append(True, np.diff(times) == 0.0)
        stated = GivenVelocities.of(cell, float(times[-1]), moving)
        return cls(
            cell=cell,
            relations=relations,
            moving=tuple(moving),
            tasks=BatchTasks(cell, relations, moving),
            constraints=TaskConstraints.of(cell, relations, moving),
            settling=settling_joints(cell, [path.task for path in schedule.paths]),
            limits=cell.joint_limits,
            times=times,
            X=X,
            V=V,
            is_begin=is_begin,
            steps=_multistep(times, is_begin),
            rates=_rates(times, is_begin),
            integral=_integral(times, is_begin),
            drift=None if stated is None else stated.at(times).T,
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Layouts:
    """Candidates for one cell: the same job with other bases, tools, start postures and joint weights."""

    X_WB: Array  # bases in the world, shape (K, robots, 4, 4)
    X_FT: Array  # tool tips in the flange frames, shape (K, robots, 4, 4)
    start: Array  # start postures in [rad] or [m], shape (K, nq); the tools need only be near the starts of their paths
    weights: Array  # weights of the joints in the pseudo-inverse, shape (K, nq)

    def __post_init__(self) -> None:
        """Check at the door that all belong together and are finite, and that all weights are positive."""
        count, robots = self.X_WB.shape[:2]
        shapes = (self.X_WB.shape, self.X_FT.shape, self.start.shape[:1], self.weights.shape)
        if shapes != ((count, robots, 4, 4), (count, robots, 4, 4), (count,), self.start.shape):
            raise ValueError(
                "layouts: expected X_WB and X_FT of shape (K, robots, 4, 4), start and weights of shape (K, nq), got "
                f"{self.X_WB.shape}, {self.X_FT.shape}, {self.start.shape} and {self.weights.shape}"
            )
        if not all(np.all(np.isfinite(part)) for part in (self.X_WB, self.X_FT, self.start, self.weights)):
            raise ValueError("layouts: a pose, a start posture or a weight is not finite")
        if not np.all(self.weights > 0.0):
            raise ValueError("layouts: expected positive weights of all joints")

    @classmethod
    def of(cls, cells: Sequence[Cell], start: Array) -> "Layouts":
        """Those of given cells with start postures, shape (K, nq)."""
        return cls(
            X_WB=np.array([[robot.X_WB for robot in cell.robots] for cell in cells]),
            X_FT=np.array([[robot.tool.X_FT for robot in cell.robots] for cell in cells]),
            start=np.asarray(start, dtype=float),
            weights=np.array([np.concatenate([robot.weights for robot in cell.robots]) for cell in cells]),
        )

    def __len__(self) -> int:
        """Number of candidates."""
        return len(self.start)

    def of_places(self, places: slice | Indices) -> "Layouts":
        """Some of the candidates."""
        parts = (self.X_WB, self.X_FT, self.start, self.weights)
        X_WB, X_FT, start, weights = (part[places] for part in parts)
        return Layouts(X_WB=X_WB, X_FT=X_FT, start=start, weights=weights)

    def placement(self, job: Job) -> Placement:
        """Where the robots and tools of the candidates are, as a batch."""
        return job.tasks.chains.placements(self.X_WB, self.X_FT)


def enough_nodes(schedule: Schedule, fewest: int) -> int:
    """Number of nodes, at least about ``fewest``, that resolve the desired motion of all tools.

    It is doubled until the desired twists are nearly linear between nodes, up to ``PER_KNOT`` between two knots.
    """
    most = min(MOST, PER_KNOT * (len(schedule.breaks) - len(schedule.jumps)))
    count, bend = fewest, _bend(schedule, fewest) if fewest < most else 0.0
    while count < most and bend > STRAIGHT:
        count = 2 * count - 1
        bend = _bend(schedule, count)
    return count


def _bend(schedule: Schedule, count: int) -> float:
    """Largest distance of desired twists from straight lines between nodes, as a share of the largest twist."""
    times, begins, ends = _nodes(schedule.jumps, count, ())
    desired = desired_motion(schedule.paths, ())
    V = desired(times, begins, ends)[1]
    is_step = np.diff(times) > 0.0
    largest = np.maximum(np.linalg.norm(V.reshape(2, 3, -1), axis=1).max(axis=1), SAME_TWIST)
    bends = [0.0]
    for share in (0.25, 0.5, 0.75):
        between = (times[:-1] + share * np.diff(times))[is_step]
        straight = ((1.0 - share) * V[..., :-1] + share * V[..., 1:])[..., is_step]
        off = desired(between, begins[:-1][is_step], ends[:-1][is_step])[1] - straight
        bends += (np.linalg.norm(off.reshape(2, 3, -1), axis=1).max(axis=1) / largest).tolist()
    return max(bends)


def _nodes(jumps: Array, count: int, denser: Sequence[float]) -> tuple[Array, Array, Array]:
    """Times of the nodes, both ends of every stretch included, and begin and end in [s] of the stretch of each."""
    parts = []
    for begin, end in pairwise(jumps.tolist()):
        intervals = max(ORDER, round((count - 1) * (end - begin) / float(jumps[-1] - jumps[0])))
        times = _with_thirds(np.linspace(begin, end, intervals + 1), denser)
        parts.append(np.stack([times, np.full_like(times, begin), np.full_like(times, end)]))
    times, begins, ends = np.concatenate(parts, axis=1)
    return times, begins, ends


def _with_thirds(times: Array, denser: Sequence[float]) -> Array:
    """Times with the steps next to some times, and the one before and behind it, cut into thirds."""
    concerned = {
        near
        for time in denser
        if times[0] <= time <= times[-1]
        for near in range(int(np.searchsorted(times, time)) - 2, int(np.searchsorted(times, time)) + 1)
    }
    cut = np.array(sorted(near for near in concerned if 0 <= near < len(times) - 1), dtype=np.intp)
    step = times[cut + 1] - times[cut]
    return np.sort(np.concatenate([times, times[cut] + step / 3.0, times[cut] + step / 1.5]))


def _multistep(times: Array, is_begin: Array) -> Array:
    r"""Weights of the rates at a node and the ones before it: the integral of their parabola over the next step.

    The Adams-Bashforth rule of third order for uneven steps; of second order after the second node of a stretch, of
    first order after its first one.
    """
    weights, known = np.zeros((len(times) - 1, ORDER)), 0
    for node in range(len(times) - 1):
        known = 1 if is_begin[node] else min(known + 1, ORDER)
        step = times[node + 1] - times[node]
        back = times[node - known + 1 : node + 1][::-1] - times[node]
        weights[node, :known] = _over_step(back, step)
    return weights


def _integral(times: Array, is_begin: Array) -> Array:
    """See ``Job``: over each step, of the cubic through the four nodes of its stretch that are nearest to it."""
    steps = np.zeros((len(times), len(times)))
    for begin, end in _stretches(is_begin):
        for node in range(begin, end - 1):
            first = min(max(begin, node - 1), max(begin, end - ORDER - 1))
            near = slice(first, min(first + ORDER + 1, end))
            steps[node + 1, near] = _over_step(times[near] - times[node], times[node + 1] - times[node])
    return np.cumsum(steps, axis=0)


def _rates(times: Array, is_begin: Array) -> Array:
    """See ``Job``: of the parabola through the three nodes of its stretch that are nearest to each."""
    rates = np.zeros((len(times), len(times)))
    for begin, end in _stretches(is_begin):
        for node in range(begin, end):
            first = min(max(begin, node - 1), max(begin, end - ORDER))
            near = slice(first, min(first + ORDER, end))
            powers, step = np.arange(near.stop - first), times[begin + 1] - times[begin]
            places = (times[near] - times[node]) / step
            rates[node, near] = np.linalg.solve(places ** powers[:, None], (powers == 1) / step)
    return rates


def _stretches(is_begin: Array) -> Iterator[tuple[int, int]]:
    """First node of each stretch, and the first one after it."""
    return pairwise([*np.flatnonzero(is_begin).tolist(), len(is_begin)])


def _over_step(places: Array, step: float) -> Array:
    """Weights of values at places in [s] seen from a node: the integral of their polynomial over a step from it."""
    if step == 0.0:  # from one side of a time to the other
        return np.zeros(len(places))
    powers = np.arange(len(places))
    return np.linalg.solve((places / step) ** powers[:, None], step / (powers + 1.0))
