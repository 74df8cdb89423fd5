"""The list of bundled robots, and the description of one robot's file."""

import io
import json
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import pytest
from builders.xacro_texts import write_arm

from cellplan.cli.main import run
from cellplan.files.yaml.writer import flow_text


@pytest.fixture(scope="module")
def listed() -> dict[str, Any]:
    """What a machine gets."""
    with redirect_stdout(io.StringIO()) as out:
        assert run(["robots", "--json"]) == 0
    return json.loads(out.getvalue())


@pytest.mark.slow  # the whole text is among those of all commands
def test_every_bundled_robot_is_listed_with_reach_limits_and_source(capsys: pytest.CaptureFixture[str]) -> None:
    status = run(["robots"])

    reported = capsys.readouterr().out
    assert status == 0
    for name in ("abb_irb1600", "kuka_kr6", "reis_rv20_16", "staubli_rx90l", "staubli_rx90l_as_printed"):
        assert f"{name}\n  reach " in reported
    assert "  B2         -155 … 35 deg          156 deg/s\n" in reported
    assert "Ribeiro 2010, table 5" in reported


def test_a_machine_gets_the_figures_of_the_data_sheet(listed: dict[str, Any]) -> None:
    assert listed["schema"] == "cellplan.robots/1"
    kuka = next(robot for robot in listed["robots"] if robot["name"] == "kuka_kr6")
    assert kuka["joints"][1] == {
        "name": "B2",
        "type": "revolute",
        "lower_deg": -155.0,
        "upper_deg": 35.0,
        "velocity_deg_s": 156.0,
    }


def test_a_robot_named_for_its_reach_has_it(listed: dict[str, Any]) -> None:
    reis = next(robot for robot in listed["robots"] if robot["name"] == "reis_rv20_16")
    assert reis["reach_mm"] == 1600.0  # RV20-16: 20 kg, 1.6 m


URDF = """<robot name="lift">
<link name="foot"><collision><geometry><box size="0.2 0.2 1"/></geometry></collision></link>
<link name="top"/><link name="tool0"/><link name="jaw"/>
<joint name="lift" type="prismatic"><parent link="foot"/><child link="top"/><axis xyz="0 0 1"/>
<limit lower="0" upper="0.6" velocity="0"/></joint>
<joint name="turn" type="continuous"><parent link="top"/><child link="tool0"/><origin xyz="0.1 0 0.5"/>
<axis xyz="0 0 1"/><limit velocity="3.14159265358979"/></joint>
<joint name="jaw" type="prismatic"><parent link="tool0"/><child link="jaw"/>
<limit lower="0.001" upper="0.02" velocity="1"/></joint>
</robot>"""
TEXT = """\
lift
  lift.urdf
  base foot, flange tool0 at [100, 0, 500] mm, turned [0, 0, 0] deg, with all joints at zero
  possible flanges:
    tool0  2 joints, lift … turn  *
    jaw    3 joints, lift … jaw
  joints from base to flange:
    lift  prismatic   0 … 600 mm  no speed   missing: velocity_mm_s (states velocity="0")
    turn  continuous  no range    180 deg/s  missing: lower_deg, upper_deg (is continuous, or wrap: true for no end)
  off the chain, to be locked:
    jaw_mm  1
  bodies and the box round them in mm:
    foot  200 x 200 x 1000  box
entry for a cell file in this folder, with a number for each …:

robots:
  lift:
    model: lift.urdf
    flange: tool0
    locked: {jaw_mm: 1}
    limits: {lift: {velocity_mm_s: …}, turn: {lower_deg: …, upper_deg: …}}
"""


