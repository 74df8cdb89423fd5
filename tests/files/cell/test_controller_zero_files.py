"""The zero of a controller comes from robot files: from a table, or from a file beside a robot that cannot state it."""

import hashlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cellplan.files.cell.load import load_cell
from cellplan.files.cell.write import render_cell
from cellplan.model.cell.cell import Cell

ZERO = "zero_deg: {B4: 90}\nsign: {D4: -1}\ncoupling: {C4: {B4: 1}}\nsource: its handbook\n"
MODEL = "model: abb_irb1600"
STAUBLI = (MODEL, "model: staubli_rx90l\n    controller_zero: zero.yaml")
LINE = "    base: {xyz_mm: [2000, 0, 0], rpy_deg: [0, 0, 180]}"
RAIL = (LINE, f"{LINE}\n    mount: {{rail: {{axis: +y, lower_mm: -500, upper_mm: 700, velocity_mm_s: 900}}}}")
SEVEN = ("    weights: [1, 1, 1, 1, 1, 1]", "    weights: [1, 1, 1, 1, 1, 1, 1]")
ANGLES = np.deg2rad([10.0, 20.0, 30.0, 40.0, 50.0, 60.0])
COUNTED = np.deg2rad([10.0, 110.0, 140.0, -40.0, 50.0, 60.0])  # C4 counts B4 in: 30 + 110
ROUNDING = 1e-12  # [rad]

Load = Callable[..., Cell]
Refuse = Callable[..., list[str]]


def test_a_file_beside_a_robot_states_how_its_controller_counts(load: Load) -> None:
    Path("zero.yaml").write_text(ZERO, encoding="utf-8")

    cell = load(STAUBLI)

    zero = cell.robot("worker").model.controller
    assert zero is not None
    assert zero.source == "its handbook"
    np.testing.assert_allclose(zero.from_model(ANGLES), COUNTED, atol=ROUNDING)
    assert cell.inputs["zero.yaml"] == hashlib.sha256(ZERO.encode()).hexdigest()


def test_a_urdf_gets_its_zero_from_such_a_file(load: Load, cells: Path) -> None:
    Path("arm.urdf").write_bytes((cells / "robots/own_arm.urdf").read_bytes())
    Path("zero.yaml").write_text("zero_deg: {joint_2: -90}\n", encoding="utf-8")

    zero = load((MODEL, "model: arm.urdf\n    controller_zero: zero.yaml")).robot("worker").model.controller

    assert zero is not None
    np.testing.assert_allclose(np.rad2deg(zero.from_model(np.zeros(6))), [0, -90, 0, 0, 0, 0], atol=1e-12)


def test_a_rail_of_the_cell_counts_as_its_joint_does(load: Load) -> None:
    Path("zero.yaml").write_text(ZERO, encoding="utf-8")

    zero = load(STAUBLI, RAIL, SEVEN).robot("worker").model.controller

    assert zero is not None
    np.testing.assert_allclose(zero.from_model(np.concatenate([[0.3], ANGLES])), [0.3, *COUNTED], atol=ROUNDING)


def test_the_written_cell_names_the_file_again(load: Load) -> None:
    Path("zero.yaml").write_text(ZERO, encoding="utf-8")
    written = render_cell(load(STAUBLI))
    Path("copy").write_text(written, encoding="utf-8")

    assert "    controller_zero: zero.yaml\n" in written
    assert render_cell(load_cell("copy")) == written


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "zero_deg: {B2: -90}\n",
            "zero.yaml:1: zero_deg.B2: expected a revolute joint of the robot (A4, B4, C4, D4, E4, F4), got 'B2'",
        ),
        ("source: sheet\nzero_mm: {B4: -90}\n", "zero.yaml:2: zero_mm.B4: expected a prismatic joint of the robot "),
        ("sign: {B4: 2}\n", "zero.yaml:1: sign.B4: expected 1 or -1, got 2"),
        (
            "coupling: {B4: {C4: 1}}\n",
            "zero.yaml:1: coupling.B4.C4: expected an earlier joint than 'B4' of its kind (A4), got 'C4'",
        ),
        ("controller: {zero_deg: {B4: 90}}\n", "zero.yaml:1: controller: unknown key"),
        ("{}\n", "zero.yaml:1: expected zero_deg, zero_mm, sign or coupling, or the source that says there are none"),
        ("zero_deg: {B4: 90\n", "zero.yaml:"),
    ],
)
def test_a_file_that_cannot_be_is_refused_with_its_own_line(refuse: Refuse, text: str, message: str) -> None:
    Path("zero.yaml").write_text(text, encoding="utf-8")

    lines = refuse(STAUBLI)

    assert len(lines) == 1
    assert lines[0].startswith(message)


def test_a_zero_that_the_robot_file_states_is_not_stated_again(refuse: Refuse) -> None:
    Path("zero.yaml").write_text("source: sheet\n", encoding="utf-8")

    assert refuse((MODEL, "model: kuka_kr6\n    controller_zero: zero.yaml")) == [
        "c:9: robots.worker.controller_zero: unexpected key, the file of 'kuka_kr6' states how its controller counts "
        "the joints: leave it out, it would be applied twice"
    ]


def test_a_file_that_is_not_there_is_refused(refuse: Refuse) -> None:
    assert refuse(STAUBLI) == ["c:9: robots.worker.controller_zero: expected an existing file, got 'zero.yaml'"]


@pytest.mark.parametrize("old", ["zero_deg: {B4: 90}", "zero_mm: {}", "sign: {}", "coupling: {}", "source: sheet"])
def test_a_cell_states_no_zero(refuse: Refuse, old: str) -> None:
    key = old.partition(":")[0]

    assert refuse((MODEL, f"model: staubli_rx90l\n    controller: {{{old}}}")) == [
        f"c:9: robots.worker.controller.{key}: unexpected key, the zero of a controller is no part of a cell: move "
        f"{key} to the key controller of the robot's own file, or, for a URDF, to a file that controller_zero names"
    ]
