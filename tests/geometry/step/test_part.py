"""Parts from STEP files: units, places in assemblies, names, meshes within their deviation, and spoilt files."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from builders.step_files import UNITS, Named, box, cylinder, distinct, write_step
from OCP.TopAbs import TopAbs_FACE

from cellplan.errors import InputError
from cellplan.geometry.mesh.load import contains, mesh_volume
from cellplan.geometry.step.part import StepPart, read_step_part
from cellplan.geometry.transforms import pose, transform_points

NESTED = (
    (),
    (pose((100.0, -20.0, 5.0)),),
    (pose((0.0, 0.0, 50.0), (0.0, 0.0, np.pi / 2.0)), pose((10.0, 0.0, 0.0), (0.3, 0.0, 0.0))),
    (
        pose((1.0, 2.0, 3.0), (0.1, 0.2, 0.3)),
        pose((-40.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
        pose((0.0, 9.0, 0.0), (2.0, 0.0, 0.0)),
    ),
)  # [mm], [rad] the outermost assembly first


def read(path: Path, shape: str | None = None, deviation: float = 1e-4) -> StepPart:
    return read_step_part(path, path.name, shape, deviation)


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("poses", NESTED, ids=len)
def test_units_and_nested_places_are_those_of_the_file(
    tmp_path: Path, unit: str, poses: tuple[np.ndarray, ...]
) -> None:
    path = write_step(tmp_path / "a.step", [Named("PLATE", box((0, 0, 0), (30, 20, 10)))], poses=poses, unit=unit)

    mesh = read(path).mesh

    corners = np.array([(x, y, z) for x in (0, 30) for y in (0, 20) for z in (0, 10)], dtype=float)
    for X in reversed(poses):
        corners = transform_points(X, corners)
    nearest = np.linalg.norm(corners[:, None] - 1e3 * mesh.vertices[None], axis=2).min(axis=1)
    assert len(mesh.vertices) == 8
    assert nearest.max() < 1e-6  # [mm] numbers of the file have 14 digits


@pytest.mark.parametrize("deviation", [1e-3, 1e-4, 2e-5])
def test_the_mesh_of_a_cylinder_is_inside_it_and_within_the_deviation(tmp_path: Path, deviation: float) -> None:
    path = write_step(tmp_path / "c.step", [Named("PIN", cylinder(20, 50))])

    part = read(path, deviation=deviation)

    corner = part.mesh.vertices[part.mesh.faces]
    middles = np.concatenate([corner.mean(axis=1), 0.5 * (corner[:, 0] + corner[:, 1])])
    on_side = np.abs(middles[:, 2] - 0.025) < 0.0249
    radii = np.linalg.norm(middles[on_side, :2], axis=1)
    assert radii.min() >= 0.02 - deviation
    assert radii.max() <= 0.02 + 1e-9
    assert np.pi * (0.02 - deviation) ** 2 * 0.05 <= mesh_volume(part.mesh) <= np.pi * 0.02**2 * 0.05


def test_solids_that_touch_are_one_part(tmp_path: Path) -> None:
    plates = [Named("BASE", box((0, 0, 0), (100, 100, 10))), Named("WEB", box((0, 46, 10), (100, 54, 60)))]

    part = read(write_step(tmp_path / "t.step", plates))

    assert part.solids == ("BASE", "WEB")
    assert part.mesh.is_closed
    assert mesh_volume(part.mesh) == pytest.approx(140e-6, rel=1e-9)  # [m^3]
    assert contains(part.mesh, np.array([[0.05, 0.05, 0.01], [0.05, 0.02, 0.02]])).tolist() == [True, False]


def test_a_shape_is_chosen_by_the_name_of_a_solid_and_what_is_left_out_is_counted(tmp_path: Path) -> None:
    plates = [Named("BASE", box((0, 0, 0), (100, 100, 10))), Named("WEB", box((0, 46, 10), (100, 54, 60)))]
    path = write_step(tmp_path / "t.step", plates)

    part = read(path, "WEB")

    assert part.solids == ("WEB",)
    assert part.unused == ("solids beside WEB (1)",)
    assert part.remark == "solid WEB as a mesh of 12 triangles within 0.1 mm; not used: solids beside WEB (1)"
    assert read(path, "FRAME").solids == ("BASE", "WEB")


def test_a_shape_that_is_not_there_is_refused_with_those_that_are(tmp_path: Path) -> None:
    path = write_step(tmp_path / "t.step", [Named("BASE", box((0, 0, 0), (100, 100, 10)))])

    with pytest.raises(InputError, match=r"expected the name of a shape in t\.step, got 'BASIS'; it has FRAME, BASE"):
        read(path, "BASIS")


def test_a_file_without_solids_is_refused_with_what_it_has(tmp_path: Path) -> None:
    sheet = distinct(box((0, 0, 0), (10, 10, 10)), TopAbs_FACE)[0]
    path = write_step(tmp_path / "s.step", [Named("SHEET", sheet)])

    with pytest.raises(
        InputError, match=r"s\.step: expected at least one solid, got 1 faces; export the part as a solid"
    ):
        read(path)


Spoil = Callable[[str], str]
SPOILT: dict[str, tuple[Spoil, str]] = {
    "empty": (lambda text: "", r"1: expected a STEP file that begins with ISO-10303-21;, got other text"),
    "an image": (lambda text: "\x89PNG\r\n" * 9, r"1: expected a STEP file that begins with ISO-10303-21;"),
    "a mesh": (lambda text: "solid a\nendsolid a\n", r"1: expected a STEP file that begins with ISO-10303-21;"),
    "cut off in the data": (lambda text: text[: len(text) // 2], r"\d+: expected a statement that ends with ;, got "),
    "cut off at a line": (
        lambda text: text[: text.index("#50 =")],
        r"\d+: expected a statement that ends with ;, got ''",
    ),
    "without its end": (lambda text: text.replace("END-ISO-10303-21;", ""), r"\d+: expected a statement that ends"),
    "without its header": (
        lambda text: text.replace("HEADER;", "").replace("ENDSEC;", "", 1),
        r"3: expected HEADER;, got .FILE_DESCRIPTION",
    ),
    "without its schema": (
        lambda text: re.sub(r"FILE_SCHEMA\(.*?\);", "", text, flags=re.DOTALL),
        r"\d+: expected FILE_SCHEMA in the header, got FILE_DESCRIPTION, FILE_NAME",
    ),
    "without data": (lambda text: text.replace("DATA;", "", 1), r"\d+: expected DATA;, got .#1 = "),
    "without an entity": (
        lambda text: re.sub(r"#12 = .*\n", "", text),
        r"\d+: #\d+: expected entities that the file defines, got #12",
    ),
    "with an entity twice": (
        lambda text: re.sub(r"(#12 = .*\n)", r"\1\1", text),
        r"\d+: #12: expected each entity once, got it again after line \d+",
    ),
    "with a reference to nothing": (
        lambda text: re.sub(r"EDGE_LOOP\('',\(#\d+", "EDGE_LOOP('',(#99999", text, count=1),
        r"\d+: #\d+: expected entities that the file defines, got #99999",
    ),
    "with an edge that is a direction": (
        lambda text: re.sub(r"EDGE_LOOP\('',\(#\d+", "EDGE_LOOP('',(#13", text, count=1),
        r"\d+: #\d+: expected EDGE_LOOP to refer to ORIENTED_EDGE, got #13, DIRECTION",
    ),
    "with a face on a point": (
        lambda text: re.sub(r"(ADVANCED_FACE\('',\(#\d+\)),#\d+", r"\1,#12", text, count=1),
        r"\d+: #\d+: expected ADVANCED_FACE to refer to .*, got #12, CARTESIAN_POINT",
    ),
    "with a shell of points": (
        lambda text: re.sub(r"(CLOSED_SHELL\('',\()#\d+", r"\1#12", text, count=1),
        r"\d+: #\d+: expected CLOSED_SHELL to refer to ADVANCED_FACE, .*, got #12, CARTESIAN_POINT",
    ),
    "with a bracket too many": (
        lambda text: text.replace("(0.,0.,1.)", "(0.,0.,1.))", 1),
        r"\d+: #\d+: expected as many opening as closing brackets",
    ),
    "with a bracket too few": (
        lambda text: text.replace("(0.,0.,1.)", "(0.,0.,1.", 1),
        r"\d+: (#\d+: expected as many opening as closing brackets|expected an entity such as)",
    ),
    "with a comma in a number": (
        lambda text: text.replace("(0.,0.,1.)", "(0.,0.,1.5.2)", 1),
        r"\d+: #\d+: expected a number",
    ),
    "with a word for a number": (
        lambda text: text.replace("(0.,0.,1.)", "(0.,0.,nan)", 1),
        r"\d+: #\d+: expected no sign 'n' outside of texts",
    ),
    "with another byte": (
        lambda text: text.replace("(0.,0.,1.)", "(0.,\x00.,1.)", 1),
        r"\d+: #\d+: expected no sign '\\x00'",
    ),
    "without an equals sign": (
        lambda text: text.replace("#12 =", "#12  "),
        r"\d+: expected an entity such as #12 = KEYWORD",
    ),
    "with a text that does not end": (
        lambda text: text.replace("CARTESIAN_POINT('',", "CARTESIAN_POINT('", 1),
        r"\d+: expected",
    ),
    "without a unit": (
        lambda text: text.replace("LENGTH_UNIT()", "MASS_UNIT()"),
        r"1: expected a unit of length \(LENGTH_UNIT\), got none; export the file again with its unit",
    ),
    "in kilometres": (
        lambda text: text.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT(.KILO.,.METRE.)"),
        r" expected an extent of at most 20 m, got",
    ),
    "in micrometres": (
        lambda text: text.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT(.MICRO.,.METRE.)"),
        r" expected an extent of at least 1 mm, got",
    ),
    "with a vertex elsewhere": (
        lambda text: re.sub(
            r"(VERTEX_POINT\('',#(\d+)\);\s*#\2 = CARTESIAN_POINT\('',)\(.*?\)", r"\1(1.,4.,13.)", text, count=1
        ),
        r" expected faces that meet within 0\.1 mm, but those of PLATE miss each other by \S+ mm: repair it",
    ),
}


@pytest.mark.parametrize("spoilt", SPOILT)
def test_a_spoilt_file_is_refused_by_one_line_with_its_place(tmp_path: Path, spoilt: str) -> None:
    sound = write_step(tmp_path / "sound.step", [Named("PLATE", box((0, 0, 0), (30, 20, 10)))]).read_text()
    spoil, words = SPOILT[spoilt]
    path = tmp_path / "spoilt.step"
    path.write_text(spoil(sound), encoding="latin-1")
    assert path.read_text(encoding="latin-1") != sound

    with pytest.raises(InputError) as refusal:
        read(path)

    assert re.match(rf"spoilt\.step:{words}", str(refusal.value)), str(refusal.value)
    assert "\n" not in str(refusal.value)
