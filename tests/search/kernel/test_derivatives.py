"""Derivatives of motions against central differences: of whole runs, and at one node of cells of every kind."""

from types import SimpleNamespace

import numpy as np
import pytest
from builders.batch_cells import CELLS, configurations, everyone, relations, seen_poses

from cellplan.geometry.transforms import Array, rotation_exp
from cellplan.model.cell.cell import Cell
from cellplan.planning.collocation.batch_tasks import BatchTasks, Linearisation
from cellplan.planning.tracking.task_constraints import TaskConstraints
from cellplan.search.kernel.derivatives import Rates, differentiate
from cellplan.search.kernel.figures import MotionFigures
from cellplan.search.kernel.job import Job, Layouts
from cellplan.search.kernel.run import run
from cellplan.search.kernel.screws import Directions

STEP = 1e-5
FINE = 1e-5  # its square is what central differences leave; rounding leaves less
RANK = 1e-9  # [-] of the largest singular value, below which a twist is none that joints can give


def displaced(layout: Layouts, directions: Directions, step: float) -> Layouts:
    """The layout moved along each direction, one candidate each."""
    p = directions.count
    X_WB, X_FT = np.tile(layout.X_WB, (p, 1, 1, 1)), np.tile(layout.X_FT, (p, 1, 1, 1))
    for X, twists in ((X_WB, directions.base), (X_FT, directions.tool)):
        moved = np.moveaxis(step * twists, 2, 0)
        X[..., :3, :3] = rotation_exp(moved[..., 3:]) @ X[..., :3, :3]
        X[..., :3, 3] += moved[..., :3]
    start, weights = layout.start + step * directions.start.T, layout.weights + step * directions.weights.T
    return Layouts(X_WB=X_WB, X_FT=X_FT, start=start, weights=weights)


def off_by(result: Array, expected: Array) -> float:
    """Norm of the difference as a share of the norm of what is expected."""
    return float(np.linalg.norm(result - expected) / np.linalg.norm(expected))


def test_derivatives_of_the_reference_cell_are_those_of_its_run(reference: SimpleNamespace) -> None:
    job = Job.of(reference.cell, reference.schedule, moving=reference.moving, nodes=65)
    directions = Directions.none(job, 29)
    for robot in range(3):
        for place, axis in enumerate((0, 1, 2, 5)):
            directions.base[robot + 1, axis, 4 * robot + place] = 1.0
        for place, axis in enumerate((0, 2, 4)):
            directions.tool[robot + 1, axis, 17 + 3 * robot + place] = 1.0
    directions.start[np.arange(1, 6), np.arange(12, 17)] = 1.0
    directions.weights[[1, 2], [26, 26]] = 1.0
    directions.base[0, 3, 27] = 1.0
    directions.tool[0, 4, 28] = 1.0
    layout = reference.layouts.of_places(slice(6, 7))
    motion = run(job, layout)
    assert motion.is_followed.all()
    derivatives = differentiate(job, layout, motion.q[0], motion.qd[0], directions)
    ahead, behind = (run(job, displaced(layout, directions, sign * STEP)) for sign in (1.0, -1.0))

    q, qd = (np.moveaxis((getattr(ahead, name) - getattr(behind, name)) / (2 * STEP), 0, -1) for name in ("q", "qd"))
    assert off_by(derivatives.q, q) < 0.005
    assert off_by(derivatives.qd, qd) < 0.005
    for place in range(directions.count):
        assert off_by(derivatives.q[..., place], q[..., place]) < 0.005
    for name, values in (("speeds", derivatives.qd / job.limits.velocity[:, None]), ("beyond_upper", derivatives.q)):
        peaks = getattr(MotionFigures.of(job, motion), name)
        sides = [getattr(MotionFigures.of(job, entry), name).value for entry in (ahead, behind)]
        assert off_by(peaks.derivatives(0, values), ((sides[0] - sides[1]) / (2 * STEP)).T) < 0.005


