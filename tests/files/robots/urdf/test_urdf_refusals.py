"""Whatever of a URDF cannot be taken over faithfully is refused with file, line and cure."""

from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from builders.urdf_texts import ARM, LIMIT, joint, refusal, refused

from cellplan.files.robots.limits import StatedLimits
from cellplan.files.robots.urdf.load import UrdfOptions

STATE = "state limits in the cell, with a number for each …: "
MIMIC = '<mimic joint="{}"/>'


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([*ARM, '<link name="tip"/>'], "r.urdf:5: link 'tip': is already defined in line 3"),
        ([*ARM, joint("a1", "tip", "base")], "r.urdf:5: joint 'a1': is already defined in line 4"),
        ([*ARM, "<link/>"], "r.urdf:5: link: expected <link> with the attribute 'name'"),
        (
            [*ARM, '<link name="a,b"/>'],
            "r.urdf:5: link: expected a name of 1 to 120 letters, digits, '_', '-', '.' or '/' that does not "
            "start with '-' or '.', got 'a,b'",
        ),
        (
            [*ARM, '<link name="../tip"/>'],
            "r.urdf:5: link: expected a name of 1 to 120 letters, digits, '_', '-', '.' or '/' that does not "
            "start with '-' or '.', got '../tip'",
        ),
        (
            [*ARM[:2], joint("arm/a1", "base", "tip")],
            "r.urdf:4: joint 'arm/a1': is driven: expected a name of 1 to 60 letters, digits, '_', '-' or '.', "
            "got another one",
        ),
        ([*ARM, '<link name="x"/>'], "r.urdf: expected one root link, got 2: base, x"),
        ([*ARM, joint("b", "tip", "base")], "r.urdf:4: joint 'a1': its links form a cycle: tip, base"),
        (
            [*ARM, '<link name="x"/>', '<link name="y"/>', joint("b", "x", "y"), joint("c", "y", "x")],
            "r.urdf:7: joint 'b': its links form a cycle: y, x",
        ),
        ([*ARM, joint("b", "base", "tip")], "r.urdf:5: joint 'b': link 'tip' already hangs on joint 'a1' in line 4"),
        (
            [*ARM[:2], joint("a1", "bas", "tip")],
            "r.urdf:4: joint 'a1': unknown parent link 'bas', did you mean 'base'?",
        ),
        ([*ARM[:2], joint("a1", "base", "top")], "r.urdf:4: joint 'a1': unknown child link 'top', did you mean 'tip'?"),
        (["<gazebo/>"], "r.urdf: expected 1 to 1000 links, got 0"),
        (
            [*ARM[:2], joint("a1", "base", "tip", f'<axis xzy="0 1 0"/>{LIMIT}')],
            "r.urdf:4: joint 'a1': unknown attribute 'xzy' in <axis>, did you mean 'xyz'?",
        ),
        (
            [*ARM[:2], joint("a1", "base", "tip", f"<axis/>{LIMIT}")],
            "r.urdf:4: joint 'a1': expected <axis> with the attribute 'xyz'",
        ),
        (
            [*ARM[:2], joint("a1", "base", "tip", f'<origin XYZ="0 0 1"/>{LIMIT}')],
            "r.urdf:4: joint 'a1': unknown attribute 'XYZ' in <origin>, did you mean 'xyz'?",
        ),
        (
            [
                '<link name="base"><collision><geometry>',
                '<mesh filename="m.stl" scales="1 1 1"/></geometry></collision></link>',
            ],
            "r.urdf:3: link 'base': unknown attribute 'scales' in <mesh>, did you mean 'scale'?",
        ),
        ([f'<link name="l{i}"/>' for i in range(1001)], "r.urdf: expected 1 to 1000 links, got 1001"),
        (
            [
                '<link name="l0"/>',
                *(f'<link name="l{i + 1}"/>{joint(f"j{i}", f"l{i}", f"l{i + 1}")}' for i in range(65)),
            ],
            "r.urdf: expected at most 64 movable joints between 'l0' and 'l65', got 65",
        ),
        (['<link name="base"/>'], "r.urdf: expected a joint that moves a link, got none"),
        (
            ['<link name="base"/><link name="tool0"/>', joint("f", "base", "tool0", "", kind="fixed")],
            "r.urdf: expected a movable joint between 'base' and 'tool0', got none",
        ),
        ([*ARM[:2], joint("a1", "base", "tip", "")], None),
        (
            [*ARM, "<group>", '<link name="lost"/>', "</group>"],
            "r.urdf:6: expected <link> directly below its owner: here it would be lost",
        ),
        (
            [*ARM, "<group>", joint("lost", "a", "b"), "</group>"],
            "r.urdf:6: expected <joint> directly below its owner: here it would be lost",
        ),
        (
            ['<link name="base"><colision/></link>', *ARM[1:]],
            "r.urdf:2: link 'base': unknown element <colision>, did you mean 'collision'?",
        ),
        (
            [*ARM[:2], joint("a1", "base", "tip", LIMIT + '<axes xyz="0 0 1"/>')],
            "r.urdf:4: joint 'a1': unknown element <axes>, did you mean 'axis'?",
        ),
        ([*ARM[:2], '<joint name="a1"/>'], "r.urdf:4: joint 'a1': expected <joint> with the attribute 'type'"),
        (
            [*ARM[:2], joint("a1", "base", "tip", kind="revolut")],
            "r.urdf:4: joint 'a1': expected the type revolute, continuous, prismatic or fixed, got 'revolut', "
            "did you mean 'revolute'?",
        ),
        (
            [*ARM[:2], joint("a1", "base", "tip", kind="floating")],
            "r.urdf:4: joint 'a1': expected one axis at most, got the type 'floating', which is not supported",
        ),
        (
            [*ARM[:2], joint("a1", "base", "tip", kind="planar")],
            "r.urdf:4: joint 'a1': expected one axis at most, got the type 'planar', which is not supported",
        ),
        (
            [*ARM[:2], '<joint name="a1" type="fixed"><child link="tip"/></joint>'],
            "r.urdf:4: joint 'a1': expected <parent link=…>, got none",
        ),
        (
            [*ARM[:2], joint("a1", "base", "tip", LIMIT + LIMIT)],
            "r.urdf:4: joint 'a1': expected one <limit>, got 2",
        ),
        (
            [*ARM[:2], joint("a1", "base", "tip", LIMIT + '<axis xyz="0 0 0"/>')],
            "r.urdf:4: joint 'a1': expected an axis that is not zero, got '0 0 0'",
        ),
        (
            [*ARM[:2], joint("a1", "base", "tip", LIMIT + '<axis xyz="0 1"/>')],
            "r.urdf:4: joint 'a1': expected 3 finite numbers in 'xyz', got '0 1'",
        ),
        (
            [*ARM[:2], joint("a1", "base", "tip", LIMIT + '<origin rpy="0 nan 0"/>')],
            "r.urdf:4: joint 'a1': expected 3 finite numbers in 'rpy', got '0 nan 0'",
        ),
        (
            [*ARM[:2], joint("a1", "base", "tip", LIMIT + '<origin xyz="0 0 300"/>')],
            "r.urdf:4: joint 'a1': expected an origin within 20 m, got 300 m: is the unit mm?",
        ),
        (
            [*ARM[:2], joint("a1", "base", "tip", '<limit lower="2" upper="-1" velocity="3"/>')],
            "r.urdf:4: joint 'a1': expected 'lower' below 'upper', got 2 and -1: "
            f"{STATE}`limits: {{a1: {{lower_deg: …, upper_deg: …}}}}`",
        ),
        (
            [*ARM[:2], joint("a1", "base", "tip", '<limit lower="0" upper="0" velocity="3"/>')],
            'r.urdf:4: joint \'a1\': states lower="0" upper="0": '
            f"{STATE}`limits: {{a1: {{lower_deg: …, upper_deg: …}}}}`",
        ),
        (
            [ARM[0], '<link name="tool0"/>', joint("a1", "base", "tool0", '<limit velocity="3"/>', kind="prismatic")],
            "r.urdf:4: joint 'a1': states no lower and upper limit: "
            f"{STATE}`limits: {{a1: {{lower_mm: …, upper_mm: …}}}}`",
        ),
        (
            [*ARM[:2], joint("a1", "base", "tip", '<limit lower="-1" upper="1" velocity="0"/>')],
            f"r.urdf:4: joint 'a1': states velocity=\"0\": {STATE}`limits: {{a1: {{velocity_deg_s: …}}}}`",
        ),
        (
            [*ARM[:2], joint("a1", "base", "tip", '<limit lower="x" upper="1" velocity="0"/>')],
            "r.urdf:4: joint 'a1': expected a finite number in 'lower', got 'x'",
        ),
        (
            [*ARM[:2], joint("a1", "base", "tip", LIMIT, kind="continuous")],
            "r.urdf:4: joint 'a1': is continuous: "
            f"{STATE}`limits: {{a1: {{lower_deg: …, upper_deg: …}}}}`; "
            "a continuous joint turns without end with `wrap: true` in place of its lower and upper limit",
        ),
        (
            [*ARM[:2], joint("a1", "base", "tip", '<limit lower="-170" upper="170" velocity="3"/>')],
            "r.urdf:4: joint 'a1': expected position limits within ten turns, got 170 rad (is the unit degrees?): "
            f"{STATE}`limits: {{a1: {{lower_deg: …, upper_deg: …}}}}`",
        ),
        (
            [
                ARM[0],
                '<link name="tool0"/>',
                joint("a1", "base", "tool0", '<limit lower="0" upper="500" velocity="3"/>', kind="prismatic"),
            ],
            "r.urdf:4: joint 'a1': expected position limits within 20 m, got 500 m (is the unit mm?): "
            f"{STATE}`limits: {{a1: {{lower_mm: …, upper_mm: …}}}}`",
        ),
        (
            [*ARM[:2], joint("a1", "base", "tip", '<limit lower="0" upper="5" velocity="156"/>')],
            "r.urdf:4: joint 'a1': expected a velocity limit of at most 100 rad/s, got 156 rad/s (is it in deg/s?): "
            f"{STATE}`limits: {{a1: {{velocity_deg_s: …}}}}`",
        ),
        (
            [*ARM, '<link name="f"/>', joint("g", "base", "f")],
            "r.urdf: flange: expected the name of a link, as it could be any of: tip, f",
        ),
        (
            [
                *ARM,
                '<link name="tool0"/>',
                joint("m", "tip", "tool0", "", kind="fixed"),
                '<link name="f"/>',
                joint("g", "tip", "f"),
            ],
            "r.urdf:8: joint 'g': moves, but is not between the base and the flange 'tool0': "
            "hold it still with `locked: {g_deg: 0}` or with `locked: {others: zero}`",
        ),
        (
            [*ARM, '<link name="f"/>', joint("g", "base", "f", MIMIC.format("a2"))],
            "r.urdf:6: joint 'g': mimics the unknown joint 'a2', expected one of: a1, g",
        ),
        ([*ARM, '<link name="f"/>', joint("g", "base", "f", MIMIC.format("g"))], "r.urdf:6: joint 'g': mimics itself"),
        (
            [
                *ARM,
                '<link name="f"/>',
                joint("x", "tip", "f", "", kind="fixed"),
                '<link name="h"/>',
                joint("g", "base", "h", MIMIC.format("x")),
            ],
            "r.urdf:8: joint 'g': mimics 'x', which is fixed",
        ),
        (
            [
                *ARM,
                '<link name="f"/>',
                joint("g", "base", "f", MIMIC.format("h")),
                '<link name="k"/>',
                joint("h", "base", "k", MIMIC.format("a1")),
            ],
            "r.urdf:6: joint 'g': mimics 'h', which mimics 'a1': name the leading joint",
        ),
        (
            [
                *ARM,
                '<link name="f"/>',
                joint("g", "base", "f", '<mimic joint="a1" offset="9"/><limit lower="-1" upper="1" velocity="1"/>'),
            ],
            "r.urdf:4: joint 'a1': expected a lower limit below the upper one, got -57.2958 deg and -458.366 deg",
        ),
    ],
)
def test_unsound_robots_are_refused_with_line_and_cure(tmp_path: Path, lines: list[str], message: str | None) -> None:
    message = message or (
        "r.urdf:4: joint 'a1': states no limits: "
        f"{STATE}`limits: {{a1: {{lower_deg: …, upper_deg: …, velocity_deg_s: …}}}}`"
    )
    assert refused(tmp_path, *lines) == message


