"""COLLADA files are read whole, where their nodes put them, or refused by the line."""

from pathlib import Path

import coal
import numpy as np
import pytest
from builders.collada_texts import CORNERS, INPUT, LISTS, SHOWN, VOLUME, collada

from cellplan.errors import InputError
from cellplan.geometry.mesh.load import mesh_volume, read_drawing, read_mesh, require_solid
from cellplan.geometry.shapes import Mesh


def read(folder: Path, text: str, **options: object) -> Mesh:
    path = folder / "m.dae"
    path.write_text(text, encoding="utf-8")
    return read_mesh(path, **options)  # type: ignore[arg-type]


def refusal(folder: Path, text: str) -> str:
    with pytest.raises(InputError) as caught:
        read(folder, text)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def assert_points(mesh: Mesh, expected: np.ndarray, *, within: float = 1e-7) -> None:
    """The vertices are the expected points, in any order."""
    distance = np.linalg.norm(mesh.vertices[:, None] - expected[None], axis=2)
    assert len(mesh.vertices) == len(expected)
    assert distance.min(axis=0).max() < within
    assert distance.min(axis=1).max() < within


@pytest.mark.parametrize("kind", LISTS)
def test_every_way_to_write_faces_gives_the_solid(tmp_path: Path, kind: str) -> None:
    mesh = read(tmp_path, collada(LISTS[kind]))

    require_solid(mesh)
    assert len(mesh.faces) == 8
    assert mesh_volume(mesh) == pytest.approx(VOLUME, rel=1e-6)
    assert_points(mesh, CORNERS)


def test_unit_scale_and_up_axis(tmp_path: Path) -> None:
    inch = '<unit name="inch" meter="0.0254"/>'
    for axis, turned in (
        ("<up_axis>Z_UP</up_axis>", CORNERS),
        ("<up_axis>Y_UP</up_axis>", np.stack([CORNERS[:, 0], -CORNERS[:, 2], CORNERS[:, 1]], axis=1)),
        ("<up_axis>X_UP</up_axis>", np.stack([-CORNERS[:, 1], -CORNERS[:, 2], CORNERS[:, 0]], axis=1)),
        ("", np.stack([CORNERS[:, 0], -CORNERS[:, 2], CORNERS[:, 1]], axis=1)),
    ):
        text = collada(asset=inch + axis)
        assert_points(read(tmp_path, text), 0.0254 * CORNERS)
        assert_points(read(tmp_path, text, scale=(2, -2, 1)), 0.0254 * CORNERS * (2, -2, 1))
        for unit in (None, "inch"):
            upright = read_drawing(tmp_path / "m.dae", unit=unit)
            assert_points(upright, 0.0254 * turned)
            assert mesh_volume(upright) == pytest.approx(0.0254**3 * VOLUME, rel=1e-6)
    with pytest.raises(InputError, match=r"^m.dae: states a unit of 0.0254 m, got unit: mm: leave out the unit$"):
        read_drawing(tmp_path / "m.dae", unit="mm")


def test_nodes_place_turn_and_mirror_as_another_reader_says(tmp_path: Path) -> None:
    library = '<library_nodes><node id="part"><scale>1 2 1</scale><instance_geometry url="#g"/></node></library_nodes>'
    nodes = (
        '<node><translate>1 0 0</translate><rotate>0 0 1 90</rotate><node><instance_node url="#part"/></node></node>'
        '<node><matrix>-1 0 0 0 0 1 0 -2 0 0 1 0.5 0 0 0 1</matrix><instance_geometry url="#g"/></node>'
    )
    mesh = read(tmp_path, collada(nodes=nodes, library=library, asset="<up_axis>Z_UP</up_axis>"))

    x, y, z = CORNERS.T
    expected = np.concatenate([np.stack([1 - 2 * y, x, z], axis=1), np.stack([-x, y - 2, z + 0.5], axis=1)])
    assert_points(mesh, expected)
    require_solid(mesh)  # the mirrored one faces outward, too
    assert mesh_volume(mesh) == pytest.approx(3 * VOLUME, rel=1e-6)
    theirs = np.array(coal.MeshLoader().load(str(tmp_path / "m.dae"), np.ones(3)).vertices())
    assert theirs.min(axis=0) == pytest.approx(mesh.vertices.min(axis=0), abs=1e-6)
    assert theirs.max(axis=0) == pytest.approx(mesh.vertices.max(axis=0), abs=1e-6)


