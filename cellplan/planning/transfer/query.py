"""Transfer query: from which configuration to which, who moves, and why there is no way."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.certify.certify import certify
from cellplan.errors import TransferNotFoundError
from cellplan.geometry.transforms import Array
from cellplan.model.report import ClearanceClass
from cellplan.model.units import MM
from cellplan.planning.transfer.trees import JointBox
from cellplan.scene.scene import Scene

STAGE: Final = "planning transfer moves"
ENDLESS: Final = np.pi  # [rad] by which a joint without limits may go beyond its start and its goal


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TransferQuery:
    """What is asked for.

    Attributes:
        scene: The scene of the phase.
        start: Stacked joint positions in [rad] or [m], shape (nq,).
        goal: Likewise.
        movers: Names of the robots that move, in the order of the cell.
        seed: Seed of what is drawn.
    """

    scene: Scene
    start: Array
    goal: Array
    movers: tuple[str, ...]
    seed: int

    @classmethod
    def of(cls, scene: Scene, start: Array, goal: Array, *, seed: int) -> "TransferQuery":
        """Find out who moves."""
        cell = scene.cell
        differs = start != goal
        movers = tuple(robot.name for robot in cell.robots if np.any(differs[cell.columns(robot.name)]))
        return cls(scene=scene, start=start, goal=goal, movers=movers, seed=seed)

    def ends_of(self, robot: str) -> tuple[Array, Array]:
        """Start and goal of one robot in [rad] or [m], shape (n,) each."""
        columns = self.scene.cell.columns(robot)
        return self.start[columns], self.goal[columns]

    def standing(self, moved: Collection[str]) -> Array:
        """Stacked joint positions when some robots stand at their goals and the others at their starts, shape (nq,)."""
        q = self.start.copy()
        for name in moved:
            columns = self.scene.cell.columns(name)
            q[columns] = self.goal[columns]
        return q

    def box(self, robot: str) -> JointBox:
        """Configurations that a robot may be in."""
        model, ends = self.scene.cell.robot(robot).model, np.array(self.ends_of(robot))
        lower = np.where(np.isfinite(model.lower), model.lower, ends.min(axis=0) - ENDLESS)
        upper = np.where(np.isfinite(model.upper), model.upper, ends.max(axis=0) + ENDLESS)
        return JointBox(
            lower=np.minimum(lower, ends.min(axis=0)),
            upper=np.maximum(upper, ends.max(axis=0)),
            velocity=model.velocity,
        )

    def require_free_ends(self) -> None:
        """Refuse a start or a goal that keeps less distance than is demanded.

        Raises:
            TransferNotFoundError: With the pair of bodies, their distance and what is demanded.
        """
        for name, q in (("start", self.start), ("goal", self.goal)):
            at_rest = np.array([q, q])
            if certify(self.scene, at_rest, with_minimum=False).is_kept:
                continue
            bound = certify(self.scene, at_rest)
            pairs = [pair for kind in ClearanceClass for pair in bound.of_class(kind) if not pair.is_kept]
            worst = min(pairs, key=lambda pair: (pair.proved - pair.demand, pair.row))
            first, second = bound.names(worst)
            held = "touches" if worst.touches else f"is {worst.proved * MM:.3g} mm from"
            demand = f", {worst.demand * MM:g} mm are demanded" if worst.keeps_clearance else ""
            raise TransferNotFoundError(
                f"{self.place}: the {name} of the transfer move of {self.named} comes too close: '{first}' {held} "
                f"'{second}'{demand}: let approach and retract leave more room, or move one of the two"
            )

    @property
    def place(self) -> str:
        """Where in the cell file the robots that move stand."""
        return self.scene.cell.origin.at(f"robots.{self.movers[0]}" if len(self.movers) == 1 else "robots")

    @property
    def named(self) -> str:
        """The robots that move."""
        return ", ".join(f"'{name}'" for name in self.movers) or "no robot"

    def not_found(self) -> TransferNotFoundError:
        """The error of a query without a way."""
        return TransferNotFoundError(f"{self.place}: found no transfer move of {self.named}")
