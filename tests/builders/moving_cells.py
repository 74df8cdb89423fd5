"""Random cells with bodies on every link and random programs, for tests of what holds between the samples."""

from dataclasses import replace

import numpy as np

from builders.random_cells import random_cell, random_model, random_pose
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Solid, Sphere
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Obstacle
from cellplan.model.robot.robot import BASE, Body
from cellplan.model.settings.checks import ChecksEntry
from cellplan.scene.scene import Scene

SHAPES: tuple[Solid, ...] = (
    Box((0.3, 0.1, 0.2)),
    Cylinder(0.08, 0.4),
    Capsule(0.06, 0.3),
    Sphere(0.1),
    tessellate(Box((0.3, 0.2, 0.1))),
)


def cell_with_bodies(seed: int, *, joints: int = 4) -> Cell:
    """Two operators and a holder that carries the part; turning, sliding and following joints; a post at rest."""
    rng = np.random.default_rng(seed)
    cell = random_cell(seed, operators=2, joints=joints, with_follower=True)
    robots = []
    for robot in cell.robots:
        model = random_model(rng, joints, with_follower=True)
        links = range(BASE, len(model.joints) + len(model.followers))
        bodies = tuple(
            Body(name=f"b{link + 1}", link=link, shape=SHAPES[int(rng.integers(len(SHAPES)))], X_BS=random_pose(rng))
            for link in links
        )
        robots.append(replace(robot, model=replace(model, bodies=bodies)))
    return replace(
        cell,
        robots=tuple(robots),
        tasks=(),
        part=replace(cell.part, shape=Capsule(0.1, 0.3), X_PS=random_pose(rng)),
        obstacles=(Obstacle(name="post", shape=Cylinder(0.1, 1.0), X_WS=random_pose(rng)),),
        checks=ChecksEntry(clearance_mm=0.0, contact_zone_mm=0.0),
    )


def program(cell: Cell, seed: int, *, samples: int, stride: float) -> Array:
    """Joint positions that wander by up to ``stride`` in [rad] or [m] from sample to sample, shape (samples, nq)."""
    rng = np.random.default_rng(seed)
    steps = rng.uniform(-stride, stride, size=(samples - 1, cell.joint_count))
    start = rng.uniform(-1.0, 1.0, size=cell.joint_count)
    return start + np.concatenate([np.zeros((1, cell.joint_count)), np.cumsum(steps, axis=0)])


def relative(scene: Scene, q: Array, pair: tuple[int, int]) -> tuple[Array, Array]:
    """Rotations and positions of the second body seen from the first at each row of q."""
    poses = scene.pair_poses(pair, q)
    R_AW = np.swapaxes(poses.R[pair[0]], 1, 2)
    return R_AW @ poses.R[pair[1]], (R_AW @ (poses.p[pair[1]] - poses.p[pair[0]])[..., None])[..., 0]
