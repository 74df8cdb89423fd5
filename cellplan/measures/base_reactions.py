"""Base reactions of a motion, and of robots that stand still."""

from collections.abc import Iterator, Mapping

import numpy as np

from cellplan.geometry.arrays import Array, first_peak
from cellplan.measures.accelerations import row_motion
from cellplan.measures.forces.wrenches import NO_WRENCHES
from cellplan.model.cell.cell import Cell, RobotRows
from cellplan.model.report.base_reaction import BaseReaction, PeakLoad
from cellplan.scene.dynamics.loads import carried_masses
from cellplan.scene.dynamics.newton_euler import JointRows, joint_torques
from cellplan.scene.dynamics.soundness import missing_masses
from cellplan.scene.kinematics.screw_chain import Chains, ScrewChain


def base_reactions(
    cell: Cell, chains: Chains, times: Array, q: RobotRows, acting: RobotRows = NO_WRENCHES
) -> Iterator[BaseReaction]:
    """What the bases of the robots with known masses must hold.

    Args:
        cell: The cell.
        chains: Its robots.
        times: Times of the rows in [s], shape (N,).
        q: Positions in [rad] or [m], shape (N, n), by robot.
        acting: What processes exert on the robots, at the origin of the world and expressed in it, shape (N, 6).
    """
    for robot in cell.robots:
        if not missing_masses(cell, robot):
            chain, carried, at = chains[robot.name], carried_masses(cell, robot), q[robot.name]
            motion, zero = row_motion(times, at), np.zeros_like(at)
            moving, still = (
                joint_torques(
                    chain, robot.model, JointRows(q=at, qd=qd, qdd=qdd), carried=carried, wrench_W=wrench_W
                ).base_W
                for (qd, qdd), wrench_W in ((motion, acting.get(robot.name)), ((zero, zero), None))
            )
            yield _largest(robot.name, times, moving, still)


def standing_reactions(cell: Cell, q: Mapping[str, Array]) -> Iterator[BaseReaction]:
    """What they must hold while all stand still, q in [rad] or [m] of shape (n,) by robot."""
    chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
    return base_reactions(cell, chains, np.arange(2.0), {name: np.tile(at, (2, 1)) for name, at in q.items()})


def _largest(robot: str, times: Array, moving_W: Array, still_W: Array) -> BaseReaction:
    """The largest of the wrenches that hold a foot, in motion and at rest, shape (N, 6) each."""
    sizes = {
        "vertical": np.abs(moving_W[:, 2]),
        "horizontal": np.linalg.norm(moving_W[:, :2], axis=1),
        "tilting": np.linalg.norm(moving_W[:, 3:5], axis=1),
        "turning": np.abs(moving_W[:, 5]),
        "tilting_at_rest": np.linalg.norm(still_W[:, 3:5], axis=1),
    }
    peaks = {key: PeakLoad(float(size.max()), float(times[first_peak(size)])) for key, size in sizes.items()}
    return BaseReaction(robot=robot, weight=float(np.abs(still_W[:, 2]).max()), **peaks)
