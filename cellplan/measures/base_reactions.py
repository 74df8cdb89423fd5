"""Base reactions of a motion, from the wrenches that hold the foot of a robot."""

import numpy as np

from cellplan.geometry.arrays import Array, first_peak
from cellplan.model.report.base_reaction import BaseReaction, PeakLoad


def base_reaction(robot: str, times: Array, moving_W: Array, still_W: Array) -> BaseReaction:
    """Largest forces and moments that what a robot stands on must hold.

    Args:
        robot: Its name.
        times: Times of the rows in [s], shape (N,).
        moving_W: Force in [N] and moment in [N m] about the origin of the base that hold its foot, in W, shape (N, 6).
        still_W: Those that hold it at rest in the same configurations, shape (N, 6).
    """
    sizes = {
        "vertical": np.abs(moving_W[:, 2]),
        "horizontal": np.linalg.norm(moving_W[:, :2], axis=1),
        "tilting": np.linalg.norm(moving_W[:, 3:5], axis=1),
        "turning": np.abs(moving_W[:, 5]),
        "tilting_at_rest": np.linalg.norm(still_W[:, 3:5], axis=1),
    }
    peaks = {
        key: PeakLoad(float(size.max()), float(times[first_peak(size)])) for key, size in sizes.items()
    }
    return BaseReaction(robot=robot, weight=float(np.abs(still_W[:, 2]).max()), **peaks)


def standing_reactions(cell: Cell, q: Mapping[str, Array]) -> Iterator[BaseReaction]:
    """What the bases of robots with known masses must hold while all stand still.

    Args:
        cell: The cell.
        q: Joint positions by robot in [rad] or [m], shape (n,) each.
    """
    for robot in cell.robots:
        if robot.model.inertias is not None:
            at, zero = np.tile(q[robot.name], (2, 1)), np.zeros((2, len(q[robot.name])))
            rows = JointRows(q=at, qd=zero, qdd=zero)
            held = joint_torques(ScrewChain(robot), robot.model, rows, carried=carried_masses(cell, robot))
            yield base_reaction(robot.name, np.arange(2.0), held.base_W, held.base_W)
