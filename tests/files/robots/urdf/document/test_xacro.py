"""A xacro file becomes what xacro itself makes of it, reads nothing from elsewhere, and fails in one located line."""

import builtins
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import trimesh
import xacro
from builders.urdf_texts import ARM, joint
from builders.xacro_texts import HEAD, expanded, refused, write_arm
from xacro import substitution_args

from cellplan.errors import InputError
from cellplan.files.input.files import AllowedFolders
from cellplan.files.robots.urdf.document.document import read_document
from cellplan.files.robots.urdf.document.xacro import XacroSettings
from cellplan.files.robots.urdf.load import UrdfOptions, load_urdf
from cellplan.geometry.transforms import Array
from cellplan.model.robot.robot import RobotModel
from cellplan.scene.kinematics.screw_chain import screw_displacement


def flange(model: RobotModel, q: Array) -> Array:
    X = np.eye(4)
    for axis, position in zip(model.joints, q, strict=True):
        X = X @ screw_displacement(axis, position)
    return X @ model.X_BF


def test_an_arm_of_macros_moves_as_pinocchio_says_of_the_text_that_xacro_makes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_arm(tmp_path)
    options = UrdfOptions(package_dirs=(tmp_path / "packages",), xacro_args={"prefix": "", "length": "0.7"})
    robot = load_urdf(path, options)
    monkeypatch.setattr(substitution_args, "_eval_find", lambda name: str(tmp_path / "packages" / name))
    text = xacro.process_file(str(path), mappings={"prefix": "", "length": "0.7"}).toprettyxml()
    theirs = pin.buildModelFromXML(text)
    data = theirs.createData()

    assert robot.model.joint_names == tuple(theirs.names)[1:] == ("upper_joint", "lower_joint")
    rng = np.random.default_rng(0)
    for _ in range(20):
        q = rng.uniform(-1, 2, 2)
        pin.framesForwardKinematics(theirs, data, q)
        truth = data.oMf[theirs.getFrameId("lower")].homogeneous
        assert np.abs(flange(robot.model, q) - truth).max() < 1e-12  # rounding of a handful of products


def test_every_file_that_was_read_is_known_and_findings_name_the_line_of_the_macro(tmp_path: Path) -> None:
    path = write_arm(tmp_path)
    options = UrdfOptions(package_dirs=(tmp_path / "packages",))
    robot = load_urdf(path, options)

    assert {file.name for file in robot.included} == {"segment.xacro", "sizes.yaml"}
    assert robot.remarks == (
        "segment.xacro:6: joint 'left_upper_joint': attribute 'damping' of <limit> is not known and was not read "
        "(and 1 more)",
        "arm.urdf.xacro: known, but not used: effort of <limit>",
    )
    segment = tmp_path / "packages" / "arm_support" / "urdf" / "segment.xacro"
    segment.write_text(segment.read_text().replace('type="revolute"', 'type="revolut"'), encoding="utf-8")
    with pytest.raises(InputError, match=r"^segment\.xacro:3: joint 'left_upper_joint': expected the type revolute"):
        load_urdf(path, options)


@pytest.mark.parametrize("dirs", [("packages/arm_support",), ("elsewhere/renamed",), ("elsewhere",), ()])
def test_a_package_is_found_by_its_folder_or_its_manifest_or_above_the_file(
    tmp_path: Path, dirs: tuple[str, ...]
) -> None:
    path = write_arm(tmp_path)
    package = tmp_path / "packages" / "arm_support"
    if not dirs:
        package.rename(tmp_path / "arm_support")
    elif dirs[0].startswith("elsewhere"):
        (package / "package.xml").write_text("<package><name>arm_support</name></package>", encoding="utf-8")
        (tmp_path / "elsewhere").mkdir()
        package.rename(tmp_path / "elsewhere" / "renamed")

    document = read_document(path, XacroSettings(package_dirs=tuple(tmp_path / entry for entry in dirs)))

    assert list(document.links) == ["base", "left_upper", "left_lower"]
    assert not any("package" in remark for remark in document.remarks)


def test_a_folder_of_another_name_that_has_the_file_is_taken_with_a_remark(tmp_path: Path) -> None:
    path = write_arm(tmp_path)
    (tmp_path / "packages" / "arm_support").rename(tmp_path / "packages" / "arm")

    document = read_document(path, XacroSettings(package_dirs=(tmp_path / "packages" / "arm",)))

    assert document.remarks[0] == "arm.urdf.xacro: package 'arm_support': no such package, read from the folder 'arm'"


