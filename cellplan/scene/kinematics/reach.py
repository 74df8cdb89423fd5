"""Reach of a robot: largest distance of its flange from its first axis."""

from collections.abc import Callable
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot, Tool
from cellplan.model.robot.robot import RobotModel
from cellplan.scene.kinematics.screw_chain import ScrewChain

START_COUNT: Final = 4  # configurations the search climbs from; the bundled arms need one
GRID_COUNT: Final = 25  # positions tried per joint and round
SWEEP_COUNT: Final = 24  # rounds over all joints; the grid shrinks by half in each, down to a rounding error
ROUNDING: Final = 1e-9  # [m] poses are worked out to less than that
UPRIGHT: Final = 1.0 - 1e-9  # [-] cosine of the angle between an upright axis and the vertical
DIRECTION_COUNT: Final = 48  # [-] in which the farthest place is sought
UNLIMITED_RANGE: Final = 2.0 * np.pi  # [rad] range of a joint that may turn without end


def arm_reach(model: RobotModel, *, rounds: int = SWEEP_COUNT) -> float:
    """Largest distance in [m] of the flange from the first joint's axis, within the joint limits.

    One joint after the other is moved to its best position on a grid that gets finer in each round, from several
    configurations. A first joint that slides has no axis to turn about: then the distance from its point is taken.

    Five rounds are enough for a drawing.
    """
    placed = Robot(
        name=model.name,
        model=model,
        X_WB=np.eye(4),
        tool=Tool(X_FT=np.eye(4), bodies=()),
        start=None,
        weights=np.ones(len(model.joints)),
    )
    chain = ScrewChain(placed)
    first = model.joints[0]

    def distances(q: Array) -> Array:
        from_point = chain.flange_poses(q)[:, :3, 3] - first.point_B
        lever = np.cross(from_point, first.axis_B) if first.is_revolute else from_point
        return np.sqrt(np.sum(lever**2, axis=1))

    return float(distances(_best(distances, model, rounds)).max())


def has_round_reach(robot: Robot) -> bool:
    """Whether a placed robot turns about an upright first axis, so that its reach from above is a circle about it."""
    model = robot.model
    return model.joints[0].is_revolute and abs(float(robot.X_WB[2, :3] @ model.joints[0].axis_B)) > UPRIGHT


def reach_outline(robot: Robot, *, rounds: int = SWEEP_COUNT) -> Array:
    """Farthest places from above that the flange of a placed robot reaches, all round, in [m], shape (K, 2).

    The robot may stand on a rail, hang or be mounted on a wall. Between two of these places the outline bulges out by
    0.2 % of its radius of curvature at most.
    """
    chain = ScrewChain(robot)
    corners = []
    for angle in 2.0 * np.pi * np.arange(DIRECTION_COUNT) / DIRECTION_COUNT:
        along = np.array([np.cos(angle), np.sin(angle)])

        def heights(q: Array, along: Array = along) -> Array:
            return chain.flange_poses(q)[:, :2, 3] @ along

        best = _best(heights, robot.model, rounds)
        corners.append(chain.flange_poses(best)[int(np.argmax(heights(best))), :2, 3])
    return np.array(corners)


def reach_bound(robot: Robot) -> float:
    """Distance in [m] from the point of the first axis that the tool tip never exceeds, whatever the joints are.

    The points of two axes that follow each other belong to one link: their distance does not change, but for slides.
    """
    model, X_BT = robot.model, robot.model.X_BF @ robot.tool.X_FT
    links = model.links_to_flange
    if not links:
        return np.inf
    points = np.array([*(model.axes[link].point_B for link in links), X_BT[:3, 3]])
    strokes = [
        abs(drive.ratio) * max(abs(joint.lower), abs(joint.upper)) + abs(drive.offset)
        for link, drive in ((link, model.drive(link)) for link in links)
        if not (joint := model.joints[drive.joint]).is_revolute
    ]
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum() + sum(strokes)) + ROUNDING


def _best(distances: Callable[[Array], Array], model: RobotModel, rounds: int) -> Array:
    """The best configurations within the limits that are found from several, shape (S, n)."""
    lower = np.where(np.isfinite(model.lower), model.lower, -0.5 * UNLIMITED_RANGE)
    upper = np.where(np.isfinite(model.upper), model.upper, 0.5 * UNLIMITED_RANGE)
    best = np.random.default_rng(0).uniform(lower, upper, size=(START_COUNT, len(lower)))
    rows, width = np.arange(START_COUNT), upper - lower
    for _ in range(rounds):
        for joint in range(best.shape[1]):
            tried = np.repeat(best[:, None], GRID_COUNT, axis=1)
            offsets = np.linspace(-width[joint], width[joint], GRID_COUNT)
            tried[:, :, joint] = np.clip(tried[:, :, joint] + offsets, lower[joint], upper[joint])
            tried_distances = distances(tried.reshape(-1, tried.shape[2])).reshape(len(rows), GRID_COUNT)
            best = tried[rows, np.argmax(tried_distances, axis=1)]
        width = 0.5 * width
    return best
