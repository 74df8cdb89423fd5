"""Mesh files are read whole or refused."""

import os
import re
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh

from cellplan.errors import InputError
from cellplan.geometry.mesh.load import (
    mesh_volume,
    read_mesh,
    require_solid,
    tessellate,
)
from cellplan.geometry.shapes import Box, Mesh

BOX = tessellate(Box((0.2, 0.4, 0.6)))
FORMATS = ["stl", "ascii.stl", "obj", "ply", "ascii.ply"]


def write(folder: Path, kind: str, mesh: Mesh = BOX) -> Path:
    """Write a mesh with another library; ``ascii.stl`` is a text STL."""
    path = folder / f"part.{kind.rpartition('.')[2]}"
    other = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    match kind:
        case "ascii.stl":
            path.write_text(trimesh.exchange.stl.export_stl_ascii(other))
        case "ascii.ply":
            path.write_bytes(trimesh.exchange.ply.export_ply(other, encoding="ascii"))
        case _:
            other.export(path)
    return path


def refusal(path: Path, **options: object) -> str:
    """The one-line message with which a mesh is refused."""
    with pytest.raises(InputError) as caught:
        read_mesh(path, **options)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("kind", FORMATS)
def test_every_format_gives_back_the_solid(tmp_path: Path, kind: str) -> None:
    mesh = read_mesh(write(tmp_path, kind))

    assert (mesh.vertices.shape, mesh.faces.shape, mesh.is_closed) == ((8, 3), (12, 3), True)
    assert mesh_volume(mesh) == pytest.approx(0.048, rel=1e-6)  # single precision in the file
    assert np.ptp(mesh.vertices, axis=0) == pytest.approx([0.2, 0.4, 0.6], rel=1e-6)
    require_solid(mesh)


def test_the_scale_turns_millimetres_into_metres_and_mirrors_without_turning_inside_out(tmp_path: Path) -> None:
    path = write(tmp_path, "stl", Mesh(vertices=1e3 * BOX.vertices, faces=BOX.faces, source="", is_closed=True))

    assert mesh_volume(read_mesh(path, scale=1e-3)) == pytest.approx(0.048, rel=1e-6)
    assert mesh_volume(read_mesh(path, scale=(1e-3, -1e-3, 2e-3))) == pytest.approx(0.096, rel=1e-6)


def test_a_binary_stl_that_starts_with_solid_is_read_as_binary(tmp_path: Path) -> None:
    path = write(tmp_path, "stl")
    data = path.read_bytes()
    path.write_bytes(b"solid facet outer loop".ljust(80) + data[80:])

    assert len(read_mesh(path).faces) == 12


@pytest.mark.slow
def test_real_collision_meshes_agree_with_another_reader(shared_robots: Path) -> None:
    files = sorted(shared_robots.glob("*/meshes/*/*.stl"))
    assert len(files) > 50
    for path in files:
        ours = read_mesh(path)
        theirs = trimesh.load(str(path), file_type="stl", force="mesh")  # merges equal vertices
        assert ours.is_closed or not theirs.is_watertight, path
        if ours.is_closed and theirs.is_winding_consistent:
            assert mesh_volume(ours) == pytest.approx(abs(theirs.volume), rel=1e-5), path  # their vertices are welded


def test_text_formats_keep_polygons_negative_indices_and_comments(tmp_path: Path) -> None:
    corners = "\n".join(f"v {x} {y} {z} # corner" for x in (0, 1) for y in (0, 1) for z in (0, 1))
    path = tmp_path / "cube.obj"
    path.write_text(
        f"# cube\nmtllib nowhere.mtl\no cube\n{corners}\nvt 0 0\nvn 0 0 1\nusemtl red\ns off\n"
        "f 1//1 2//1 4//1 3//1\nf 5/1/1 7/1/1 8/1/1 6/1/1\nf -8 -4 \\\n -3 -7\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"
    )

    mesh = read_mesh(path)

    assert len(mesh.faces) == 12
    assert mesh.is_closed
    assert mesh_volume(mesh) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("v 0", " v 0"),
        ("f 1", "f\t1"),
        ("f 1 2", "f 1 \\\n2"),
        ("f 1 2 3", "f -8 -7 -6"),
        ("\n", " # here\n"),
        ("\n", "\r\n"),
        ("1 0 0\n", "1 0 0 1.0\n"),
        ("f 1", "vt 0 0\nf 1"),
    ],
)
def test_an_obj_file_in_another_style_is_the_same(tmp_path: Path, old: str, new: str) -> None:
    path = tmp_path / "m.obj"
    corners = "\n".join(f"v {x} {y} {z}" for x in (0, 1) for y in (0, 1) for z in (0, 1))
    usual = f"{corners}\nf 1 2 3\nf 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"
    path.write_text(usual, newline="")
    expected = read_mesh(path)
    assert old in usual
    path.write_text(usual.replace(old, new), newline="")

    mesh = read_mesh(path)

    assert mesh_volume(mesh) == pytest.approx(1.0, rel=1e-12)
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], expected.vertices[expected.faces])