@pytest.fixture
def lift(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A URDF that lacks limits, in the working directory."""
    monkeypatch.chdir(tmp_path)
    Path("lift.urdf").write_text(URDF, encoding="utf-8")
    return "lift.urdf"


def test_a_file_is_described_with_the_lines_for_a_cell(lift: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["robots", lift]) == 0
    assert capsys.readouterr().out == TEXT


def test_a_table_is_described_as_a_bundled_robot_is(cells: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["robots", str(cells / "robots" / "turntable.yaml")]) == 0

    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "turntable"
    assert lines[3].startswith("  flange at [0, 0, ")
    assert lines[-3:] == [
        "robots:",
        "  turntable:",
        f"    model: {flow_text(str(cells / 'robots' / 'turntable.yaml'))}",
    ]


def test_a_machine_gets_the_same_about_a_file(lift: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["robots", lift, "--json", "--flange", "jaw"]) == 0

    made = json.loads(capsys.readouterr().out)
    (robot,) = made["robots"]
    assert made["schema"] == "cellplan.robots/1"
    assert (robot["name"], robot["reach_mm"], robot["bodies"], robot["flange"]) == ("lift", None, 1, "jaw")
    assert [joint["missing"] for joint in robot["joints"]] == [["velocity_mm_s"], ["lower_deg", "upper_deg"], []]
    assert robot["links"] == [{"link": "foot", "shapes": ["box"], "size_mm": [200.0, 200.0, 1000.0]}]
    assert robot["cell_lines"].startswith("robots:\n  lift:\n")


def test_a_bundled_robot_is_described_by_the_keys_of_the_list(
    listed: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["robots", "kuka_kr6", "--json"]) == 0

    (described,) = json.loads(capsys.readouterr().out)["robots"]
    kuka = next(robot for robot in listed["robots"] if robot["name"] == "kuka_kr6")
    joints = [{key: joint[key] for key in kuka["joints"][0]} for joint in described["joints"]]
    assert {**described, "joints": joints, **kuka} == {**described, "joints": joints}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["none.urdf"], "error: none.urdf: expected an existing file, got none\n"),
        (["bad.urdf"], "bad.urdf:1: joint 'x': expected <parent link=…>, got none\n"),
        (["lift.urdf", "--flange", "jow"], "error: lift.urdf: flange: unknown link 'jow', did you mean 'jaw'?\n"),
    ],
)
def test_a_bad_file_is_one_line(
    lift: str, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    Path("bad.urdf").write_text('<robot name="r"><link name="a"/><joint name="x" type="fixed"/></robot>', "utf-8")
    assert run(["robots", *arguments]) == 2
    assert capsys.readouterr().err == message


def test_a_xacro_file_is_described_with_its_arguments_and_what_was_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write_arm(tmp_path)
    monkeypatch.chdir(tmp_path)
    arguments = ["--package-dir", "packages", "--xacro-arg", "prefix=", "--xacro-arg", "length=0.7"]

    assert run(["robots", "arm.urdf.xacro", *arguments]) == 0

    text = capsys.readouterr().out
    assert "    upper  100 x 100 x 700  box\n" in text
    assert "note: segment.xacro:6: joint 'upper_joint': attribute 'damping' of <limit> is not known" in text
    assert text.endswith(
        "  rig:\n    model: arm.urdf.xacro\n    package_dirs: [packages]\n"
        '    xacro_args: {prefix: "", length: "0.7"}\n    flange: lower\n'
    )


def test_an_argument_without_a_value_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["robots", "arm.urdf.xacro", "--xacro-arg", "prefix"]) == 2
    assert "--xacro-arg: expected NAME=VALUE, got 'prefix'" in capsys.readouterr().err


def test_a_machine_gets_the_zero_that_positions_count_from(listed: dict[str, Any]) -> None:
    zeros = {robot["name"]: robot["zero"] for robot in listed["robots"]}

    assert zeros["kuka_kr6"]["is_stated"]
    assert zeros["kuka_kr6"]["controller"] == {
        "A2": "-model",
        "B2": "model - 90 deg",
        "C2": "model + 90 deg",
        "D2": "-model",
        "F2": "-model",
    }
    assert zeros["abb_irb1600"]["line"] == "joint positions count from the model's zero, which is the controller's"
    assert zeros["reis_rv20_16"] == {
        "line": "joint positions count from the model's zero, taken as the controller's; not confirmed",
        "is_stated": False,
        "controller": {},
        "source": "not stated",
    }
