"""A problem whose optima are known in closed form."""

from dataclasses import dataclass, field

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.model.robot.robot import JointLimits
from cellplan.search.programs.problem import Distances, Point, PointDerivatives
from cellplan.search.programs.transfers import Transfers

END = 2.0  # [s]
NODES = 41
TIMES = np.linspace(0.0, END, NODES)
LAW, LAW_D, LAW_DD = TIMES - np.sin(np.pi * TIMES) / np.pi, 1.0 - np.cos(np.pi * TIMES), np.pi * np.sin(np.pi * TIMES)
DEMAND = 0.1  # [m]


@dataclass(frozen=True)
class Toy:
    """Two joints that turn by ``2 x0`` and ``2 (3 - x0)``, and two bodies ``x1 - x0^2`` apart at all times.

    Speeds as shares of their limits are ``x0`` and ``6 - 2 x0``: the shortest cycle is 4 s at ``x0 = 2``.
    """

    upper_limit: float = 100.0
    acceleration: Array = field(default_factory=lambda: np.full(2, np.inf))
    names: tuple[str, ...] = ("x0", "x1")
    lower: Array = field(default_factory=lambda: np.array([0.1, -5.0]))
    upper: Array = field(default_factory=lambda: np.array([10.0, 10.0]))
    scale: Array = field(default_factory=lambda: np.array([0.5, 1.0]))
    cost: Array = field(default_factory=lambda: np.array([2.0, 3.0]))
    given: Array = field(default_factory=lambda: np.array([0.5, 4.5]))
    times: Array = field(default_factory=lambda: TIMES)
    transfers: Transfers = field(default_factory=lambda: Transfers.none(2, nodes=NODES))
    is_dense: bool = False
    reaches: float = 9.0  # largest x0 with a motion

    @property
    def limits(self) -> JointLimits:
        return JointLimits(
            lower=np.full(2, -100.0),
            upper=np.array([self.upper_limit, 100.0]),
            velocity=np.array([2.0, 1.0]),
            acceleration=self.acceleration,
            is_revolute=np.ones(2, dtype=bool),
        )

    def evaluate(self, x: Array, start: Array, near: Point | None = None) -> Point | None:
        if x[0] > self.reaches:
            return None
        share = np.array([x[0], 3.0 - x[0]])
        return Point(x=x, start=start, q=LAW[:, None] * share, qd=LAW_D[:, None] * share, qdd=LAW_DD[:, None] * share)

    def derivatives(self, point: Point) -> PointDerivatives:
        by = np.array([[1.0, 0.0], [-1.0, 0.0]])
        q, qd, qdd = (law[:, None, None] * by for law in (LAW, LAW_D, LAW_DD))
        return PointDerivatives(q=q, qd=qd, qdd=qdd if np.isfinite(self.acceleration).any() else None)

    def distances(self, point: Point, nodes: Indices, within: float) -> Distances:
        value = point.x[1] - point.x[0] ** 2
        count = 1 if value < DEMAND + within else 0
        return Distances(
            pairs=np.zeros(count, dtype=np.intp),
            nodes=nodes[:count],
            values=np.full(count, value),
            demands=np.full(count, DEMAND),
            within_robot=np.zeros(count, dtype=bool),
            detail=None,
        )

    def distance_derivatives(self, point: Point, distances: Distances, by_joints: PointDerivatives) -> Array:
        return np.tile([-2.0 * point.x[0], 1.0], (len(distances.pairs), 1))

    def arms(self, point: Point) -> "Toy.Arms":
        """One arm whose least singular value is half of x1 at all times."""
        return Toy.Arms(values=np.full((NODES, 1), 0.5 * point.x[1]))

    @dataclass(frozen=True)
    class Arms:
        values: Array
        names: tuple[str, ...] = ("robot",)

        def derivatives(self, nodes: Indices, subjects: Indices, by: Array) -> Array:
            return np.tile([0.0, 0.5], (len(nodes), 1))

    def pair_names(self, pair: int) -> tuple[str, str]:
        return "one", "other"

    def joint_names(self, column: int) -> tuple[str, str]:
        return "robot", f"joint_{column}"