@pytest.mark.parametrize("order", ["<", ">"])
def test_binary_ply_may_have_more_columns_and_mixed_faces_in_either_byte_order(tmp_path: Path, order: str) -> None:
    name = {"<": "little", ">": "big"}[order]
    header = (
        f"ply\nformat binary_{name}_endian 1.0\ncomment made here\nelement vertex 5\nproperty uchar red\n"
        "property double x\nproperty float y\nproperty float z\nelement face 5\n"
        "property list uchar int vertex_indices\nproperty uchar quality\nend_header\n"
    )
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1)]
    faces = [(3, 2, 1, 0), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]
    body = b"".join(struct.pack(f"{order}Bdff", 7, *corner) for corner in corners)
    body += b"".join(struct.pack(f"{order}B{len(f)}iB", len(f), *f, 9) for f in faces)
    path = tmp_path / "pyramid.ply"
    path.write_bytes(header.encode() + body)

    mesh = read_mesh(path)

    assert (len(mesh.faces), mesh.is_closed) == (6, True)
    assert mesh_volume(mesh) == pytest.approx(1.0 / 3.0, rel=1e-12)
    path.write_bytes(header.encode() + body[:-3])
    assert "part" not in refusal(path)
    assert "expected the numbers that the PLY header declares, got a damaged file" in refusal(path)


MARK = b"\xef\xbb\xbf"


@pytest.mark.parametrize(
    ("kind", "before", "after"),
    [
        ("stl", b"", b"\n"),
        ("stl", b"", b"\0" * 50),
        ("stl", MARK, b""),
        ("ascii.stl", MARK, b""),
        ("ascii.stl", b"", b"\x1a"),
        ("ascii.stl", MARK, b"\n\0\0"),
        ("obj", MARK, b""),
        ("ascii.ply", MARK, b""),
    ],
)
def test_marks_before_a_file_and_padding_after_it_change_nothing(
    tmp_path: Path, kind: str, before: bytes, after: bytes
) -> None:
    path = write(tmp_path, kind)
    path.write_bytes(before + path.read_bytes() + after)

    mesh = read_mesh(path)

    require_solid(mesh)
    assert mesh_volume(mesh) == pytest.approx(0.048, rel=1e-6)


def test_what_is_appended_to_an_stl_is_named(tmp_path: Path) -> None:
    path = write(tmp_path, "stl")
    whole = path.read_bytes()
    path.write_bytes(whole + b"COLOR=abc")
    assert refusal(path) == (
        "part.stl: expected the file to end after the 12 triangles that its header declares, got 9 bytes more: the "
        "header is wrong, or something was appended; export it again"
    )
    text = write(tmp_path, "ascii.stl").read_text()
    path.write_bytes(text.encode() + b"made by hand\n")
    assert re.fullmatch(r"part\.stl:\d+: expected a line of a text STL, got 'made'", refusal(path))
    path.write_bytes(text.encode("utf-16"))
    assert refusal(path) == ("part.stl: expected a binary or plain text STL file, got text in UTF-16: save it as UTF-8")


def test_damaged_binary_stl_names_the_bytes(tmp_path: Path) -> None:
    path = write(tmp_path, "stl")
    path.write_bytes(path.read_bytes()[:-1])
    expected = "part.stl: expected 684 bytes for the 12 triangles that its header declares, got 683: "
    assert refusal(path) == expected + "the file is damaged or not STL"

    path.write_bytes(path.read_bytes()[:40])
    assert refusal(path) == "part.stl: expected an STL file, got 40 bytes that are neither binary nor text STL"


