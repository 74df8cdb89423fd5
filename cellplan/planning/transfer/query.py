"""Transfer query: from which configuration to which, who moves, and why there is no way."""

from dataclasses import dataclass

import numpy as np

from cellplan.certify.certify import certify
from cellplan.errors import TransferNotFoundError
from cellplan.geometry.transforms import Array
from cellplan.model.report import ClearanceClass
from cellplan.model.units import MM
from cellplan.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TransferQuery:
    """What is asked for.

    Attributes:
        scene: The scene of the phase.
        start: Stacked joint positions in [rad] or [m], shape (nq,).
        goal: Likewise.
        movers: Names of the robots that move, in the order of the cell.
        velocity: Largest speed of every joint in [rad/s] or [m/s], shape (nq,).
        seed: Seed of what is drawn.
    """

    scene: Scene
    start: Array
    goal: Array
    movers: tuple[str, ...]
    velocity: Array
    seed: int

    @classmethod
    def of(cls, scene: Scene, start: Array, goal: Array, *, seed: int) -> "TransferQuery":
        """Find out who moves."""
        cell = scene.cell
        differs = start != goal
        movers = tuple(robot.name for robot in cell.robots if np.any(differs[cell.columns(robot.name)]))
        velocity = np.concatenate([robot.model.velocity for robot in cell.robots])
        return cls(scene=scene, start=start, goal=goal, movers=movers, velocity=velocity, seed=seed)

    def seconds_between(self, first: Array, second: Array) -> float:
        """Time in [s] that the slowest joint needs from one stacked configuration to another at top speed."""
        return float((np.abs(second - first) / self.velocity).max())

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