def test_a_mirrored_open_surface_keeps_its_outer_side(tmp_path: Path) -> None:
    nodes = '<node><scale>-1 1 1</scale><instance_geometry url="#g"/></node>'
    roof = f'<polylist count="4">{INPUT}<vcount>3 4 4 4</vcount><p>3 4 5 0 1 4 3 1 2 5 4 2 0 3 5</p></polylist>'
    for shown in (SHOWN, nodes):
        mesh = read(tmp_path, collada(roof, nodes=shown))
        corner = mesh.vertices[mesh.faces]
        normals = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        outward = np.sum(normals * (corner.mean(axis=1) - mesh.vertices.mean(axis=0)), axis=1)
        assert not mesh.is_closed
        assert np.all(outward > 0.0)


def test_broken_colours_do_no_harm_and_lines_are_passed_over(tmp_path: Path) -> None:
    normals = '<source id="n"><float_array id="na" count="9">nan x</float_array></source>'
    faces = LISTS["triangles"].replace(INPUT, f'{INPUT}<input semantic="NORMAL" source="#lost" offset="0"/>')
    lines = '<lines count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1</p></lines>'
    material = (
        '<node><instance_geometry url="#g"><bind_material><technique_common><instance_material symbol="a" target="#b"/>'
        "</technique_common></bind_material></instance_geometry></node>"
    )
    library = '<library_effects><effect id="e"/></library_effects><library_images><image/></library_images>'

    assert_points(read(tmp_path, collada(lines + faces, nodes=material, library=library, extra=normals)), CORNERS)
    assert refusal(tmp_path, collada(lines)) == "m.dae: expected triangles or polygons in the scene, got none"


def test_a_hollow_polygon_is_cut_as_it_is(tmp_path: Path) -> None:
    flat = np.array([[0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]]) * 0.1
    points = np.concatenate([np.column_stack([flat, np.full(8, z)]) for z in (0.0, 0.05)])
    sides = " ".join(f"{k} {(k + 1) % 8} {(k + 1) % 8 + 8} {k + 8}" for k in range(8))
    caps = " ".join(map(str, [*range(7, -1, -1), *range(8, 16)]))
    text = collada(
        f'<polylist count="10">{INPUT}<vcount>8 8 {"4 " * 8}</vcount><p>{caps} {sides}</p></polylist>', points=points
    )
    mesh = read(tmp_path, text)

    require_solid(mesh)
    assert mesh_volume(mesh) == pytest.approx(0.07 * 0.05, rel=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("<?xml", "<!DOCTYPE a [<!ENTITY b 'c'>]><?xml", "m.dae:1: expected plain XML, got a document type"),
        ("</mesh>", "</mash>", "m.dae:8: expected well-formed XML, got: mismatched tag"),
        ('count="18"', 'count="21"', "m.dae:4: <float_array> 'a': expected 21 numbers as its count declares, got 18"),
        (">0 0 0 0.3", ">0 0 0 nan", "m.dae:4: <float_array> 'a': expected finite numbers, got 1 others"),
        (">0 0 0 0.3", ">0 0 0 x", "m.dae:4: <float_array> 'a': expected numbers, got could not convert string"),
        (">0 0 0 0.3", ">0 0 0 \u0663", "m.dae:4: <float_array> 'a': expected numbers, got "),
        ('stride="3"', 'stride="4"', "m.dae:5: <accessor>: expected 6 points of three coordinates each"),
        ('source="#s"', 'source="#t"', "m.dae:6: <input>: expected a source of positions, got 0 named '#t'"),
        ('source="#v"', 'source="#w"', "m.dae:7: <triangles>: expected one input VERTEX from '#v', got 1"),
        ('offset="0"', 'offset="-1"', "m.dae:7: <input>: expected a whole number in 'offset', got '-1'"),
        ("<p>0 2 1", "<p>0 2", "m.dae:7: <triangles>: expected 8 as its count declares, with 1 indices at each corner"),
        ("<p>0 2 1", "<p>0 2 6", "m.dae:7: <triangles>: expected corners among 6 points, got point 6 counted from 0"),
        ("<p>0 2 1", "<p>0 2 -1", "m.dae:7: <p>: expected whole numbers from 0"),
        ("<triangles", "<polygons><ph/></polygons><triangles", "m.dae:7: <ph>: not supported: export rigid polygons"),
        ("<node>", "<node><matrix>1 2</matrix>", "m.dae:10: <matrix>: expected 16 numbers, got 2"),
        ("<node>", "<node><skew>1</skew>", "m.dae:10: <skew>: not supported: export rigid polygons"),
        ("<node>", "<node><scale>1 0 1</scale>", "m.dae:10: <scale>: expected a scale that keeps a volume, got one of"),
        (
            'url="#g"',
            'url="#h"',
            "m.dae:10: <instance_geometry>: expected the url of a <geometry> with a <mesh> of this file, got '#h'",
        ),
        (
            'url="#g"',
            'url="other.dae#g"',
            "m.dae:10: <instance_geometry>: expected the url of a <geometry> with a <mesh> of this file",
        ),
        ('url="#scene"', "", "m.dae:11: <instance_visual_scene>: expected the url of a <visual_scene> of this file"),
        (">0 0 0 0.3", ">0 0 0 1e39", "m.dae: expected finite coordinates, got "),
        ("<instance_geometry", "<instance_controller", "m.dae:10: <instance_controller>: not supported"),
        ("<asset>", '<asset><unit meter="0"/>', "m.dae:2: <unit>: expected a positive number in 'meter', got '0'"),
        ('id="g"', "", "m.dae:3: <geometry>: expected an id of its own"),
        ("COLLADA", "COLADA", "m.dae:2: <COLADA>: expected a COLLADA file with <COLLADA> as its root element"),
    ],
)
def test_damage_is_refused_by_its_line(tmp_path: Path, old: str, new: str, message: str) -> None:
    text = collada()
    assert old in text
    many = -1 if old == "COLLADA" else 1
    assert refusal(tmp_path, text.replace(old, new, many)).startswith(message)