@pytest.mark.parametrize("kind", FORMATS)
def test_no_cut_and_no_flipped_bit_turns_a_mesh_into_a_smaller_one_in_silence(tmp_path: Path, kind: str) -> None:
    path = write(tmp_path, kind)
    whole = path.read_bytes()
    assert read_mesh(path).is_closed
    for length in range(0, len(whole) - 1, 7):
        path.write_bytes(whole[:length])
        try:
            mesh = read_mesh(path)
        except InputError:
            continue
        with pytest.raises(InputError):
            require_solid(mesh)  # a list of OBJ faces may end anywhere: the surface is then open


def test_text_stl_with_a_lost_line_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, "ascii.stl")
    lines = path.read_text().splitlines()
    vertex = next(i for i, line in enumerate(lines) if "vertex" in line)
    path.write_text("\n".join(lines[:vertex] + lines[vertex + 1 :]))
    assert refusal(path) == (
        "part.stl: expected three vertices in each of 12 facets and an 'endsolid', got 35 vertices, 12 'endfacet' and "
        "1 'endsolid': the file is truncated"
    )
    path.write_text("\n".join(lines).replace("vertex", "vertx", 1))
    assert refusal(path) == f"part.stl:{vertex + 1}: expected a line of a text STL, got 'vertx'"
    path.write_text("\n".join([*lines[:vertex], "vertex 1,0 2 3", *lines[vertex + 1 :]]))
    assert refusal(path) == f"part.stl:{vertex + 1}: expected 3 numbers, got '1,0 2 3'"


def test_text_stl_may_hold_several_solids_whose_names_are_words_of_the_format(tmp_path: Path) -> None:
    path = write(tmp_path, "ascii.stl")
    facets = "\r".join(path.read_text().splitlines()[1:-1])
    moved = facets.replace("vertex ", "VERTEX  ").replace(" -0.3", " 7.E-01").replace(" 0.3", " +1.3")
    path.write_text(f"solid vertex solid 1 2 3\r{facets}\rendsolid vertex\rSOLID\r{moved}\rENDSOLID endsolid normal")

    mesh = read_mesh(path)

    assert (mesh.vertices.shape, mesh.faces.shape) == ((16, 3), (24, 3))
    assert np.ptp(mesh.vertices, axis=0) == pytest.approx([0.2, 0.4, 1.6], rel=1e-6)


def test_numbers_of_text_stl_that_slipped_from_one_line_to_another_are_refused(tmp_path: Path) -> None:
    path = write(tmp_path, "ascii.stl")
    text = path.read_text()
    vertex = re.search(r"vertex .*\n", text)
    assert vertex
    path.write_text(text.replace(vertex[0], "vertex 1 2\n", 1))
    assert refusal(path).endswith(": expected 3 numbers, got '1 2'")
    path.write_text(text.replace(vertex[0], "", 1).replace("endloop", f"{vertex[0]}endloop", 2))
    assert "got 37 vertices, 12 'endfacet'" in refusal(path)
    path.write_text(text.replace(vertex[0], "", 1).replace("endfacet", f"{vertex[0]}endfacet", 1))
    assert "got 36 vertices, 12 'endfacet' and 1 'endsolid': the file is truncated" in refusal(path)