GRIPPER = (
    *ARM,
    '<link name="tool0"/>',
    joint("m", "tip", "tool0", "", kind="fixed"),
    '<link name="f"/>',
    joint("finger", "tip", "f", kind="prismatic"),
    '<link name="g"/>',
    joint("twin", "tip", "g", MIMIC.format("finger"), kind="prismatic"),
)


@pytest.mark.parametrize(
    ("limits", "locked", "message"),
    [
        ({"a2": StatedLimits()}, {}, "r.urdf: limits: unknown joint 'a2', expected one of: a1, m, finger, twin"),
        ({"m": StatedLimits()}, {}, "r.urdf:6: joint 'm': has limits in the cell, but it is fixed"),
        ({"twin": StatedLimits()}, {}, "r.urdf:10: joint 'twin': has limits in the cell, but it follows another joint"),
        ({"finger": StatedLimits()}, {}, "r.urdf:8: joint 'finger': has limits in the cell, but it is locked"),
        (
            {"a1": StatedLimits(lower=-2.0)},
            {},
            "r.urdf:4: joint 'a1': lower_deg: expected at least -57.29578, the limit of the model, got -114.591559",
        ),
        (
            {"a1": StatedLimits(upper=2.5)},
            {},
            "r.urdf:4: joint 'a1': upper_deg: expected at most 114.591559, the limit of the model, got 143.239449",
        ),
        (
            {"a1": StatedLimits(velocity=4.0)},
            {},
            "r.urdf:4: joint 'a1': velocity_deg_s: expected at most 171.887339, the limit of the model, got 229.183118",
        ),
        (
            {"a1": StatedLimits(velocity=0.0)},
            {},
            "r.urdf:4: joint 'a1': expected a positive velocity limit, got 0 deg/s",
        ),
        (
            {"a1": StatedLimits(lower=1.5, upper=1.5)},
            {},
            "r.urdf:4: joint 'a1': upper_deg: expected a lower limit below the upper one, got 85.943669 and 85.943669",
        ),
        (
            {"a1": StatedLimits(wraps=True)},
            {},
            "r.urdf:4: joint 'a1': expected `wrap: true` only for a continuous joint, got a revolute one",
        ),
        ({}, {"fingr": 0.0}, "r.urdf: locked: unknown joint 'fingr', did you mean 'finger'?"),
        ({}, {"m": 0.0}, "r.urdf:6: joint 'm': is locked by the cell, but it is fixed anyway"),
        ({}, {"twin": 0.0}, "r.urdf:10: joint 'twin': is locked by the cell, but it follows 'finger': lock that one"),
        (
            {},
            {"finger": 3.0},
            "r.urdf:8: joint 'finger': expected to be locked within -1000 mm to 2000 mm, got 3000 mm",
        ),
        ({}, {"a1": 0.0}, "r.urdf: expected a movable joint between 'base' and 'tool0', got none"),
    ],
)
def test_unsound_options_are_refused(
    tmp_path: Path, limits: Mapping[str, StatedLimits], locked: Mapping[str, float], message: str
) -> None:
    options = UrdfOptions(limits=limits, locked={"finger": 0.0} | dict(locked))
    assert refused(tmp_path, *GRIPPER, options=options) == message


