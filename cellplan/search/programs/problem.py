"""Problem: what sequential programs know of what they improve; a whole layout, the path of a positioner, or both."""

from dataclasses import dataclass, field
from typing import Final, Protocol

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.model.robot.robot import JointLimits
from cellplan.search.kernel.varied import Varied, VariedFields
from cellplan.search.programs.transfers import Transfers

DRAWS: Final = 40  # [-] until one has a motion


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Point:
    """Values of the variables and the motion that comes of them."""

    x: Array  # the variables, shape (n,)
    start: Array  # start posture of all joints in [rad] or [m], shape (nq,)
    q: Array  # joint positions at the nodes in [rad] or [m], shape (N, nq)
    qd: Array  # their speeds, shape (N, nq)
    qdd: Array  # their accelerations, shape (N, nq)
    rates: Array | None = None  # how speeds change with joints at their node, (N, nq, nq); None if unknown


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PointDerivatives:
    """Derivatives of a motion by the n variables."""

    q: Array  # of the joint positions at the nodes, shape (N, nq, n)
    qd: Array  # of their speeds, shape (N, nq, n)
    qdd: Array | None  # of their accelerations, shape (N, nq, n); None where no joint has a limit of acceleration
    rates: Array | None = None  # see ``Point``


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Distances:
    """Distances of near pairs of bodies at some nodes, M of them."""

    pairs: Indices  # numbers of the pairs, the same at every point, shape (M,)
    nodes: Indices  # nodes of the motion, shape (M,)
    values: Array  # signed distances in [m], shape (M,)
    demands: Array  # what the cell demands of them in [m], shape (M,)
    within_robot: Flags  # whether both bodies belong to one robot, so that its design may set the distance, shape (M,)
    detail: object  # what the problem needs for their derivatives


class ArmValues(Protocol):
    """Least singular values of A arms along a motion."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the robots."""

    @property
    def values(self) -> Array:
        """The values at the nodes in mixed units of [m] and [rad], shape (N, A)."""

    def derivatives(self, nodes: Indices, subjects: Indices, by: Array) -> Array:
        """Derivatives of some of them by the variables, from those of the joints, shape (N, nq, n), to (M, n)."""


class Problem(Varied, Protocol):
    """What sequential programs improve."""

    @property
    def times(self) -> Array:
        """Times of the nodes in [s], from 0 to the end, shape (N,); two nodes may share one where speeds jump."""

    @property
    def transfers(self) -> Transfers:
        """Its motions, those of the phases of a program or a single one, and what leads from one to the next."""

    @property
    def limits(self) -> JointLimits:
        """Limits of the joints."""

    @property
    def acceleration(self) -> Array:
        """Largest accelerations that the joints are judged by in [rad/s^2] or [m/s^2], inf for none, (nq,)."""

    @property
    def is_dense(self) -> bool:
        """Whether the nodes alone count.

        Elsewhere an extreme between two of them is that of the parabola through three: good with few nodes, but it
        jumps where the highest of them becomes another one.
        """

    def evaluate(self, x: Array, start: Array, near: Point | None = None) -> Point | None:
        """The motion at some values; None where a tool does not come to the start of its path, or loses it.

        Args:
            x: The values, shape (n,).
            start: A start posture near the right one, shape (nq,); entries that variables set are ignored.
            near: A point nearby, which makes it quicker.
        """

    def derivatives(self, point: Point) -> PointDerivatives:
        """Derivatives of the motion at a point."""

    def distances(self, point: Point, nodes: Indices, within: float) -> Distances:
        """Pairs of bodies that are less than ``within`` in [m] beyond what is demanded of them, at some nodes."""

    def distance_derivatives(self, point: Point, distances: Distances, by_joints: PointDerivatives) -> Array:
        """Derivatives of distances by the variables, shape (M, n)."""

    def arms(self, point: Point) -> ArmValues:
        """Least singular values of the Jacobians of the arms."""

    def pair_names(self, pair: int) -> tuple[str, str]:
        """Names of the bodies of a pair."""

    def joint_names(self, column: int) -> tuple[str, str]:
        """Names of the robot and the joint at a place of the stacked joints."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProblemFields(VariedFields):
    """What every problem works out when it is made; see ``Problem``."""

    times: Array = field(init=False)
    limits: JointLimits = field(init=False)
    transfers: Transfers = field(init=False)
    is_dense: bool = field(init=False, default=False)


def perturbed(
    problem: Problem, x: Array, start: Array, rng: np.random.Generator, *, size: float = 1.0, draws: int = DRAWS
) -> Point | None:
    """A random point near a given one, drawn again until all tools can follow their paths; None where none can.

    Args:
        x: The variables, shape (n,).
        start: Start posture near the right one in [rad] or [m], shape (nq,).
        size: Standard deviation of each variable in its usual steps.
    """
    for _ in range(draws):
        candidate = x + size * problem.scale * rng.normal(size=len(x))
        point = problem.evaluate(np.clip(candidate, problem.lower, problem.upper), start)
        if point is not None:
            return point
    return None