def one_node(cell: Cell, q: Array, *, seed: int) -> Job:
    """A job of one node, at which the tools are where a configuration has them and move at random."""
    X = np.moveaxis(seen_poses(cell, q.T), (0, 1), (3, 2))
    moving, tasks = everyone(cell), relations(cell)
    V = np.random.default_rng(seed).normal(size=(6, len(tasks), 1))
    constraints = TaskConstraints.of(cell, tasks, moving)
    return Job(
        cell=cell,
        relations=tuple(tasks),
        moving=tuple(moving),
        tasks=BatchTasks(cell, tasks, moving),
        constraints=constraints,
        settling=np.ones(cell.joint_count),
        limits=cell.joint_limits,
        times=np.zeros(1),
        X=X,
        V=V,
        is_begin=np.ones(1, dtype=bool),
        steps=np.zeros((0, 3)),
        rates=np.zeros((1, 1)),
        integral=np.zeros((1, 1)),
    )


def smallest(linear: Linearisation, twists: Array, mobility: Array) -> Array:
    """The smallest weighted joint vector, shape (nq,), with given twists of the tools, shape (6, tasks).

    It comes from the singular values of the whole Jacobian. The product inverts the block of each operator first, and
    of one that cannot do its task alone it loses as many digits as the block is singular: others on each processor.
    """
    unit = np.diag((mobility > 0.0).astype(float))
    J = linear._arrow.twists(*linear._tasks.unstacked(unit)).reshape(-1, len(unit))
    root = np.sqrt(mobility)
    result: Array = root * (np.linalg.pinv(J * root, rcond=RANK) @ twists.ravel())
    return result


def settled_speeds(job: Job, layouts: Layouts, q: Array) -> tuple[Array, Array]:
    """Configurations near given ones, shape (nq, p), with the tools back at their poses, and the speeds there."""
    q, speeds = q.copy(), np.empty_like(q)
    weights = np.broadcast_to(layouts.weights.T, q.shape)
    for place in range(q.shape[1]):
        at = slice(place, place + 1)
        layout, mobility = layouts.of_places(at), job.constraints.may_move / weights[:, place]
        for _ in range(4):
            linear = job.tasks.linearise(
                q[:, at], (job.X, job.V), layout.placement(job), mobile=np.ones(len(q)), weights=weights[:, at]
            )
            speeds[:, place] = smallest(linear, linear._turned(linear._desired)[..., 0], mobility)
            q[:, place] += smallest(linear, linear._turned(linear.errors)[..., 0], mobility)
    return q, speeds


@pytest.mark.parametrize("name", CELLS)
def test_speeds_of_every_kind_of_cell_change_as_the_equations_say(name: str) -> None:
    cell = CELLS[name]
    q, nq, robots = configurations(cell, 1, seed=2), cell.joint_count, len(cell.robots)
    job, rng = one_node(cell, q, seed=4), np.random.default_rng(5)
    layout = Layouts.of([cell], q.T)
    directions = Directions.none(job, 6)
    directions.base[:], directions.tool[:] = rng.normal(size=(2, robots, 6, 6))
    directions.weights[:] = rng.normal(size=(nq, 6)) * 0.1
    _, qd = settled_speeds(job, layout, q)
    rates = Rates(job, layout, q.T, qd.T, directions)
    by_joints, by_layout = rates.by_joints, rates.by_layout
    moved = rng.normal(size=(nq, 6))
    expected = (by_joints[0] @ moved + by_layout[0]) * FINE

    sides = [settled_speeds(job, displaced(layout, directions, s * FINE), q + s * (moved * FINE)) for s in (1.0, -1.0)]

    result = np.concatenate([0.5 * (ahead - behind) for ahead, behind in zip(*sides, strict=True)])
    scale = np.abs(expected).max(axis=1, keepdims=True) + np.abs(expected[: len(expected) // 2]).max()
    np.testing.assert_allclose(result / scale, expected / scale, atol=1e-5)
