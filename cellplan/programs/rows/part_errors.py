"""Tools and further holders on the part: where they are for given joint positions, and how far two motions differ."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.checks.tools.tracking import errors_on_part
from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell.cell import Cell, Relation
from cellplan.model.task.task import Frame, Task
from cellplan.scene.kinematics.screw_chain import ScrewChain

LEFT_OVER: Final = 0.8  # [-] of what a cell allows between rows; the rest is for the run itself and for rounding


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ToolsOnPart:
    """Tasks that are worked on and closures of a cell, as far as a set of robots takes part in them."""

    cell: Cell  # the cell, as it is in a phase
    chains: Mapping[str, ScrewChain]  # kinematics by robot
    relations: tuple[Relation, ...]  # the tasks, and the grasps of further holders
    names: tuple[str, ...]  # what each is called in messages
    movers: tuple[frozenset[str], ...]  # names of the robots that move each
    allowed: tuple[tuple[float, float], ...]  # largest errors that the cell allows between rows, in [m] and [rad]

    @classmethod
    def of(
        cls, cell: Cell, chains: Mapping[str, ScrewChain], *, tasks: Collection[str], robots: Collection[str]
    ) -> "ToolsOnPart":
        """The relations that at least one of some robots moves.

        Args:
            cell: The cell, as it is in a phase.
            tasks: Names of the tasks that are worked on in the phase.
        """
        holder = {grasp.robot for grasp in cell.part.held_by[:1]}
        limits = cell.checks.closure_mm.si, cell.checks.closure_deg.si
        related: list[tuple[Relation, str, frozenset[str], tuple[float, float]]] = []
        for task in cell.tasks:
            robots_at_work = {task.robot} if task.relative_to is Frame.WORLD else {task.robot, *holder}
            if task.name in tasks:
                related.append(
                    (task, f"the tool of task '{task.name}'", frozenset(robots_at_work), task.tolerance.between)
                )
        related += [
            (grasp, f"'{grasp.robot}' on the part", frozenset({grasp.robot, *holder}), limits)
            for grasp in cell.closures
        ]
        related = [entry for entry in related if entry[2] & set(robots)]
        relations, names, movers, allowed = zip(*related, strict=True) if related else ((), (), (), ())
        return cls(cell=cell, chains=chains, relations=relations, names=names, movers=movers, allowed=allowed)

    def tips(self, q: Mapping[str, Array]) -> dict[str, Array]:
        """Tool tips in the world of some robots that take part, shape (N, 4, 4), by robot; of others none.

        Args:
            q: Joint positions in [rad] or [m], shape (N, n), by robot.
        """
        taking_part = frozenset[str]().union(*self.movers)
        return {name: self.chains[name].tool_poses(positions) for name, positions in q.items() if name in taking_part}

    def poses(self, X_WT: Mapping[str, Array]) -> list[Array]:
        """Pose of each tool in the frame of its task, or on the part, shape (N, 4, 4) each.

        Args:
            X_WT: Tool tips in the world of all robots that take part, shape (N, 4, 4), by robot.
        """
        part = self.cell.part
        X_PW = inverse(X_WT[part.held_by[0].robot] @ part.X_CP if self._is_carried else part.X_CP[None])
        return [
            X_WT[relation.robot]
            if isinstance(relation, Task) and relation.relative_to is Frame.WORLD
            else X_PW @ X_WT[relation.robot]
            for relation in self.relations
        ]

    @property
    def _is_carried(self) -> bool:
        """Whether one of the tools is seen from a part that a robot carries."""
        holders = self.cell.part.held_by
        return bool(holders) and any(holders[0].robot in movers for movers in self.movers)

    def errors(self, desired: Sequence[Array], poses: Sequence[Array]) -> list[Array]:
        """Position errors in [m] and orientation errors in [rad] of each, shape (N, 2); open components are zero."""
        errors = []
        for relation, one, other in zip(self.relations, desired, poses, strict=True):
            error = errors_on_part(other, one, relation)
            lengths = [np.linalg.norm(error[:, :3], axis=1), np.linalg.norm(error[:, 3:], axis=1)]
            errors.append(np.stack(lengths, axis=1))
        return errors

    def shares(self, desired: Sequence[Array], poses: Sequence[Array], *, most: float) -> list[Array]:
        """Errors as shares of what is allowed, the larger one of each row, shape (N,).

        Args:
            desired: Poses as in the run, shape (N, 4, 4) each.
            poses: Poses of the thinned rows, likewise.
            most: Largest position error in [m], also where the cell allows more.
        """
        return [
            np.maximum(errors[:, 0] / min(most, LEFT_OVER * position), errors[:, 1] / (LEFT_OVER * orientation))
            for errors, (position, orientation) in zip(self.errors(desired, poses), self.allowed, strict=True)
        ]