@pytest.mark.parametrize(
    "prefix",
    [
        "$(find arm_support)",
        "file://$(find arm_support)",
        "file:///$(find arm_support)",
        "file:$(find arm_support)",
        "package://arm_support",
    ],
)
@pytest.mark.parametrize("folder", ["packages/arm_support", "packages/arm"])
def test_meshes_of_a_package_are_found_where_its_files_are(tmp_path: Path, prefix: str, folder: str) -> None:
    mesh = tmp_path / folder / "meshes" / "box.stl"
    mesh.parent.mkdir(parents=True)
    trimesh.creation.box((0.1, 0.2, 0.3)).export(mesh)
    shape = f'<geometry><mesh filename="{prefix}/meshes/box.stl"/></geometry>'
    lines = (
        f'<link name="base"><collision>{shape}</collision></link>',
        '<link name="tip"/>',
        joint("a1", "base", "tip"),
    )
    path = tmp_path / "r.xacro"
    path.write_text("\n".join([HEAD, *lines, "</robot>"]), encoding="utf-8")

    robot = load_urdf(path, UrdfOptions(package_dirs=(tmp_path / folder,), within=AllowedFolders(folder=tmp_path)))

    assert robot.mesh_files == (mesh,)
    renamed = "r.xacro:2: mesh 'package://arm_support/meshes/box.stl': no such package, read from the folder 'arm'"
    assert robot.remarks == ((renamed,) if folder.endswith("arm") else ())


def test_a_renamed_package_does_not_lead_out_of_the_allowed_folders(tmp_path: Path) -> None:
    trimesh.creation.box((0.1, 0.2, 0.3)).export(tmp_path / "secret.stl")
    inside = tmp_path / "cell"
    inside.mkdir()
    path = inside / "r.urdf"
    mesh = '<collision><geometry><mesh filename="package://arm/../secret.stl"/></geometry></collision>'
    path.write_text(f'<robot name="r"><link name="base">{mesh}</link>{ARM[1]}{ARM[2]}</robot>', encoding="utf-8")

    with pytest.raises(InputError, match=r"no package 'arm', looked through"):
        load_urdf(path, UrdfOptions(within=AllowedFolders(folder=inside)))


