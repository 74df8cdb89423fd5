"""Cells for tests of transfer moves: bundled arms among obstacles, and what a transfer is planned with."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from builders.scene_builders import body, joint, make_cell, placed, stick
from cellplan.files.robots.joint_table import load_bundled
from cellplan.geometry.shapes import Cylinder
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Obstacle, Robot
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.checks import ChecksEntry
from cellplan.model.settings.program import ProgramEntry, TransferEntry
from cellplan.scene.scene import Scene

CHECKS = ChecksEntry()
STEP = 0.004  # [s]


def arm(name: str, model: str | RobotModel, base: Array | None = None) -> Robot:
    """A robot with a slender tool of 250 mm."""
    loaded = load_bundled(model) if isinstance(model, str) else model
    return placed(name, loaded, base=base, tool=stick(0.25, 0.02))


def scene_of(*robots: Robot, things: Sequence[Obstacle] = (), step: float = STEP) -> Scene:
    """The scene of a cell without tasks."""
    cell = make_cell(*robots, things=things, checks=CHECKS)
    return Scene.from_cell(replace(cell, motion=replace(cell.motion, step=step)))


def capped(scene: Scene, **limits: float) -> Scene:
    """The scene with limits of ``program.transfer``."""
    program = ProgramEntry(transfer=TransferEntry.model_validate(limits))
    return replace(scene, cell=replace(scene.cell, program=program))


def gantry(name: str, *, radius: float = 0.1, z: float = 0.0) -> Robot:
    """A disc that two sliding joints move in a plane within 1 m to each side."""
    joints = tuple(
        replace(joint(axis, k - 1, axis=np.eye(3)[k], slides=True), lower=-1.0, upper=1.0, velocity=1.0)
        for k, axis in enumerate("xy")
    )
    model = RobotModel(
        name="gantry",
        source="test",
        joints=joints,
        flange_link=1,
        X_BF=np.eye(4),
        bodies=(body("disc", 1, shape=Cylinder(radius, 0.05), at=(0.0, 0.0, z)),),
    )
    return placed(name, model)
