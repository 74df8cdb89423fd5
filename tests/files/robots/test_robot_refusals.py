"""Robots of a cell: every finding about them, word for word."""

from collections.abc import Callable

import pytest

from cellplan.files.schema.robot import RobotEntry

Refuse = Callable[..., list[str]]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "    base: {xyz",
            "    bsae: {xyz",
            "c:9: robots.worker.bsae: unknown key, did you mean 'base'?; allowed: "
            + ", ".join(RobotEntry.model_fields),
        ),
        (
            "xyz_mm: [2000, 0, 0]",
            "xyz_mm: [2000, 0]",
            "c:9: robots.worker.base.xyz_mm: expected a list of 3 numbers, got a list of 2",
        ),
        (
            "xyz_mm: [2000, 0, 0]",
            "xyz_mm: [2000, 0, '0']",
            "c:9: robots.worker.base.xyz_mm[2]: expected a number of millimetres, got '0'",
        ),
        (
            "xyz_mm: [2000, 0, 0]",
            "xyz_mm: [2000, 0, true]",
            "c:9: robots.worker.base.xyz_mm[2]: expected a number of millimetres, got true",
        ),
        (
            "xyz_mm: [2000, 0, 0]",
            "xyz_mm: [200000, 0, 0]",
            "c:9: robots.worker.base.xyz_mm[0]: expected a number of millimetres of at most 100000, got 200000",
        ),
        (
            "xyz_mm: [2000, 0, 0]",
            "xyz_mm: [2000, 0, .nan]",
            "c:9: robots.worker.base.xyz_mm[2]: expected a finite number, got .nan",
        ),
        (
            "rpy_deg: [0, 0, 180]",
            "rpy_deg: 180",
            "c:9: robots.worker.base.rpy_deg: expected a list of 3 numbers, got 180",
        ),
        (
            "base: {xyz_mm: [2000, 0, 0], rpy_deg: [0, 0, 180]}",
            "base: [2000, 0, 0]",
            "c:9: robots.worker.base: expected a mapping with keys out of xyz_mm, rpy_deg, got a list of 3",
        ),
        (
            "start_deg: [0, -93, 108, 0, -15, 0]",
            "start_deg: [0, -93, x, 0, -15, 0]",
            "c:6: robots.holder.start_deg[2]: expected a number of degrees, got 'x'",
        ),
        (
            "start_deg: [0, -93, 108, 0, -15, 0]",
            "start_deg: [0, -93, 108]",
            "c:6: robots.holder.start_deg: expected 6 angles, one per joint (A2, B2, C2, D2, E2, F2), got 3",
        ),
        (
            "start_deg: [0, -93, 108, 0, -15, 0]",
            "start_deg: atuo",
            "c:6: robots.holder.start_deg: expected auto or a list of joint angles, got 'atuo', did you mean 'auto'?",
        ),
        (
            "start_deg: [0, -93, 108, 0, -15, 0]",
            "start: {A2_deg: 0, B2_deg: 0, C2_deg: 0, D2_deg: 0, E2_deg: 0, F2_mm: 0}",
            "c:6: robots.holder.start.F2_mm: unknown key; allowed: A2_deg, B2_deg, C2_deg, D2_deg, E2_deg, "
            "F2_deg\nc:6: robots.holder.start: missing, expected one value per joint: add F2_deg",
        ),
        (
            "start_deg: [0, -93, 108, 0, -15, 0]",
            "start_deg: auto\n    start: auto",
            "c:7: robots.holder.start: expected either start_deg or start, got both",
        ),
        (
            "weights: [1, 1, 1, 1, 1, 1]",
            "weights: [1, 1]",
            "c:11: robots.worker.weights: expected 6 weights, one per joint (A3, B3, C3, D3, E3, F3), got 2",
        ),
        (
            "weights: [1, 1, 1, 1, 1, 1]",
            "weights: [1, 1, 1, 1, 1, 0]",
            "c:11: robots.worker.weights[5]: expected a positive number, got 0",
        ),
        (
            "weights: [1, 1, 1, 1, 1, 1]",
            "limits: {A33: {lower_deg: 0}}",
            "c:11: robots.worker.limits.A33: expected a joint of the robot (A3, B3, C3, D3, E3, F3), got 'A33', "
            "did you mean 'A3'?",
        ),
        (
            "weights: [1, 1, 1, 1, 1, 1]",
            "limits: {A3: {lower_mm: 0}}",
            "c:11: robots.worker.limits.A3: expected limits in deg, the joint is revolute, got mm",
        ),
        (
            "weights: [1, 1, 1, 1, 1, 1]",
            "limits: {A3: {lower_deg: 10, upper_deg: 5}}",
            "c:11: robots.worker.limits.A3.upper_deg: expected a number above lower_deg = 10, got 5",
        ),
        (
            "weights: [1, 1, 1, 1, 1, 1]",
            "limits: {A3: {upper_deg: 700}}",
            "c:11: robots.worker.limits.A3.upper_deg: expected at most 180, the limit of the model, got 700",
        ),
        (
            "weights: [1, 1, 1, 1, 1, 1]",
            "limits: {A3: {upper_deg: 10000}}",
            "c:11: robots.worker.limits.A3.upper_deg: expected a number of degrees of at most 3600, got 10000",
        ),
        (
            "weights: [1, 1, 1, 1, 1, 1]",
            "limits: {A3: {wrap: true}}",
            "c:11: robots.worker.limits.A3.wrap: unexpected key, only a continuous joint of a URDF may turn "
            "without end",
        ),
        (
            "weights: [1, 1, 1, 1, 1, 1]",
            "limits: {A3: {velocity_deg_s: 0}}",
            "c:11: robots.worker.limits.A3.velocity_deg_s: expected a positive number of degrees per second, got 0",
        ),
        (
            "weights: [1, 1, 1, 1, 1, 1]",
            "limits: {A3: {acceleration_mm_s2: 5}}",
            "c:11: robots.worker.limits.A3: expected limits in deg, the joint is revolute, got mm",
        ),
        (
            "weights: [1, 1, 1, 1, 1, 1]",
            "limits: {A3: {acceleration_deg_s2: -5}}",
            "c:11: robots.worker.limits.A3.acceleration_deg_s2: expected a positive number of degrees per "
            "second², got -5",
        ),
        (
            "weights: [1, 1, 1, 1, 1, 1]",
            "flange: tool0",
            "c:11: robots.worker.flange: unexpected key, it applies to a URDF only",
        ),
        (
            "weights: [1, 1, 1, 1, 1, 1]",
            "locked: {finger: 10}",
            "c:11: robots.worker.locked.finger: expected a joint name with its unit, such as finger_mm or flap_deg",
        ),
        (
            "weights: [1, 1, 1, 1, 1, 1]",
            "locked: {others: 10}",
            "c:11: robots.worker.locked.others: expected zero, got 10",
        ),
        (
            "weights: [1, 1, 1, 1, 1, 1]",
            "locked: {finger_mm: zero}",
            "c:11: robots.worker.locked.finger_mm: expected a number, got zero: only others may be zero in words",
        ),
        (
            "weights: [1, 1, 1, 1, 1, 1]",
            "locked: {others: nil}",
            "c:11: robots.worker.locked.others: expected a number, or zero for the key others, got 'nil'",
        ),
        (
            "weights: [1, 1, 1, 1, 1, 1]",
            "locked: {finger_mm: 1e9}",
            "c:11: robots.worker.locked.finger_mm: expected a number of millimetres of at most 100000, got 1000000000",
        ),
        (
            "model: abb_irb1600",
            "model: abb_irb160",
            "c:8: robots.worker.model: expected a bundled robot (`cellplan robots` lists them) or a .urdf, .xacro or "
            ".yaml file, got 'abb_irb160', did you mean 'abb_irb1600'?",
        ),
        (
            "model: abb_irb1600",
            "model: arm.urdf",
            "c:8: robots.worker.model: expected an existing file, got 'arm.urdf'",
        ),
        (
            "model: abb_irb1600",
            "model: ../arm.yaml",
            "c:8: robots.worker.model: expected a path below the folder of the cell file, got '../arm.yaml'; "
            "allow other folders with --allow-dir",
        ),
        (
            "model: abb_irb1600",
            "model: 5",
            "c:8: robots.worker.model: expected a text, got 5",
        ),
        (
            "tool: {xyz_mm: [0, 0, 100]}",
            "tool: {geometry: {cilinder: {radius_mm: 5, length_mm: 10}}}",
            "c:10: robots.worker.tool.geometry.cilinder: unknown key, did you mean 'cylinder'?; allowed: box, "
            "cylinder, capsule, sphere, mesh, unit, open",
        ),
        (
            "rpy_deg: [0, 0, 180]",
            "rpy_deg: [0, 0, 1800]",
            "c:9: robots.worker.base.rpy_deg[2]: expected a number of degrees of at most 720, got 1800",
        ),
        (
            "    weights: [1, 1, 1, 1, 1, 1]",
            "    locked: {grip_deg: 0, grip_mm: 3}",
            "c:11: robots.worker.locked.grip_mm: expected each joint once, got 'grip' in deg and in mm",
        ),
        (
            "tool: {xyz_mm: [0, 0, 100]}",
            "tool: {geometry: {sphere: {radius_mm: 5}, open: true}}",
            "c:10: robots.worker.tool.geometry.open: unexpected key, open requires a mesh",
        ),
        (
            "tool: {xyz_mm: [0, 0, 100]}",
            "tool: {geometry: {}}",
            "c:10: robots.worker.tool.geometry: expected exactly one of the keys box, cylinder, capsule, sphere, "
            "mesh, got none",
        ),
        (
            "tool: {xyz_mm: [0, 0, 100]}",
            "tool: {geometry: {sphere: {radius_mm: 5}, box: {size_mm: [1, 1, 1]}}}",
            "c:10: robots.worker.tool.geometry: expected exactly one of the keys box, cylinder, capsule, sphere, "
            "mesh, got box and sphere",
        ),
        (
            "tool: {xyz_mm: [0, 0, 100]}",
            "tool: {geometry: {capsule: {radius_mm: 5, length_mm: 9}}}",
            "c:10: robots.worker.tool.geometry.capsule.length_mm: expected a length of at least 10 (two radii)",
        ),
        (
            "tool: {xyz_mm: [0, 0, 100]}",
            "tool: {geometry: {mesh: a.stl}}",
            "c:10: robots.worker.tool.geometry.unit: missing, expected the unit of the mesh: mm, m or inch",
        ),
        (
            "tool: {xyz_mm: [0, 0, 100]}",
            "tool: {bodies: [{sphere: {radius_mm: -1}}]}",
            "c:10: robots.worker.tool.bodies[0].sphere.radius_mm: expected a positive number of millimetres, got -1",
        ),
    ],
)
def test_a_mistake_in_a_robot_is_named_with_its_line_key_and_cure(
    refuse: Refuse, old: str, new: str, message: str
) -> None:
    assert refuse((old, new)) == message.splitlines()


@pytest.mark.parametrize("name", ["part", "world", "World"])
def test_a_robot_is_not_called_like_something_else(refuse: Refuse, base_cell: str, name: str) -> None:
    text = base_cell.replace("worker", name)
    meaning = {"part": "the workpiece", "world": "the frame that everything stands in"}[name.lower()]

    assert refuse((base_cell, text)) == [f"c:7: robots.{name}: expected another name, '{name.lower()}' means {meaning}"]