def test_a_gripper_must_be_locked_and_a_flange_must_exist(tmp_path: Path) -> None:
    assert refused(tmp_path, *GRIPPER) == (
        "r.urdf:8: joint 'finger': moves, but is not between the base and the flange 'tool0': "
        "hold it still with `locked: {finger_mm: 0}` or with `locked: {others: zero}`"
    )
    options = UrdfOptions(flange="tool", locked={"finger": 0.0})
    assert refused(tmp_path, *GRIPPER, options=options) == "r.urdf: flange: unknown link 'tool', did you mean 'tool0'?"


def test_endless_turning_and_limits_exclude_each_other(tmp_path: Path) -> None:
    options = UrdfOptions(limits={"a1": StatedLimits(lower=-1.0, wraps=True)})
    lines = [*ARM[:2], joint("a1", "base", "tip", LIMIT, kind="continuous")]
    expected = "r.urdf:4: joint 'a1': expected either `wrap: true` or limits, got both"
    assert refused(tmp_path, *lines, options=options) == expected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "r.urdf:1: expected well-formed XML, got: no element found"),
        ("<robot>\n<link></robot>", "r.urdf:2: expected well-formed XML, got: mismatched tag"),
        ("<sdf/>", "r.urdf:1: expected a URDF with the root element <robot>, got <sdf>"),
        (
            '<!DOCTYPE robot [<!ENTITY a "aaaa">]>\n<robot name="&a;"/>',
            "r.urdf:1: expected plain XML, got a document type or an entity declaration",
        ),
        (
            '<robot name="x" xmlns:xacro="http://x">\n<xacro:macro/></robot>',
            "r.urdf:2: expected plain URDF, got <xacro:macro>: let the name of the file end in .xacro",
        ),
        ("<robot><link name='base'/></robot>", "r.urdf:1: robot: expected <robot> with the attribute 'name'"),
        ("<a>" * 65 + "</a>" * 65, "r.urdf:1: expected at most 64 nested elements"),
        (
            '<?xml version="1.0" encoding="klingon"?><robot/>',
            "r.urdf: expected XML in a known encoding: unknown encoding: klingon",
        ),
        (
            '<robot name="x">\n<link name="\x01"/></robot>',
            "r.urdf:2: expected well-formed XML, got: not well-formed (invalid token)",
        ),
        ("<robot name='x'/><robot/>", "r.urdf:1: expected well-formed XML, got: junk after document element"),
    ],
)
def test_files_that_are_no_plain_urdf_are_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "r.urdf"
    path.write_text(text)
    assert refusal(path) == message