def test_a_binary_stl_with_too_many_or_no_triangles_is_refused_by_its_header(tmp_path: Path) -> None:
    path = tmp_path / "part.stl"
    path.write_bytes(bytes(84))
    assert refusal(path) == "part.stl: expected 4 to 500000 triangles, got 0"
    path.write_bytes(bytes(80) + struct.pack("<I", 500_001) + bytes(50 * 500_001))
    assert refusal(path) == "part.stl: expected 4 to 500000 triangles, got 500001"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "m.obj: expected corners among 3 vertices, got vertex 4"),
        ("v 0 0 0\nf 1 0 1\n", "m.obj:2: expected a vertex number from 1 to 1, got 0"),
        ("v 0 0 0\nf 1 -2 1\n", "m.obj:2: expected a vertex number from 1 to 1, got -2"),
        ("v 0 0 0\nf 1 1\n", "m.obj:2: expected a face with at least three corners, got 2"),
        ("v 0 0\n", "m.obj:1: expected a vertex of three numbers, got '0 0'"),
        ("v 0 0 0 2\n", "m.obj:1: expected a vertex of three numbers, got '0 0 0 2'"),
        ("v 0 0 x\n", "m.obj:1: expected 3 numbers, got '0 0 x'"),
        ("f a b c\n", "m.obj:1: expected a vertex number, got 'a'"),
        ("call other.obj\n", "m.obj:1: expected vertices and flat faces, got 'call', which is not supported"),
        ("v 0 0 0\n", "m.obj: expected 4 to 500000 triangles, got 0"),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3 4\n",
            "m.obj: expected faces that do not cross themselves, of at most 3000 corners where not convex, got one of "
            "4 corners, vertices 1, 2, 3, 4, …: triangulate the mesh before export",
        ),
        ("\0", "m.obj: expected an OBJ text file, got binary data"),
    ],
)
def test_bad_obj_is_refused_with_its_line(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "m.obj"
    path.write_text(text)

    assert refusal(path) == message


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nend_header\ninf 0 1 2\n",
            "m.ply: expected the numbers that the PLY header declares, got a damaged file: a list has inf entries",
        ),
        (
            "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n3 0 1 nan\n",
            "m.ply: expected the numbers that the PLY header declares, got a damaged file: "
            "a face needs three or more whole vertex numbers",
        ),
        ("PLY\n", "m.ply: expected a PLY file that starts with 'ply' and has an 'end_header'"),
        ("ply\nend_header\n", "m.ply: expected a PLY header with a 'format' line"),
        ("ply\nformat ascii 2.0\nend_header\n", "m.ply:2: expected a PLY header line, got 'format ascii 2.0'"),
        (
            "ply\nformat ascii 1.0\nelement vertex -1\nend_header\n",
            "m.ply:3: expected a PLY header line, got 'element vertex -1'",
        ),
        (
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n",
            "m.ply: expected a PLY file with elements 'vertex' (x, y, z) and 'face' (vertex_indices)",
        ),
        (
            "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n3 0 1.5 2\n",
            "m.ply: expected the numbers that the PLY header declares, got a damaged file: "
            "a face needs three or more whole vertex numbers",
        ),
    ],
)
def test_bad_ply_is_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "m.ply"
    path.write_text(text)

    assert refusal(path) == message


def test_files_that_are_no_meshes_are_refused(tmp_path: Path) -> None:
    picture = tmp_path / "picture.stl"
    picture.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 4)
    assert "the file is damaged or not STL" in refusal(picture)
    assert refusal(tmp_path / "absent.stl") == "absent.stl: the mesh file cannot be read: no such file or directory"
    assert refusal(tmp_path) == f"{tmp_path.name}: expected a regular file"
    pipe = tmp_path / "pipe.stl"
    os.mkfifo(pipe)
    assert refusal(pipe) == "pipe.stl: expected a regular file"
    step = tmp_path / "part.step"
    step.write_text("ISO-10303-21;")
    assert refusal(step) == "part.step: expected a mesh file .stl, .obj, .ply or .dae, got '.step'"
    big = tmp_path / "big.stl"
    with big.open("wb") as stream:
        stream.truncate(100_000_001)
    assert refusal(big) == "big.stl: expected at most 100 MB, got 100 MB"


def test_coordinates_and_sizes_that_cannot_be_meant_are_refused(tmp_path: Path) -> None:
    path = write(tmp_path, "obj")
    good = path.read_text()
    first = re.search(r"^v .*$", good, re.MULTILINE)
    assert first
    path.write_text(good.replace(first[0], "v nan 0 inf", 1))
    assert refusal(path) == "part.obj: expected finite coordinates, got 2 others"
    path.write_text(good.replace(first[0], "v 1e300 0 0", 1))
    assert "is the unit mm?" in refusal(path)
    path.write_text(good)
    assert refusal(path, scale=1000) == "part.obj: expected an extent of at most 20 m, got 600 m: is the unit mm?"
    assert refusal(path, scale=1e-3) == (
        "part.obj: expected an extent of at least 1 mm, got 0.0006 m: is the unit m or inch?"
    )
    assert "expected scale factors that are finite and not zero" in refusal(path, scale=(1, 0, 1))
    path.write_text(re.sub(r"^v (\S+)", lambda m: f"v {float(m[1]) + 50}", good, flags=re.MULTILINE))
    assert refusal(path) == "part.obj: expected a mesh within 20 m of its origin, got a vertex at 50.1 m"
