"""Transfer query: from which configuration to which, and which robots move."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.planning.transfer.trees import JointBox
from cellplan.scene.scene import Scene

STAGE: Final = "planning transfer moves"
ENDLESS: Final = np.pi  # [rad] by which a joint without limits may go beyond its start and its goal


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TransferQuery:
    """What is asked for."""

    scene: Scene  # the scene of the phase: its pairs carry the demands that count in it
    start: Array  # stacked joint positions in [rad] or [m], shape (nq,)
    goal: Array  # likewise
    movers: tuple[str, ...]  # names of the robots that move, in the order of the cell
    seed: int  # seed of what is drawn; the same one gives the same rows
    home: Array | None = None  # homes of all robots, shape (nq,); None where robots have none to back off to

    @classmethod
    def of(cls, scene: Scene, start: Array, goal: Array, *, seed: int, home: Array | None = None) -> "TransferQuery":
        """Find out who moves."""
        cell = scene.cell
        differs = start != goal
        movers = tuple(robot.name for robot in cell.robots if np.any(differs[cell.columns(robot.name)]))
        return cls(scene=scene, start=start, goal=goal, movers=movers, seed=seed, home=home)

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

    @property
    def place(self) -> str:
        """Where in the cell file the robots that move stand."""
        return self.scene.cell.origin.at(f"robots.{self.movers[0]}" if len(self.movers) == 1 else "robots")

    @property
    def named(self) -> str:
        """The robots that move."""
        return ", ".join(f"'{name}'" for name in self.movers) or "no robot"