def test_without_xacro_one_line_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without(name: str, *rest: object) -> object:
        if name == "xacro":
            raise ImportError(name)
        return real(name, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(builtins, "__import__", without)
    assert refused(tmp_path) == 'r.xacro: expected the package xacro to be installed: pip install "cellplan[xacro]"'


ELSEWHERE = "from elsewhere; allow it with --allow-dir"
NO_END = "expected macros, includes and expressions that end, got some that call themselves"


@pytest.mark.parametrize(
    ("lines", "args", "message"),
    [
        (
            ['<link name="${widht}"/>'],
            {},
            "r.xacro:2: expected a file that xacro can expand, got: name 'widht' is not defined when evaluating "
            "expression 'widht'",
        ),
        (
            ['<xacro:macro name="m" params="a"/>', '<link name="b"/>', "<xacro:m/>"],
            {},
            "r.xacro:4: expected a file that xacro can expand, got: Undefined parameters [a]",
        ),
        (
            ["<xacro:m/>"],
            {},
            "r.xacro:2: expected a file that xacro can expand, got: unknown macro name: xacro:m",
        ),
        (
            ['<xacro:macro name="m" params="a">', '<xacro:m a="1"/></xacro:macro>', '<xacro:m a="1"/>'],
            {},
            f"r.xacro:3: {NO_END}",
        ),
        (
            ['<xacro:include filename="r.xacro"/>'],
            {},
            "r.xacro:2: expected no file that includes itself, got 'r.xacro'",
        ),
        (
            ['<xacro:include filename="/etc/passwd"/>'],
            {},
            f"r.xacro:2: expected files below the folder of the cell file, got 'passwd' {ELSEWHERE}",
        ),
        (
            ['<xacro:property name="d" value="${xacro.load_yaml(\'/etc/passwd\')}"/>', '<link name="${d}"/>'],
            {},
            f"r.xacro:3: expected files below the folder of the cell file, got 'passwd' {ELSEWHERE}",
        ),
        (
            ['<xacro:include filename="/etc/*.conf"/>'],
            {},
            "r.xacro:2: expected files below the folder of the cell file, got '/etc/*.conf' from elsewhere",
        ),
        (
            ['<xacro:include filename="$(find arm)/a.xacro"/>'],
            {},
            "r.xacro:2: no package 'arm', looked through {folder}: name the folder that holds it in `package_dirs`",
        ),
        (
            ['<xacro:arg name="prefix" default=""/>', '<link name="b$(arg prefix)"/>'],
            {"prefx": "a"},
            "r.xacro: xacro_args: unknown argument 'prefx', did you mean 'prefix'?",
        ),
        (
            ['<xacro:arg name="prefix"/>'],
            {},
            "r.xacro:2: expected a value for the argument 'prefix', got arguments: none: state "
            "`xacro_args: {prefix: …}` of the robot in the cell",
        ),
        (
            ['<link name="$(arg prefix)b"/>'],
            {"prefx": "a"},
            "r.xacro:2: expected a value for the argument 'prefix', got arguments: prefx: state "
            "`xacro_args: {prefix: …}` of the robot in the cell",
        ),
        (
            ['<link name="$(env HOME)"/>'],
            {},
            "r.xacro:2: expected no variable of the environment, got $(env HOME): use an argument, `xacro_args`",
        ),
        ([], {}, "r.xacro: expected 1 to 1000 links, got 0: is it a file of macros that others include?"),
        (
            ['<foreign:element name="x"/>'],
            {},
            "r.xacro:2: expected well-formed XML, got: unbound prefix; xacro needs "
            'xmlns:xacro="http://www.ros.org/wiki/xacro" in the root element',
        ),
    ],
)
def test_what_cannot_be_expanded_is_one_line_with_its_place(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], lines: list[str], args: Mapping[str, str], message: str
) -> None:
    assert refused(tmp_path, *lines, args=args) == message.replace("{folder}", str(tmp_path))
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    "expression",
    [
        "().__class__",
        "(lambda: ().__class__)()",
        "[each.__class__ for each in [1]]",
        "(each for each in [1]).gi_frame",
        "xacro.load_yaml.__globals__",
        "'{0.real}'.format(1)",
        "python.vars(xacro)",
        "python.type(1)",
        "__import__('os')",
        "open('r.xacro')",
        "$(eval (lambda: 1).__code__)",
        "$(eval open)",
    ],
)
def test_an_expression_has_no_way_to_the_objects_behind_the_values(tmp_path: Path, expression: str) -> None:
    text = expression if expression.startswith("$") else f"${{{expression}}}"

    assert refused(tmp_path, f'<link name="a{text}"/>').startswith("r.xacro:2: expected ")


def test_usual_expressions_have_their_values_and_warnings_are_remarks(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    lines = (
        '<xacro:arg name="side" default="LEFT"/>',
        "<link name=\"${'$(arg side)'.lower()}_${[2 * each for each in range(3)][2]}_$(eval 1 + 2)\"/>",
        "<link name=\"${int(round(degrees(pi)))}_$(optenv HOME default)_${xacro.arg('side')}\"/>",
        '<joint name="j" type="fixed"><parent link="left_4_3"/><child link="180_default_LEFT"/></joint>',
        '<xacro:if value="${1 > 2}"><link name="never"/></xacro:if>',
        '<xacro:include filename="none.xacro" optional="true"/>',
    )
    document = expanded(tmp_path, *lines)

    assert list(document.links) == ["left_4_3", "180_default_LEFT"]
    assert document.remarks == (
        "r.xacro: $(optenv HOME) is taken as 'default': variables of the environment are not read",
        "r.xacro: xacro: Using range() directly is deprecated. Use python.range() instead.",
    )
    assert capfd.readouterr() == ("", "")


def test_xacro_is_left_as_it_was(tmp_path: Path) -> None:
    owners = (xacro, substitution_args, substitution_args.yaml.SafeLoader)
    before = [dict(vars(owner)) for owner in owners]
    symbols = dict(xacro._global_symbols["python"])
    expanded(tmp_path, '<link name="b"/>')
    refused(tmp_path, '<link name="${c}"/>')

    changing = {"filestack", "macrostack", "all_includes", "verbosity", "_empty_text_node"}
    for owner, names in zip(owners, before, strict=True):
        now = dict(vars(owner))
        assert {name for name in now | names if now.get(name) is not names.get(name)} <= changing
    assert dict(xacro._global_symbols["python"]) == symbols
