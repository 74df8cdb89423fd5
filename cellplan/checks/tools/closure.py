"""Closure: deviation of the co-holders' tools from their grasps, by the positions that were read back."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.checks.tools.tracking import errors_on_part, worst_error
from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell.cell import Cell
from cellplan.model.report.report import Check, ClosureAccuracy
from cellplan.model.units import DEG, MM
from cellplan.scene.kinematics.screw_chain import ScrewChain

CURE: Final = "a shorter motion.step_s, a slower motion or a path farther from singularities reduces it"


def closure_accuracy(
    cell: Cell, chains: Mapping[str, ScrewChain], q: Mapping[str, Array], X_WP: Array
) -> tuple[ClosureAccuracy, ...]:
    """Closure errors of every holder but the first ([Ribeiro2010]_ 4.5), in P; open components are zero.

    A rigid part cannot give way: what is an error here is force between the robots in the shop. Holders that stand
    still are checked as well.

    Args:
        q: Positions of each robot, shape (N, n).
        X_WP: The part as the first holder carries it, shape (N, 4, 4) or (1, 4, 4).
    """
    accuracies = []
    for grasp in cell.closures:
        X_PT = inverse(X_WP) @ chains[grasp.robot].tool_poses(q[grasp.robot])
        error = errors_on_part(X_PT, np.broadcast_to(grasp.X_PT, X_PT.shape), grasp)
        accuracies.append(
            ClosureAccuracy(
                robot=grasp.robot, axes=grasp.axes, position_error=error[:, :3], orientation_error=error[:, 3:]
            )
        )
    return tuple(accuracies)


def check_closure(cell: Cell, times: Array, closures: Sequence[ClosureAccuracy]) -> list[Check]:
    """Position and orientation error of every closure against what the cell allows."""
    checks = []
    for closure in closures:
        of = f"of '{closure.robot}' on the part"
        checks += [
            worst_error(
                "closure_position_error",
                times,
                MM * np.linalg.norm(closure.position_error, axis=1),
                subject=closure.robot,
                limit=cell.checks.closure_mm,
                words=("mm", of),
            ),
            worst_error(
                "closure_orientation_error",
                times,
                DEG * np.linalg.norm(closure.orientation_error, axis=1),
                subject=closure.robot,
                limit=cell.checks.closure_deg,
                words=("deg", of),
            ),
        ]
    return [check if check.passed else replace(check, message=f"{check.message}; {CURE}") for check in checks]