def test_folders_missing_and_huge_files_are_refused(tmp_path: Path) -> None:
    assert refusal(tmp_path / "none.urdf") == "none.urdf: no such file"
    assert refusal(tmp_path) == f"{tmp_path.name}: expected a regular file, got a folder, a pipe or a device"
    big = tmp_path / "big.urdf"
    big.write_text("<robot name='x'>" + " " * 5_000_001 + "</robot>")
    assert refusal(big) == "big.urdf: expected a file of at most 5 MB, got a larger one"


def test_no_link_or_joint_can_be_missing_from_a_real_robot(shared_robots: Path, tmp_path: Path) -> None:
    source = shared_robots / "staubli_rx160"
    root = ET.parse(source / "staubli_rx160.urdf").getroot()  # noqa: S314 - our own test data
    (tmp_path / "meshes").symlink_to(source / "meshes")
    path = tmp_path / "r.urdf"
    victims = [element for element in root if element.tag in ("link", "joint")]
    for victim in victims:
        path.write_bytes(ET.tostring(_without(root, victim)))
        refusal(path)
    assert len(victims) == 19


def _without(root: ET.Element, victim: ET.Element) -> ET.Element:
    copy = ET.Element(root.tag, root.attrib)
    copy.extend(element for element in root if element is not victim)
    return copy


@pytest.mark.parametrize(("kind", "unit", "desired"), [("prismatic", "deg", "mm"), ("revolute", "mm", "deg")])
def test_a_joint_is_locked_in_its_own_unit(tmp_path: Path, kind: str, unit: str, desired: str) -> None:
    lines = [*ARM, '<link name="tool0"/>', joint("t", "tip", "tool0", "", kind="fixed")]
    lines += ['<link name="f"/>', joint("g", "base", "f", kind=kind)]
    options = UrdfOptions(locked={"g": 0.0}, lock_units={"g": unit})

    assert refused(tmp_path, *lines, options=options) == (
        f"r.urdf:8: joint 'g': is {kind}: expected to be locked in {desired}, got {unit}"
    )
