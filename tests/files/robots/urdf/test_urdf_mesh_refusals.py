"""Bodies of a URDF that cannot be taken over faithfully are refused with file, line and cure."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from builders.collada_texts import collada
from builders.urdf_texts import ARM, refused

from cellplan.files.input.files import AllowedFolders
from cellplan.files.robots.urdf.load import UrdfOptions, UrdfRobot, load_urdf, read_urdf
from cellplan.geometry.shapes import Mesh


def collision(shape: str) -> str:
    return f'<link name="base"><collision><geometry>{shape}</geometry></collision></link>'


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        ("", "expected <collision> with a <geometry> of one shape, got 0 shapes"),
        (
            '<sphere radius="1"/><sphere radius="1"/>',
            "expected <collision> with a <geometry> of one shape, got 2 shapes",
        ),
        ('<cone radius="1"/>', "expected a box, cylinder, capsule, sphere or mesh, got <cone>"),
        ('<box size="1 1"/>', "expected 3 finite numbers in 'size', got '1 1'"),
        ('<box size="1 0 1"/>', "expected a positive 'size', got '1 0 1'"),
        ('<sphere radius="-1"/>', "expected a positive 'radius', got '-1'"),
        ('<sphere radius="inf"/>', "expected a finite number in 'radius', got 'inf'"),
        ('<sphere radius="250"/>', "expected a 'radius' of at most 20 m, got '250': is the unit mm?"),
        ('<cylinder radius="1"/>', "expected <cylinder> with the attribute 'length'"),
        ("<mesh/>", "expected <mesh> with the attribute 'filename'"),
        ('<mesh filename="a.stl" scale="1 1"/>', "expected 3 finite numbers in 'scale', got '1 1'"),
        ('<mesh filename="a.stl" scale="1 0 1"/>', "expected a 'scale' without zeros, got '1 0 1'"),
    ],
)
def test_unsound_shapes_are_refused_with_their_line(tmp_path: Path, shape: str, message: str) -> None:
    assert refused(tmp_path, collision(shape), *ARM[1:]) == f"r.urdf:2: link 'base': {message}"


def test_missing_meshes_name_every_place_that_was_tried(tmp_path: Path) -> None:
    start = "r.urdf:2: link 'base' (collision): mesh"
    assert refused(tmp_path, collision('<mesh filename="m/a.stl"/>'), *ARM[1:]) == (
        f"{start} 'm/a.stl': no such mesh file, tried {tmp_path}/m/a.stl"
    )
    packages = UrdfOptions(package_dirs=(tmp_path / "ros",))
    message = refused(tmp_path, collision('<mesh filename="package://arm/a.stl"/>'), *ARM[1:], options=packages)
    assert message.startswith(
        f"{start} 'package://arm/a.stl': no package 'arm', looked through {tmp_path}/ros, {tmp_path}, "
    )
    assert message.endswith(": name the folder that holds it in `package_dirs`")
    for folder in (tmp_path / "ros" / "arm", tmp_path / "arm"):
        folder.mkdir(parents=True)
    message = refused(tmp_path, collision('<mesh filename="package://arm/a.stl"/>'), *ARM[1:], options=packages)
    assert message.startswith(
        f"{start} 'package://arm/a.stl': no such mesh file, tried {tmp_path}/ros/arm/a.stl, {tmp_path}/arm/a.stl: "
    )


@pytest.mark.parametrize(
    ("uri", "message"),
    [
        ("package://arm", "expected package://NAME/path"),
        ("package:///", "expected package://NAME/path"),
        ("package://../a.stl", "expected package://NAME/path"),
        ("http://x.org/a.stl", "expected a path, package:// or file://, got http://"),
        ("model://arm/a.stl", "expected a path, package:// or file://, got model://"),
        ("/etc/a.stl", "expected an absolute path below the URDF's folder or one of `package_dirs`"),
        ("file:///etc/a.stl", "expected an absolute path below the URDF's folder or one of `package_dirs`"),
        ("a.dae", "a.dae:1: expected well-formed XML, got: not well-formed (invalid token)"),
        ("a.stp", "a.stp: expected a mesh file .stl, .obj, .ply or .dae, got '.stp'"),
        ("file:///lost/b.mesh", "b.mesh: expected a mesh file .stl, .obj, .ply or .dae, got '.mesh'"),
        (
            "torn.stl",
            "torn.stl: expected 684 bytes for the 12 triangles that its header declares, got 683: "
            "the file is damaged or not STL",
        ),
        ("sheet.stl", "sheet.stl: expected a body with a volume, got a flat one"),
        ("large.stl", "large.stl: expected an extent of at most 20 m, got 500 m: is the unit mm?"),
        ("x" * 300 + ".stl", None),
    ],
)
def test_unsound_meshes_are_refused_with_the_line_of_their_link(tmp_path: Path, uri: str, message: str | None) -> None:
    trimesh.creation.box((500, 1, 1)).export(tmp_path / "large.stl")
    (tmp_path / "torn.stl").write_bytes((tmp_path / "large.stl").read_bytes()[:-1])
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0]])
    trimesh.Trimesh(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]).export(tmp_path / "sheet.stl")
    (tmp_path / "a.dae").write_text("?")
    message = message or f"no such mesh file, tried {tmp_path / uri}"
    expected = f"r.urdf:2: link 'base' (collision): mesh '{uri}': {message}"
    assert refused(tmp_path, collision(f'<mesh filename="{uri}"/>'), *ARM[1:]) == expected


def test_a_drawn_link_whose_drawing_cannot_be_read_is_not_dropped(tmp_path: Path) -> None:
    link = '<link name="base"><visual><geometry><mesh filename="a.dae"/></geometry></visual></link>'
    (tmp_path / "a.dae").write_text("<COLLADA/>")
    assert refused(tmp_path, link, *ARM[1:]) == (
        "r.urdf:2: link 'base' (visual, used as it has no collision element): mesh 'a.dae': a.dae: expected a <scene> "
        "that shows a <visual_scene>, got none"
    )


def test_a_mesh_elsewhere_is_not_even_looked_for(tmp_path: Path) -> None:
    (tmp_path / "cell").mkdir()
    (tmp_path / "secret.stl").write_text("not for you")
    (tmp_path / "cell" / "link.stl").symlink_to(tmp_path / "secret.stl")
    within = UrdfOptions(within=AllowedFolders(folder=tmp_path / "cell"))
    for uri in ("../secret.stl", "../missing.stl", "link.stl"):
        message = refused(tmp_path / "cell", collision(f'<mesh filename="{uri}"/>'), *ARM[1:], options=within)
        assert message == (
            f"r.urdf:2: link 'base' (collision): mesh '{uri}': expected a mesh below the folder of the cell file, got "
            "one elsewhere; allow it with --allow-dir"
        )
    wider = UrdfOptions(within=AllowedFolders(folder=tmp_path / "cell", allowed=(tmp_path,)))
    link = collision('<mesh filename="link.stl"/>')
    assert "link.stl: expected an STL file" in refused(tmp_path / "cell", link, *ARM[1:], options=wider)


def robot(folder: Path, uri: str, *, options: UrdfOptions | None = None) -> UrdfRobot:
    """Robot whose base is drawn by a mesh of this name, in line 2."""
    path = folder / "r.urdf"
    path.write_text("\n".join(['<robot name="rig">', collision(f'<mesh filename="{uri}"/>'), *ARM[1:], "</robot>"]))
    return load_urdf(path, options)


def test_names_that_only_some_programs_understand_are_remarks(tmp_path: Path) -> None:
    meshes = tmp_path / "ros" / "arm" / "meshes"
    meshes.mkdir(parents=True)
    (meshes / "a.dae").write_text(collada(asset="<up_axis>Y_UP</up_axis>"))
    (tmp_path / "ros" / "b.dae").write_text(collada())
    packages = UrdfOptions(package_dirs=(tmp_path / "ros",))
    slashes = "has too many slashes, read as package://NAME/path"
    for uri, remark in [
        ("package://arm/meshes/a.dae", None),
        ("package:///arm/meshes/a.dae", slashes),
        ("package://arm//meshes/a.dae", slashes),
        ("package:///b.dae", "names no package, looked up without one"),
        ("/arm/meshes/a.dae", "begins with a slash, looked up below the folders of the URDF and of packages"),
    ]:
        read = robot(tmp_path, uri, options=packages)
        assert read.remarks == (() if remark is None else (f"r.urdf:2: mesh '{uri}': {remark}",))
        (shape,) = (body.shape for body in read.model.bodies)
        assert isinstance(shape, Mesh)
        assert np.ptp(shape.vertices, axis=0) == pytest.approx([0.3, 0.2, 0.1], abs=1e-7)  # no axis is turned up


def test_an_absolute_path_counts_below_an_allowed_folder(tmp_path: Path) -> None:
    (tmp_path / "cell").mkdir()
    (tmp_path / "drawings").mkdir()
    mesh = tmp_path / "drawings" / "a.dae"
    mesh.write_text(collada())
    wider = UrdfOptions(within=AllowedFolders(folder=tmp_path / "cell", allowed=(tmp_path / "drawings",)))
    for uri in (str(mesh), f"file://{mesh}"):
        (remark,) = robot(tmp_path / "cell", uri, options=wider).remarks
        assert remark.endswith(": is an absolute path, which other machines will not have")
    message = refused(tmp_path / "cell", collision(f'<mesh filename="{mesh}"/>'), *ARM[1:])
    assert message.endswith("expected an absolute path below the URDF's folder or one of `package_dirs`")


def test_an_angle_of_more_than_two_turns_is_a_slip_of_the_unit(tmp_path: Path) -> None:
    origin = '<link name="base"><visual><origin rpy="0 0 {}"/><geometry><sphere radius="1"/></geometry></visual></link>'

    assert refused(tmp_path, origin.format(90), *ARM[1:]) == (
        "r.urdf:2: link 'base': expected angles of at most two turns (12.57 rad), got '0 0 90': is the unit deg?"
    )
    (tmp_path / "r.urdf").write_text(f'<robot name="rig">{origin.format(12.5)}{"".join(ARM[1:])}</robot>')
    assert read_urdf(tmp_path / "r.urdf").joint_names == ("a1",)
