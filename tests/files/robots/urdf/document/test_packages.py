"""Packages and paths: none stands in for another one, and what the cell states counts from the cell."""

from pathlib import Path

import pytest
import trimesh
from builders.urdf_texts import ARM
from builders.xacro_texts import HEAD, refused, write_arm

from cellplan.errors import InputError
from cellplan.files.input.files import AllowedFolders
from cellplan.files.robots.urdf.document.document import read_document
from cellplan.files.robots.urdf.document.xacro import XacroSettings
from cellplan.files.robots.urdf.load import UrdfOptions, load_urdf


def test_no_other_package_stands_in_for_a_missing_one(tmp_path: Path) -> None:
    """Neither for a mesh nor for a file of macros, named in ``package_dirs`` or around the file."""
    package = tmp_path / "arm_support"
    (package / "meshes").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>arm_support</name></package>", encoding="utf-8")
    trimesh.creation.box((0.1, 0.2, 0.3)).export(package / "meshes" / "box.stl")
    (package / "other.xacro").write_text(f'{HEAD}<link name="base"/></robot>', encoding="utf-8")
    shape = '<collision><geometry><mesh filename="package://hand_support/meshes/box.stl"/></geometry></collision>'
    include = f'<xacro:include filename="$(find hand_support)/other.xacro"/>{ARM[1]}{ARM[2]}'
    for text in (f'<link name="base">{shape}</link>{ARM[1]}{ARM[2]}', include):
        path = package / "arm.urdf.xacro"
        path.write_text(f"{HEAD}{text}</robot>", encoding="utf-8")
        for dirs in ((), (package,), (package / "meshes",), (tmp_path,)):
            with pytest.raises(InputError, match="no package 'hand_support', looked through") as caught:
                load_urdf(path, UrdfOptions(package_dirs=dirs, within=AllowedFolders(folder=tmp_path)))
            assert str(package) in str(caught.value)


def test_the_name_that_a_manifest_states_comes_before_that_of_a_folder(tmp_path: Path) -> None:
    """Some collections call the folder of a package otherwise than its manifest does, and name it by the folder."""
    path = write_arm(tmp_path)
    package = tmp_path / "packages" / "arm_support"
    (package / "package.xml").write_text("<package><name>other_support</name></package>", encoding="utf-8")
    settings = XacroSettings(package_dirs=(tmp_path / "packages",))

    document = read_document(path, settings)

    assert list(document.links) == ["base", "left_upper", "left_lower"]
    assert document.remarks[0] == (
        "arm.urdf.xacro: package 'arm_support': is read from a folder of that name, whose package.xml states "
        "'other_support'"
    )
    right = tmp_path / "packages" / "fork"
    (right / "urdf").mkdir(parents=True)
    (right / "package.xml").write_text("<package><name>arm_support</name></package>", encoding="utf-8")
    segment = (package / "urdf" / "segment.xacro").read_text(encoding="utf-8")
    (right / "urdf" / "segment.xacro").write_text(segment.replace("${name}_joint", "${name}_turn"), encoding="utf-8")

    document = read_document(path, settings)

    assert list(document.joints) == ["left_upper_turn", "left_lower_turn"]
    assert not any("package" in remark for remark in document.remarks)


@pytest.mark.parametrize(("folder", "is_taken"), [("arm", True), ("support", False), ("hand", False), ("ar", False)])
def test_a_folder_around_the_file_stands_in_only_where_its_name_begins_the_package(
    tmp_path: Path, folder: str, is_taken: bool
) -> None:
    """Parts of a package that were copied without its manifest; a folder under ``package_dirs`` may have any name."""
    place = tmp_path / folder
    place.mkdir()
    (place / "links.xacro").write_text(f'{HEAD}<link name="base"/></robot>', encoding="utf-8")
    path = place / "arm.xacro"
    path.write_text(f'{HEAD}<xacro:include filename="$(find arm_support)/links.xacro"/></robot>', encoding="utf-8")
    remark = f"arm.xacro: package 'arm_support': no such package, read from the folder '{folder}'"

    if is_taken:
        assert read_document(path).remarks == (remark,)
    else:
        with pytest.raises(InputError, match="no package 'arm_support', looked through"):
            read_document(path)
    assert read_document(path, XacroSettings(package_dirs=(place,))).remarks == (remark,)


