r"""The path problem: the spline of a positioner and, besides, what a layout may vary; operators follow their tasks.

Each operator has as many joints as its task has components. Tools that stay on their paths move their joints by

.. math:: A_i \, dq_i = -C_i \, dq_c - (\beta_i + \tau_i), \qquad
          A_i \, d\dot q_i = -C_i \, d\dot q_c - dJ_i \, \dot q

with the displacements of bases and tools :math:`\beta, \tau`, and ``dJ`` a sum of Lie brackets of screws as in the
kernel. What the spline does to the positioner is linear in its coefficients.
"""

from dataclasses import dataclass, field
from typing import Final, Protocol

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.frozen import derive
from cellplan.model.cell.cell import joint_at
from cellplan.scene.kinematics.batched import Placement
from cellplan.search.distances.cell_distances import CellDistances
from cellplan.search.kernel.jacobian_changes import JacobianChanges
from cellplan.search.kernel.job import Layouts
from cellplan.search.kernel.screws import Directions, TaskScrews
from cellplan.search.kernel.singular_values import SingularValues
from cellplan.search.kernel.varied import KernelVariables
from cellplan.search.programs.layout_problem import PairsAtNodes, distances_at
from cellplan.search.programs.problem import DRAWS, Distances, Point, PointDerivatives, ProblemFields
from cellplan.search.programs.transfers import Transfers
from cellplan.search.spline_path.nodes import PathNodes
from cellplan.search.spline_path.variables import PathVariables

WAVES: Final = 4  # cosines along the path, from the constant to one and a half periods
SHARE: Final = 0.5  # of a usual step, of the constant; of each further wave less
SMALLER: Final = 0.9  # factor of the next draw where a tool could not follow
MOST_STEPS: Final = 12  # of Newton's method: four from a motion nearby
CONVERGED: Final = 1e-10  # [rad] and [m]: a step below this changes nothing any more
LONGEST: Final = 1.0  # [rad] or [m] of a step: beyond it another solution may be nearer
TORN: Final = 0.1  # [rad] or [m] by which joints may leave their own speeds from node to node
START_STEPS: Final = 30  # of Newton's method to bring the tools to the starts of their paths