def test_a_wrong_up_axis_is_refused_where_it_counts(tmp_path: Path) -> None:
    read(tmp_path, collada(asset="<up_axis>W_UP</up_axis>"))
    with pytest.raises(InputError, match=r"^m.dae:2: <up_axis>: expected X_UP, Y_UP or Z_UP, got 'W_UP'$"):
        read_drawing(tmp_path / "m.dae", unit=None)


def test_no_cut_gives_a_smaller_shape_and_no_byte_a_traceback(tmp_path: Path) -> None:
    whole = collada(LISTS["polylist"], asset="<up_axis>Z_UP</up_axis>").encode()
    for length in range(0, len(whole) - 2, 29):
        assert refusal(tmp_path, whole[:length].decode()).startswith("m.dae:")
    rng, path, messages = np.random.default_rng(3), tmp_path / "m.dae", []
    for _ in range(150):
        damaged = bytearray(whole)
        damaged[int(rng.integers(len(whole)))] = int(rng.integers(32, 127))
        path.write_bytes(damaged)
        try:
            mesh = read_mesh(path)
        except InputError as error:
            messages.append(str(error))
        else:
            assert len(mesh.faces) >= 7  # a digit of a coordinate or of an index may be another one
    assert len(messages) > 75
    assert all(message.startswith("m.dae") and "\n" not in message for message in messages)


def test_nodes_that_are_instanced_over_and_over_are_refused(tmp_path: Path) -> None:
    nodes = "".join(
        f'<node id="n{k + 1}"><instance_node url="#n{k}"/><instance_node url="#n{k}"/></node>' for k in range(40)
    )
    library = f'<library_nodes><node id="n0"/>{nodes}</library_nodes>'
    shown = '<node><instance_node url="#n40"/></node>'
    message = "m.dae: expected at most 100000 nodes in the scene, got more"
    assert refusal(tmp_path, collada(nodes=shown, library=library)) == message

    circle = '<library_nodes><node id="n0"><instance_node url="#n0"/></node></library_nodes>'
    shown = '<node><instance_node url="#n0"/></node>'
    assert "Node #n0 not found in library" in refusal(tmp_path, collada(nodes=shown, library=circle))
    assert refusal(tmp_path, collada(nodes="<node>" * 70 + "</node>" * 70)).endswith("in 64 levels, got more")
