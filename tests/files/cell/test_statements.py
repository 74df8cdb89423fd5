"""What a robot's file or a cell states of bodies and payloads: where it is read, which goes first, what is refused."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cellplan.errors import InvalidFileError
from cellplan.files.robots.joint_table import read_robot_table
from cellplan.model.cell.cell import Cell
from cellplan.model.settings.robot import AxisLimitEntry, BodyAccuracyEntry, PayloadEntry

WEIGHTS = "    weights: [1, 1, 1, 1, 1, 1]"
TABLE = """\
robot: one
joints:
  a: {type: revolute, axis: [0, 0, 1], point_mm: [0, 0, 0], lower_deg: -90, upper_deg: 90, velocity_deg_s: 90}
flange: {xyz_mm: [500, 0, 0]}
"""
SOLID = "{link: a, capsule: {from_mm: [0, 0, 0], to_mm: [400, 0, 0], radius_mm: 40}}"


def table(tmp_path: Path, more: str) -> Path:
    path = tmp_path / "one.yaml"
    path.write_text(TABLE + more, encoding="utf-8")
    return path


def test_bodies_are_a_list_or_a_mapping_that_says_how_good_they_are(tmp_path: Path) -> None:
    plain = read_robot_table(table(tmp_path, f"bodies: [{SOLID}]\n"))
    stated = read_robot_table(table(tmp_path, f"bodies: {{accuracy_mm: 3, source: scan, solids: [{SOLID}]}}\n"))

    assert (len(plain.bodies), plain.body_accuracy) == (1, None)
    assert (len(stated.bodies), stated.body_accuracy) == (1, BodyAccuracyEntry(accuracy_mm=3.0, source="scan"))


def test_a_solid_may_say_itself_how_good_it_is(tmp_path: Path) -> None:
    better = SOLID.replace("{link: a,", "{link: a, accuracy_mm: 1,")

    model = read_robot_table(table(tmp_path, f"bodies: {{accuracy_mm: 3, solids: [{SOLID}, {better}]}}\n"))

    assert [model.accuracy_of(body) for body in model.bodies] == [0.003, 0.001]


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (
            "bodies: {accuracy_mm: 3, solids: [{link: b, sphere: {radius_mm: 9, center_mm: [0, 0, 0]}}]}\n",
            "5: bodies.solids[0].link: expected a link (base, a), got 'b'",
        ),
        (
            "bodies: {accuracy_mm: -3}\n",
            "5: bodies.accuracy_mm: expected a number of millimetres of at least 0, got -3",
        ),
        (
            "bodies: good\n",
            "5: bodies: expected a list of solids or a mapping (accuracy_mm, source, solids), got 'good'",
        ),
        (
            "payload: {mass_kg: 6, axes: {b: {moment_nm: 9}}}\n",
            "5: payload.axes.b: expected one of the last turning joints (a), got 'b'",
        ),
        ("payload: {source: sheet}\n", "5: payload.mass_kg: missing, expected largest mass of tool and part"),
    ],
)
def test_a_mistake_in_a_robot_file_is_named_with_its_place(tmp_path: Path, more: str, message: str) -> None:
    path = table(tmp_path, more)

    with pytest.raises(InvalidFileError) as caught:
        read_robot_table(path)

    assert str(caught.value) == f"{path}:{message}"


def test_the_cell_goes_before_the_file_of_the_robot(load: Callable[..., Cell]) -> None:
    stated = (
        "    bodies: {accuracy_mm: 2}\n"
        "    payload: {mass_kg: 8, along_mm: 100, across_mm: 50, axes: {F3: {moment_nm: 6, inertia_kg_m2: 0.1}}, "
        "source: sheet}"
    )

    cell = load((WEIGHTS, stated))

    model = cell.robot("worker").model
    assert model.body_accuracy == BodyAccuracyEntry(accuracy_mm=2.0, source="stated in the cell")
    assert {model.accuracy_of(body) for body in model.bodies} == {0.002}
    assert model.payload == PayloadEntry(
        mass_kg=8.0,
        along_mm=100.0,
        across_mm=50.0,
        axes={"F3": AxisLimitEntry(moment_nm=6.0, inertia_kg_m2=0.1)},
        source="sheet",
    )
    merged = cell.robot("holder").model
    assert merged.body_accuracy is not None
    assert merged.payload is not None


def test_masses_that_are_not_stated_are_none_and_not_zero(load: Callable[..., Cell]) -> None:
    bare = load()
    stated = load(
        ("tool: {xyz_mm: [0, 0, 100]}", "tool: {xyz_mm: [0, 0, 100], mass_kg: 0, centre_mm: [0, 0, 40]}"),
        ("part:\n", "part:\n  mass_kg: 3\n  centre_mm: [1, 2, 3]\n"),
    )

    assert (bare.robot("worker").tool.mass, bare.part.mass) == (None, None)
    assert (stated.robot("worker").tool.mass, stated.part.mass) == (0.0, 3.0)
    np.testing.assert_allclose(stated.robot("worker").tool.centre, (0.0, 0.0, 0.04))
    np.testing.assert_allclose(stated.part.centre, (0.001, 0.002, 0.003))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "tool: {xyz_mm: [0, 0, 100]}",
            "tool: {centre_mm: [0, 0, 40]}",
            "c:10: robots.worker.tool.centre_mm: unexpected key, a centre of mass requires mass_kg",
        ),
        (
            "part:\n",
            "part:\n  centre_mm: [1, 2, 3]\n",
            "c:13: part.centre_mm: unexpected key, a centre of mass requires mass_kg",
        ),
        (
            WEIGHTS,
            "    payload: {mass_kg: 8, axes: {A3: {moment_nm: 6}}}",
            "c:11: robots.worker.payload.axes.A3: expected one of the last turning joints (D3, E3, F3), got 'A3'",
        ),
    ],
)
def test_a_mistake_in_a_cell_is_named_with_its_place(
    refuse: Callable[..., list[str]], old: str, new: str, message: str
) -> None:
    assert refuse((old, new)) == [message]


def test_an_unstated_accuracy_cannot_be_added(load: Callable[..., Cell], tmp_path: Path) -> None:
    table(tmp_path, f"bodies: [{SOLID}]\n")
    adding = ("motion: {duration_s: 4}", "motion: {duration_s: 4}\nchecks: {body_accuracy: add}")
    edit, no_weights = ("model: abb_irb1600", "model: one.yaml"), (f"{WEIGHTS}\n", "")

    with pytest.raises(InvalidFileError) as caught:
        load(adding, edit, no_weights)

    assert str(caught.value) == (
        "c:21: checks.body_accuracy: expected stated accuracies of all link bodies to add, got none for worker: state "
        "robots.worker.bodies: {accuracy_mm: …, source: …}"
    )
    assert load(adding).checks.adds_accuracy
