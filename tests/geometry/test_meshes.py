"""Meshes are read whole or refused, and answer questions about rays, insides and hulls."""

import os
import re
import struct
from pathlib import Path

import coal
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from cellplan.errors import InputError
from cellplan.geometry.meshes import (
    contains,
    convex_hull,
    corner_normals,
    is_flat,
    make_mesh,
    mesh_volume,
    ray_hits,
    read_mesh,
    require_solid,
    tessellate,
)
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere, support
from cellplan.geometry.transforms import rotation_from_rpy

BOX = tessellate(Box((0.2, 0.4, 0.6)))
TURN = rotation_from_rpy([0.3, -0.7, 1.1])
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
    assert "expected the numbers that the PLY header names, got a damaged file" in refusal(path)


def test_damaged_binary_stl_names_the_bytes(tmp_path: Path) -> None:
    path = write(tmp_path, "stl")
    path.write_bytes(path.read_bytes()[:-1])
    expected = "part.stl: expected 684 bytes for the 12 triangles that its header names, got 683: "
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
        "1 'endsolid': the file is cut off"
    )
    path.write_text("\n".join(lines).replace("vertex", "vertx", 1))
    assert refusal(path) == f"part.stl:{vertex + 1}: expected a line of a text STL, got 'vertx'"
    path.write_text("\n".join([*lines[:vertex], "vertex 1,0 2 3", *lines[vertex + 1 :]]))
    assert refusal(path) == f"part.stl:{vertex + 1}: expected 3 numbers, got '1,0 2 3'"


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
            "v 0 0 0\nv 2 0 0\nv 0.1 0.1 0\nv 0 2 0\nf 2 3 4 1\n",
            "m.obj: expected convex faces, got 1 others: triangulate the mesh before export",
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
            "m.ply: expected the numbers that the PLY header names, got a damaged file: "
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
    scene = tmp_path / "scene.dae"
    scene.write_text("<COLLADA/>")
    assert refusal(scene) == "scene.dae: COLLADA files are not read: convert the mesh to STL, OBJ or PLY"
    step = tmp_path / "part.step"
    step.write_text("ISO-10303-21;")
    assert refusal(step) == "part.step: expected a mesh file .stl, .obj or .ply, got '.step'"
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


def test_triangles_without_area_are_dropped_and_a_heap_of_them_is_refused() -> None:
    slivers = np.concatenate([BOX.faces, [[0, 0, 1], [2, 2, 2]]])
    mesh = make_mesh(BOX.vertices, slivers, source="part.stl")
    assert (len(mesh.faces), mesh.is_closed) == (12, True)

    with pytest.raises(InputError, match=re.escape("part.stl: expected triangles with an area, got 13 of 25 without")):
        make_mesh(BOX.vertices, np.concatenate([BOX.faces, np.zeros((13, 3), int)]), source="part.stl")


def test_vertices_that_differ_by_single_precision_are_welded() -> None:
    loose = BOX.vertices[BOX.faces].reshape(-1, 3)
    shaken = loose + 1e-9 * np.random.default_rng(1).uniform(-1, 1, loose.shape)

    assert make_mesh(shaken, np.arange(36).reshape(-1, 3), source="part.stl").is_closed


def test_a_surface_turned_inside_out_is_turned_back_and_a_cavity_stays_one() -> None:
    inner = 0.5 * BOX.vertices
    assert mesh_volume(make_mesh(BOX.vertices, BOX.faces[:, ::-1], source="x")) == pytest.approx(0.048, rel=1e-12)

    both = np.concatenate([BOX.vertices, inner])
    hollow = np.concatenate([BOX.faces, BOX.faces[:, ::-1] + 8])
    for faces in (hollow, hollow[:, ::-1]):
        mesh = make_mesh(both, faces, source="x")
        assert mesh_volume(mesh) == pytest.approx(0.048 * (1 - 1 / 8), rel=1e-12)
        assert contains(mesh, np.array([[0.0, 0, 0], [0.08, 0, 0], [1, 0, 0]])).tolist() == [False, True, False]

    beside = np.concatenate([BOX.vertices, inner + np.array([1.0, 0, 0])])
    mesh = make_mesh(beside, hollow, source="x")
    assert mesh_volume(mesh) == pytest.approx(0.048 * (1 + 1 / 8), rel=1e-12)
    assert contains(mesh, np.array([[1.0, 0, 0], [0.5, 0, 0]])).tolist() == [True, False]