def test_a_file_does_not_include_itself_through_another_package(tmp_path: Path) -> None:
    """Two folders of one package: what looks like the file of another one is the file itself."""
    package = tmp_path / "arm"
    package.mkdir()
    (package / "macro.xacro").write_text(
        f'{HEAD}<xacro:include filename="$(find arm)/macro.xacro"/></robot>', encoding="utf-8"
    )
    message = refused(tmp_path, '<xacro:include filename="arm/macro.xacro"/>')
    assert message == "macro.xacro:1: expected no file that includes itself, got 'macro.xacro'"


LENGTHS = '<xacro:property name="lengths" value="${xacro.load_yaml(\'$(arg lengths)\')}"/>'
LONG_ARM = (
    '<xacro:arg name="lengths" default="default.yaml"/>',
    LENGTHS,
    '<link name="base_${lengths.name}"/>',
)


@pytest.mark.parametrize("written", ["mine.yaml", "./mine.yaml", "sizes/mine.yaml"])
def test_the_path_in_an_argument_counts_from_the_cell(tmp_path: Path, written: str) -> None:
    arm, place = tmp_path / "desc" / "urdf" / "r.xacro", tmp_path / written
    for folder in (arm.parent, place.parent):
        folder.mkdir(parents=True, exist_ok=True)
    place.write_text("name: mine", encoding="utf-8")
    (arm.parent / "default.yaml").write_text("name: default", encoding="utf-8")
    (arm.parent / "mine.yaml").write_text("name: beside the arm", encoding="utf-8")
    arm.write_text("\n".join([HEAD, *LONG_ARM, "</robot>"]), encoding="utf-8")
    settings = XacroSettings(arguments={"lengths": written}, within=AllowedFolders(folder=tmp_path))

    assert list(read_document(arm, settings).links) == ["base_mine"]
    assert list(read_document(arm).links) == ["base_default"]
    place.unlink()
    (arm.parent / "mine.yaml").unlink()
    with pytest.raises(InputError, match=f"no such file: {tmp_path}/(?:./)?{written.removeprefix('./')}"):
        read_document(arm, settings)


def test_an_include_named_by_an_argument_counts_from_the_cell_too(tmp_path: Path) -> None:
    (tmp_path / "desc").mkdir()
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "links.xacro").write_text(f'{HEAD}<link name="base"/></robot>', encoding="utf-8")
    arm = tmp_path / "desc" / "r.xacro"
    arm.write_text(
        f'{HEAD}<xacro:arg name="dir" default="."/><xacro:include filename="$(arg dir)/links.xacro"/></robot>',
        encoding="utf-8",
    )
    within = AllowedFolders(folder=tmp_path)

    assert list(read_document(arm, XacroSettings(arguments={"dir": "mine"}, within=within)).links) == ["base"]


def test_a_path_that_only_lies_beside_the_macros_is_read_with_a_remark(tmp_path: Path) -> None:
    (tmp_path / "desc").mkdir()
    (tmp_path / "desc" / "default.yaml").write_text("name: d", encoding="utf-8")
    arm = tmp_path / "desc" / "r.xacro"
    arm.write_text("\n".join([HEAD, *LONG_ARM, "</robot>"]), encoding="utf-8")
    settings = XacroSettings(arguments={"lengths": "default.yaml"}, within=AllowedFolders(folder=tmp_path))

    document = read_document(arm, settings)

    assert list(document.links) == ["base_d"]
    assert document.remarks[0] == (
        "r.xacro: xacro_args: no 'default.yaml' beside the cell file: it was read from the folder 'desc'"
    )


def test_values_that_are_no_paths_lead_nowhere(tmp_path: Path) -> None:
    """Neither an empty prefix nor a text that some file happens to begin with; absolute paths stay as they are."""
    path = write_arm(tmp_path)
    settings = XacroSettings(
        arguments={"prefix": "", "length": "0.5"},
        package_dirs=(tmp_path / "packages",),
        within=AllowedFolders(folder=tmp_path),
    )
    assert not any("xacro_args" in remark for remark in read_document(path, settings).remarks)


def test_an_empty_path_is_named_with_its_argument(tmp_path: Path) -> None:
    message = refused(tmp_path, *LONG_ARM, args={"lengths": ""})
    assert message == (
        "r.xacro:4: expected the path of a file, got an empty one: state it as `xacro_args: {lengths: …}`, "
        "counted from the cell file"
    )
    message = refused(tmp_path, '<xacro:arg name="file" default=""/>', '<xacro:include filename="$(arg file)"/>')
    assert message.startswith("r.xacro:3: expected the path of a file, got an empty one: ")
