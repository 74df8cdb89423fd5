"""Errors files: what is read, and what is refused with which words."""

from pathlib import Path

import numpy as np
import pytest

from cellplan import load_cell
from cellplan.errors import InputError, InvalidFileError
from cellplan.files.cell_errors import load_errors
from cellplan.model.settings.cell_errors import PoseErrorEntry, ShiftSpreadEntry, TurnSpreadEntry

WHOLE = """\
cellplan_errors: 1
seed: 7
trials: 12
robots:
  left:
    joint_offsets_deg: {A: 0.02, B: {normal: 0.01}, C: {uniform: 0.03}}
    link_lengths_mm: {B: {normal: 0.2}}
    base: {xyz_mm: [0.5, 0, {normal: 0.1}], rpy_deg: [0, 0, 0.01]}
grasp: {left: {xyz_mm: [1, 2, 3]}}
measurement: {position_noise_mm: 0.02, orientation_noise_deg: 0.003}
"""


@pytest.fixture(scope="module")
def cell(cells):
    return load_cell(cells / "planar_pair.yaml")


@pytest.fixture
def load(cell, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def load_text(text, of=cell):
        Path("e").write_text(text, encoding="utf-8")
        return load_errors("e", of)

    return load_text


@pytest.fixture
def refuse(load, cell):
    def findings(text, of=cell):
        with pytest.raises(InvalidFileError) as caught:
            load(f"cellplan_errors: 1\n{text}\n", of)
        return str(caught.value).splitlines()

    return findings


def test_every_amount_has_its_value_in_metres_and_radians(load):
    errors = load(WHOLE)

    left = errors.robots["left"]
    assert left.joint_offsets["A"].si == pytest.approx(np.deg2rad(0.02))
    assert left.joint_offsets["B"] == TurnSpreadEntry(normal=0.01)
    assert left.joint_offsets["C"] == TurnSpreadEntry(uniform=0.03)
    assert left.joint_offsets["C"].uniform.si == pytest.approx(np.deg2rad(0.03))
    assert left.link_lengths_mm == {"B": ShiftSpreadEntry(normal=0.2)}
    assert left.link_lengths_mm["B"].normal.si == 2e-4
    assert left.base.xyz_mm == (0.5, 0.0, ShiftSpreadEntry(normal=0.1))
    assert left.base.rpy_deg[2].si == pytest.approx(np.deg2rad(0.01))
    assert left.tool == PoseErrorEntry()
    assert [amount.si for amount in errors.grasps["left"].xyz_mm] == [1e-3, 2e-3, 3e-3]
    assert (errors.seed, errors.trials, errors.is_random, errors.file) == (7, 12, True, "e")
    assert errors.measurement.position_noise_mm.si == 2e-5
    assert errors.measurement.orientation_noise_deg.si == pytest.approx(np.deg2rad(0.003))


def test_a_file_of_nothing_but_its_version_states_an_exact_cell(load):
    errors = load("cellplan_errors: 1\n")

    assert (errors.robots, errors.grasps, errors.seed, errors.trials, errors.is_random) == ({}, {}, 0, 1, False)


@pytest.mark.parametrize(
    ("text", "finding"),
    [
        ("robots: {lefft: {}}", "e:2: robots.lefft: expected a robot of this cell (left, right), got 'lefft', did you "
         "mean 'left'?"),
        ("robots: {left: {joint_offsets_deg: {D: 1}}}",
         "e:2: robots.left.joint_offsets_deg.D: expected a joint of 'left' (A, B, C), got 'D'"),
        ("robots: {left: {joint_offsets_mm: {A: 1}}}",
         "e:2: robots.left.joint_offsets_mm.A: joint 'A' is revolute: state its offset under joint_offsets_deg"),
        ("robots: {left: {link_lengths_mm: {A: 1}}}",
         "e:2: robots.left.link_lengths_mm.A: the axis points of 'A' and of the joint before it are one point, so the "
         "link has no direction to be lengthened in: state the error under base or tool, or move a point along its "
         "axis"),
        ("grasp: {right: {}}", "e:2: grasp.right: expected a robot that holds the part (left), got 'right'"),
        ("robots: {left: {tol: {}}}",
         "e:2: robots.left.tol: unknown key, did you mean 'tool'?; allowed: joint_offsets_deg, joint_offsets_mm, "
         "link_lengths_mm, base, tool"),
        ("robots: {left: {joint_offsets_deg: {A: {normal: -1}}}}",
         "e:2: robots.left.joint_offsets_deg.A.normal: expected a number of at least 0, got -1"),
        ("robots: {left: {joint_offsets_deg: {A: {normal: 1, uniform: 1}}}}",
         "e:2: robots.left.joint_offsets_deg.A: expected exactly one of the keys normal, uniform, got normal and "
         "uniform"),
        ("robots: {left: {joint_offsets_deg: {A: wide}}}",
         "e:2: robots.left.joint_offsets_deg.A: expected a number, {normal: NUMBER} or {uniform: NUMBER}, got 'wide'"),
        ("robots: {left: {base: {xyz_mm: [0, 0, 2000]}}}",
         "e:2: robots.left.base.xyz_mm[2]: expected a number of millimetres of at most 1000, got 2000"),
        ("simulation: {robots: {lefft: {kp: 1}}}",
         "e:2: simulation.robots.lefft: expected a robot of this cell (left, right), got 'lefft', did you mean "
         "'left'?"),
        ("simulation: {robots: {left: {kp: {D: 1}}}}",
         "e:2: simulation.robots.left.kp.D: expected a joint of 'left' (A, B, C), got 'D'"),
        ("simulation: {robots: {left: {kp: high}}}",
         "e:2: simulation.robots.left.kp: expected a number for all joints, or {JOINT: NUMBER}, got 'high'"),
        ("simulation: {robots: {left: {ki: 1}}}",
         "e:2: simulation.robots.left.kp: missing, expected control signal per error, in [N m/rad] or [N/m]"),
        ("simulation: {robots: {left: {kp: 1, control_ms: 0}}}",
         "e:2: simulation.robots.left.control_ms: expected a positive number, got 0"),
        ("measurement: {share: 0}", "e:2: measurement.share: expected a positive number, got 0"),
        ("measurement: {camera: {focal_px: [400, 400]}}",
         "e:2: measurement.camera.at: missing, expected pose in the world: z along the view, x along the rows, y down "
         "the columns"),
        ("trials: 0", "e:2: trials: expected a positive number, got 0"),
        ("seed: 1.5", "e:2: seed: expected a whole number, got 1.5"),
        ("measurement: {position_noise_mm: -1}",
         "e:2: measurement.position_noise_mm: expected a number of millimetres of at least 0, got -1"),
        ("measurement: {position_noise_mm: .nan}",
         "e:2: measurement.position_noise_mm: expected a finite number, got .nan"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_reported_with_its_place(refuse, text, finding):
    assert refuse(text) == [finding]


def test_all_findings_come_at_once_in_the_order_of_the_file(refuse):
    lines = refuse("sed: 3\nrobots:\n  lefft: {}\n  left: {joint_offsets_deg: {A: {}, Z: 1}}")

    assert [line.split(": ")[0] for line in lines] == ["e:2", "e:4", "e:5", "e:5"]


def test_a_joint_that_slides_is_offset_in_millimetres(refuse, load, cells):
    rail = load_cell(cells / "rail.yaml")
    robot = next(robot.name for robot in rail.robots if "rail" in robot.model.joint_names)

    assert load(f"cellplan_errors: 1\nrobots: {{{robot}: {{joint_offsets_mm: {{rail: 0.5}}}}}}\n", rail).robots[
        robot
    ].joint_offsets == {"rail": 0.5}
    assert refuse(f"robots: {{{robot}: {{joint_offsets_deg: {{rail: 0.5}}}}}}", rail) == [
        f"e:2: robots.{robot}.joint_offsets_deg.rail: joint 'rail' is prismatic: state its offset under "
        "joint_offsets_mm"
    ]


def test_a_missing_file_is_named(cell):
    with pytest.raises(InputError, match=r"^nowhere\.yaml: no such file$"):
        load_errors("nowhere.yaml", cell)