def test_an_open_crowded_or_flat_surface_is_no_solid() -> None:
    open_box = make_mesh(BOX.vertices, BOX.faces[1:], source="part.stl")
    with pytest.raises(InputError) as caught:
        require_solid(open_box)
    assert str(caught.value) == (
        "part.stl: expected a closed surface, got 3 open edges, 0 edges of more than two triangles and 0 edges whose "
        "triangles face opposite ways: repair the mesh"
    )
    turned = make_mesh(BOX.vertices, np.concatenate([BOX.faces[:1, ::-1], BOX.faces[1:]]), source="part.stl")
    with pytest.raises(InputError, match="and 3 edges whose triangles face opposite ways"):
        require_solid(turned)
    doubled = make_mesh(BOX.vertices, np.concatenate([BOX.faces, BOX.faces[:1]]), source="part.stl")
    with pytest.raises(InputError, match="3 edges of more than two triangles"):
        require_solid(doubled)
    sheet = Mesh(vertices=BOX.vertices * [1, 1, 0], faces=BOX.faces, source="part.stl", is_closed=True)
    assert is_flat(sheet)
    with pytest.raises(InputError, match="expected a solid, got a surface that encloses no volume"):
        require_solid(sheet)


@pytest.mark.parametrize("shape", [Cylinder(0.25, 0.5), Sphere(0.25)])
def test_corner_normals_follow_round_walls_and_break_at_creases(shape: Solid) -> None:
    mesh = tessellate(shape, 96)

    normals = corner_normals(mesh)

    corner = mesh.vertices[mesh.faces]
    faces = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    faces /= np.linalg.norm(faces, axis=1, keepdims=True)
    truth = np.where(np.abs(faces[:, None, 2:]) > 0.99, faces[:, None, :], corner * [1, 1, 0])
    if isinstance(shape, Sphere):
        truth = corner.copy()
    truth /= np.linalg.norm(truth, axis=2, keepdims=True)
    # a vertex of a latitude ring sees its neighbours unevenly: less than one facet of 3.75 deg
    room = 1e-12 if isinstance(shape, Cylinder) else np.radians(3.75)
    assert np.linalg.norm(normals, axis=2) == pytest.approx(1.0, abs=1e-12)
    assert np.abs(normals - truth).max() < room


def turned_mesh(mesh: Mesh, R: np.ndarray) -> Mesh:
    return Mesh(vertices=mesh.vertices @ R.T, faces=mesh.faces, source=mesh.source, is_closed=True)


@pytest.mark.parametrize("R", [np.eye(3), TURN], ids=["along the axes", "turned"])
def test_rays_through_edges_and_vertices_of_a_box_are_not_lost(R: np.ndarray) -> None:
    grid = tessellate(Box((1.0, 1.0, 1.0)))
    for _ in range(4):  # 3072 triangles whose edges lie exactly under the rays
        grid = make_mesh(*trimesh.remesh.subdivide(grid.vertices, grid.faces), source="grid")
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 33), np.linspace(-0.5, 0.5, 33))
    inside = np.stack([x.ravel(), y.ravel(), np.full(x.size, 2.0)], axis=1)

    hits = ray_hits(turned_mesh(grid, R), inside @ R.T, R @ [0.0, 0.0, -2.0])

    assert hits.is_hit.all()  # rays that run down along a wall hit its upper edge
    assert np.abs(hits.points @ R - (inside * [1, 1, 0] + [0, 0, 0.5])).max() < 1e-14  # rounding of the turn
    assert hits.distance == pytest.approx(1.5, abs=1e-14)