class WrittenVariables(KernelVariables, Protocol):
    """Variables of the layout, of which there may be none, that know how the cell file writes them."""

    def values(self, x: Array, start: Array) -> dict[str, object]:
        """What to write into the cell file, by address."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathProblem(ProblemFields):
    """See ``Problem``: the coefficients of the path are the first variables, those of the layout the others."""

    nodes: PathNodes  # the job at its nodes
    path: PathVariables  # the coefficients
    layout: WrittenVariables  # what else may vary
    bodies: CellDistances
    acceleration: Array  # see ``Problem``
    is_dense: bool = field(init=False, default=True)  # its nodes are cheap; wrists near a singularity make peaks narrow

    def __post_init__(self) -> None:
        """Put the variables one after the other."""
        job = self.nodes.job
        derive(self, times=job.times, limits=job.limits)
        derive(self, transfers=Transfers.none(job.cell.joint_count, nodes=len(job.times)))
        path, layout = self.path, self.layout
        given = np.concatenate([path.given.coefficients.ravel(), layout.given])
        derive(self, names=(*path.names, *layout.names), given=given)
        for name in ("lower", "upper", "scale", "cost"):
            derive(self, **{name: np.concatenate([getattr(path, name), getattr(layout, name)])})

    def evaluate(self, x: Array, start: Array, near: Point | None = None) -> Point | None:
        """See ``Problem``."""
        spline, others = self._split(x)
        coefficients = self.path.spline(spline).coefficients
        placement = self.layout.layouts(others[None], start[None]).placement(self.nodes.job)
        q = continued(self.nodes, placement, coefficients, start) if near is None else near.q
        motion = None if q is None else followed(self.nodes, placement, coefficients, q)
        if motion is None:
            return None
        q, qd = motion
        qdd = self.nodes.rates @ qd
        qdd[:, self.nodes.columns] = self.nodes.shares[2] @ coefficients
        return Point(x=x, start=q[0], q=q, qd=qd, qdd=qdd)

    def derivatives(self, point: Point) -> PointDerivatives:
        """See ``Problem``."""
        _, others = self._split(point.x)
        return path_derivatives(
            self.nodes,
            self._layout_at(point),
            point.q,
            point.qd,
            self.layout.directions(others),
            is_accelerating=bool(np.isfinite(self.acceleration).any()),
        )

    def distances(self, point: Point, nodes: Indices, within: float) -> Distances:
        """See ``Problem``."""
        return distances_at(self.bodies, self._split(point.x)[1], point.q, nodes, within)

    def distance_derivatives(self, point: Point, distances: Distances, by_joints: PointDerivatives) -> Array:
        """See ``Problem``."""
        pairs, count, (_, others) = PairsAtNodes.of(distances), len(self.path.names), self._split(point.x)
        near, dq = pairs.near, by_joints.q[pairs.nodes]
        by_path = (near.by_joints[:, None] @ dq[near.samples][..., :count])[:, 0]
        if not len(others):
            return by_path
        return np.concatenate([by_path, self.bodies.derivatives(near, others, dq[..., count:])], axis=1)

    def arms(self, point: Point) -> SingularValues:
        """See ``Problem``."""
        _, others = self._split(point.x)
        return SingularValues.of(
            self.nodes.job, self._layout_at(point), point.q, lambda: self.layout.directions(others)
        )

    def pair_names(self, pair: int) -> tuple[str, str]:
        """See ``Problem``."""
        return self.bodies.pairs[pair].names

    def joint_names(self, column: int) -> tuple[str, str]:
        """See ``Problem``."""
        return joint_at(self.nodes.job.cell, column)

    def values(self, x: Array, start: Array) -> dict[str, object]:
        """What to write into the cell file, by address: the path in place of the start posture of its robot."""
        spline, others = self._split(x)
        values, robot = self.layout.values(others, start), f"robots.{self.path.robot}"
        for key in ("start", "start_deg"):
            values[f"{robot}.{key}"] = None
        values[f"{robot}.path"] = self.path.written(self.nodes.job.cell, spline)
        return values

    def _split(self, x: Array) -> tuple[Array, Array]:
        """The coefficients, and the variables of the layout."""
        count = len(self.path.names)
        return x[:count], x[count:]

    def _layout_at(self, point: Point) -> Layouts:
        """The layout at a point."""
        return self.layout.layouts(self._split(point.x)[1][None], point.start[None])


def path_derivatives(
    nodes: PathNodes, layout: Layouts, q: Array, qd: Array, directions: Directions, *, is_accelerating: bool
) -> PointDerivatives:
    """Derivatives of the motion at all nodes: by all coefficients, one after the other, then by the directions.

    Args:
        q: Joint positions at the nodes in [rad] or [m], shape (N, nq).
        qd: Their speeds, shape (N, nq).
    """
    job, c = nodes.job, nodes.columns
    screws = TaskScrews.of(job, layout, q, directions)
    changes = JacobianChanges.of(job, screws, qd)
    J, nq = changes.jacobian.reshape(len(q), -1, q.shape[1]), q.shape[1]
    blocks = J.reshape(len(q), -1, 6, nq)
    local = [blocks[:, task][..., columns] for task, columns in enumerate(nodes.operators)]
    inverses = np.linalg.inv(np.stack(local, axis=1)) if local else np.zeros((len(q), 0, 6, 6))
    moved = changes.in_rows(np.swapaxes(screws.based + screws.tooled, -1, -2))
    driven, twists = -moved.reshape(len(q), J.shape[1], directions.count), changes.twists()
    coefficients = nodes.count * (c.stop - c.start)
    derivatives = np.zeros((3 if is_accelerating else 2, len(q), nq, coefficients + directions.count))
    for order, shares in enumerate(nodes.shares[: len(derivatives)]):
        _by_spline(derivatives[order], shares, c)
    _add(derivatives[0], nodes, inverses, np.concatenate([-_times(J[..., c], nodes.shares[0]), driven], axis=2))
    turned = twists[..., :nq] @ derivatives[0]
    turned[..., coefficients:] += twists[..., nq:]
    turned[..., :coefficients] += _times(J[..., c], nodes.shares[1])
    _add(derivatives[1], nodes, inverses, -turned)
    if not is_accelerating:
        return PointDerivatives(q=derivatives[0], qd=derivatives[1], qdd=None)
    others = np.ones(nq, dtype=bool)
    others[c] = False
    derivatives[2][:, others] = np.tensordot(nodes.rates, derivatives[1][:, others], axes=1)
    return PointDerivatives(q=derivatives[0], qd=derivatives[1], qdd=derivatives[2])


def _by_spline(derivatives: Array, shares: Array, columns: slice) -> None:
    """Fill in what the coefficients, one configuration after the other, do to the joints of the positioner."""
    count = columns.stop - columns.start
    for joint in range(count):
        derivatives[:, columns.start + joint, joint : shares.shape[1] * count : count] = shares


def _times(C: Array, shares: Array) -> Array:
    """``C dq_c`` for all coefficients of shares (N, count): (N, rows, n) to (N, rows, count n)."""
    return (C[:, :, None, :] * shares[:, None, :, None]).reshape(*C.shape[:2], -1)


def _add(derivatives: Array, nodes: PathNodes, inverses: Array, twists: Array) -> None:
    """Fill in what twists of the tools, shape (N, 6 T, p), ask of the joints of the operators."""
    solved = inverses @ twists.reshape(len(twists), -1, 6, twists.shape[2])
    for task, columns in enumerate(nodes.operators):
        derivatives[:, columns] = solved[:, task]


def followed(nodes: PathNodes, placement: Placement, coefficients: Array, q: Array) -> tuple[Array, Array] | None:
    """Joints and speeds at the nodes, (N, nq) each, near a given motion; None where a tool cannot follow.

    Args:
        coefficients: Of the spline, shape (count, n).
        q: Joint positions that are nearly right in [rad] or [m], shape (N, nq).
    """
    job = nodes.job
    at = np.ascontiguousarray(q.T)
    at[nodes.columns] = (nodes.shares[0] @ coefficients).T
    drift, still, every = np.zeros_like(at), np.zeros_like(at), np.ones(len(at))
    drift[nodes.columns] = (nodes.shares[1] @ coefficients).T
    with np.errstate(all="ignore"):  # what is not a number has not settled
        for _ in range(MOST_STEPS):
            linear = job.tasks.linearise(at, (job.X, job.V), placement, mobile=every)
            step = linear.correction(still)
            longest = float(np.abs(step).max(initial=0.0))
            if not longest <= LONGEST:
                return None
            at = at + step
            if longest <= CONVERGED:
                break
        else:
            return None
        qd = linear.velocities(drift)
    positions, velocities = np.ascontiguousarray(at.T), np.ascontiguousarray(qd.T)
    return (positions, velocities) if _is_one_motion(job.times, positions, velocities) else None


def continued(nodes: PathNodes, placement: Placement, coefficients: Array, start: Array) -> Array | None:
    """The motion from a start posture, node after node; see ``followed`` for the arguments.

    Args:
        coefficients: Of the spline, shape (count, n).
        start: A start posture near the right one, shape (nq,).

    Returns:
        Positions, shape (N, nq); None where a tool cannot follow.
    """
    job, times = nodes.job, nodes.job.times
    given, rates = (share @ coefficients for share in nodes.shares[:2])
    positions, every = np.empty((len(times), len(start))), np.ones(len(start))
    at, drift = start[:, None].copy(), np.zeros((len(start), 1))
    still = np.zeros_like(at)
    with np.errstate(all="ignore"):
        for node in range(len(times)):
            at[nodes.columns, 0] = given[node]
            drift[nodes.columns, 0] = rates[node]
            desired = job.X[..., node : node + 1], job.V[..., node : node + 1]
            for _ in range(MOST_STEPS if node else START_STEPS):
                linear = job.tasks.linearise(at, desired, placement, mobile=every)
                step = linear.correction(still)
                longest = float(np.abs(step).max(initial=0.0))
                at = at + step * min(1.0, LONGEST / max(longest, LONGEST))
                if longest <= CONVERGED:
                    break
            if not longest <= CONVERGED:
                return None
            positions[node] = at[:, 0]
            if node + 1 < len(times):
                at = at + (times[node + 1] - times[node]) * linear.velocities(drift)
    return positions


def _is_one_motion(times: Array, q: Array, qd: Array) -> bool:
    """Whether neighbouring nodes belong together: no joint leaves what its own speeds lead to."""
    step = np.diff(times)[:, None]
    return bool(np.abs(np.diff(q, axis=0) - 0.5 * step * (qd[1:] + qd[:-1])).max(initial=0.0) <= TORN)


def perturbed_path(
    problem: PathProblem, x: Array, start: Array, rng: np.random.Generator, *, size: float
) -> Point | None:
    """A random point near a given one, drawn again and smaller until all tools can follow their paths, or None.

    Args:
        x: The variables, shape (n,).
        start: Start posture near the right one in [rad] or [m], shape (nq,).
        size: Standard deviation in usual steps.
    """
    origin = problem.evaluate(x, start)
    if origin is None:
        return None
    rows, columns = problem.path.given.coefficients.shape
    order = np.arange(WAVES)
    waves = np.cos(np.pi * np.linspace(0.0, 1.0, rows)[:, None] * order) * SHARE / (1.0 + order)
    for _ in range(DRAWS):
        path = (waves @ rng.normal(size=(WAVES, columns))).ravel()
        step = np.concatenate([path, rng.normal(size=len(x) - len(path))])
        point = problem.evaluate(np.clip(x + size * problem.scale * step, problem.lower, problem.upper), start, origin)
        if point is not None:
            return point
        size *= SMALLER
    return None
