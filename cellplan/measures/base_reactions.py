"""Base reactions, from the wrenches that hold the foot of a robot."""

import numpy as np

from cellplan.geometry.arrays import Array, first_peak
from cellplan.model.robot.base_reaction import BaseReaction, PeakLoad


def base_reaction(robot: str, times: Array, moving_W: Array, still_W: Array) -> BaseReaction:
    """What the base of a robot must hold.

    Args:
        robot: Its name.
        times: Times in [s], shape (N,).
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
    peaks = {key: PeakLoad(float(size.max()), float(times[first_peak(size)])) for key, size in sizes.items()}
    return BaseReaction(robot=robot, weight=float(np.abs(still_W[:, 2]).max()), **peaks)