def test_rays_through_edges_and_vertices_of_a_cylinder_are_not_lost() -> None:
    mesh = tessellate(Cylinder(0.25, 0.5), 24)
    wall = mesh.vertices[np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 1]) > 0.1]
    height = np.linspace(-0.25, 0.25, 11)
    feet = np.unique(np.round(np.arctan2(wall[:, 1], wall[:, 0]), 12))
    origins = np.array([[np.cos(a), np.sin(a), z] for a in feet for z in height])

    hits = ray_hits(mesh, origins, -origins * [1, 1, 0])

    assert hits.is_hit.all()
    assert np.hypot(hits.points[:, 0], hits.points[:, 1]) == pytest.approx(0.25 / np.cos(np.pi / 24), abs=1e-12)
    through_caps = ray_hits(mesh, wall * [0.999999, 0.999999, 0] + [0, 0, 1.0], np.array([0.0, 0, -1.0]))
    assert through_caps.is_hit.all()
    assert through_caps.points[:, 2] == pytest.approx(0.25, abs=1e-15)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_rays_lie_on_the_plane_of_the_triangle_they_hit_and_nothing_lies_before(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mesh = turned_mesh(tessellate(Capsule(0.2, 0.5), 16), rotation_from_rpy(rng.uniform(-3, 3, 3)))
    origins = rng.uniform(-1, 1, (200, 3))
    directions = rng.normal(size=(200, 3))

    hits = ray_hits(mesh, origins, directions)

    corner = mesh.vertices[mesh.faces]
    normals = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    hit = hits.is_hit
    off_plane = np.sum((hits.points[hit] - corner[hits.faces[hit], 0]) * normals[hits.faces[hit]], axis=1)
    assert np.abs(off_plane).max(initial=0.0) < 1e-12
    with np.errstate(divide="ignore", invalid="ignore"):  # convex and closed: clip the line by all planes
        steep = unit @ normals.T
        way = np.sum(corner[:, 0] * normals, axis=1) - origins @ normals.T
        enter = np.where(steep < 0, way / steep, -np.inf).max(axis=1)
        leave = np.where(steep > 0, way / steep, np.inf).min(axis=1)
    truth = np.where(enter > leave, np.inf, np.where(enter >= 0, enter, np.where(leave >= 0, leave, np.inf)))
    assert np.array_equal(np.isfinite(truth), hit)
    assert hits.distance[hit] == pytest.approx(truth[hit], abs=1e-12)
    assert np.isnan(hits.points[~hit]).all()
    assert np.isinf(hits.distance[~hit]).all()
    assert (hits.faces[~hit] == -1).all()


def test_rays_without_direction_are_a_mistake_of_the_caller() -> None:
    with pytest.raises(ValueError, match="directions other than zero"):
        ray_hits(BOX, np.zeros((1, 3)), np.zeros(3))
    with pytest.raises(ValueError, match="finite origins"):
        ray_hits(BOX, np.full((1, 3), np.nan), np.array([0.0, 0, 1]))
    assert ray_hits(BOX, np.empty((0, 3)), np.array([0.0, 0, 1])).points.shape == (0, 3)


def test_points_are_inside_where_the_solid_is() -> None:
    shape = Capsule(0.2, 0.5)
    mesh = turned_mesh(tessellate(shape, 64), TURN)
    points = np.random.default_rng(3).uniform(-0.6, 0.6, (2000, 3))
    local = points @ TURN
    depth = 0.2 - np.linalg.norm(local - np.clip(local * [0, 0, 1], -0.25, 0.25), axis=1)
    clear = np.abs(depth) > 2e-3  # the tessellated capsule is larger by up to 1.2 mm

    assert np.array_equal(contains(mesh, points)[clear], (depth > 0)[clear])


@pytest.mark.parametrize("shape", [Box((0.3, 0.1, 0.5)), Cylinder(0.2, 0.5), Capsule(0.1, 0.4), Sphere(0.3)])
@pytest.mark.parametrize("segments", [4, 5, 17, 48])
def test_tessellated_shapes_hold_the_true_ones_and_are_little_larger(shape: Solid, segments: int) -> None:
    mesh = tessellate(shape, segments)

    assert mesh.is_closed
    directions = np.random.default_rng(0).normal(size=(3000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    corner = mesh.vertices[mesh.faces]
    normals = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    planes = np.sum(normals * corner[:, 0], axis=1)
    assert np.all(planes >= support(shape, normals) - 1e-15)  # no face cuts into the shape
    assert np.all(support(mesh, directions) >= support(shape, directions) - 1e-15)
    if segments >= 17:
        growth = 1 / np.cos(np.pi / segments) ** 2 - 1
        assert np.all(support(mesh, directions) <= support(shape, directions) * (1 + 1.7 * growth) + 1e-15)


def test_a_hull_holds_its_mesh_and_agrees_with_qhull(shared_robots: Path) -> None:
    for path in sorted(shared_robots.glob("*/meshes/collision/*.stl"))[::4]:
        mesh = read_mesh(path)

        hull = convex_hull(mesh)

        points = coal.StdVec_Vec3s()
        points.extend(list(mesh.vertices))
        qhull = coal.Convex.convexHull(points, True, "Qt")
        assert hull.is_closed
        assert mesh_volume(hull) == pytest.approx(qhull.computeVolume(), rel=1e-6), path
        directions = np.random.default_rng(0).normal(size=(500, 3))
        assert support(hull, directions) == pytest.approx(support(mesh, directions), rel=1e-6, abs=1e-7)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(*[st.integers(0, 3)] * 3), min_size=4, max_size=30), st.booleans())
def test_hulls_of_points_on_a_lattice_hold_them(corners: list[tuple[int, int, int]], is_turned: bool) -> None:
    points = np.array(corners, dtype=float) @ (TURN if is_turned else np.eye(3))
    cloud = Mesh(vertices=points, faces=np.zeros((0, 3), dtype=np.int64), source="cloud", is_closed=False)
    if np.linalg.matrix_rank(points - points[0], tol=1e-9) < 3:
        with pytest.raises(InputError, match="cloud: expected a body with a volume, got a flat one"):
            convex_hull(cloud)
        return

    hull = convex_hull(cloud)

    directions = np.random.default_rng(0).normal(size=(200, 3))
    assert hull.is_closed
    assert support(hull, directions) == pytest.approx(support(cloud, directions), abs=1e-9)


def test_the_hull_of_a_very_fine_sphere_is_bounded_work_and_still_holds_it() -> None:
    fine = tessellate(Sphere(0.3), 120)
    hull = convex_hull(fine)

    directions = np.random.default_rng(0).normal(size=(2000, 3))
    ratio = support(hull, directions) / support(fine, directions)
    assert len(hull.vertices) <= 2000 < len(fine.vertices)
    assert ratio.min() >= 1 - 1e-12
    assert ratio.max() < 1.01
