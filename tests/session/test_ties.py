"""Ties of a live cell: what is moved takes with it what the layout ties to it, as a layout search has it."""

from pathlib import Path

import numpy as np
import pytest

from cellplan import edit, load_cell
from cellplan.errors import InputError
from cellplan.search.variables.variables import Variables
from cellplan.session.variables import LiveVariables

CELLS = Path(__file__).resolve().parents[2] / "cells"
HOLDERS = CELLS / "layout" / "load_sharing.yaml"
TIED = (
    "layout={vary: {kuka.base: {x_mm: [900, 1500], z_mm: [300, 500]}, staubli.base: {z_mm: [300, 500]}}, "
    "equal: [[kuka.base.z_mm, staubli.base.z_mm]]}",
    "robots.kuka.base.xyz_mm=[1100, 1250, 400]",
    "robots.staubli.base.xyz_mm=[1450, -525, 400]",
)


@pytest.fixture(scope="module")
def variables() -> LiveVariables:
    return LiveVariables.of(load_cell(HOLDERS))


@pytest.mark.parametrize("robot", ["left", "right"])
def test_the_mirrored_base_follows_as_the_variables_of_a_search_have_it(variables: LiveVariables, robot: str) -> None:
    given = {"x_mm": 120.0, "y_mm": -950.0 if robot == "left" else 950.0, "yaw_deg": 25.0}
    values = variables.accepted({f"robots.{robot}.base.{key}": value for key, value in given.items()})
    cell = load_cell(HOLDERS)
    searched = Variables.of(cell)
    x = searched.read_from(cell.with_values(values))

    assert len(values) == 6
    written = searched.numbers(x)
    assert values == pytest.approx({address: written[address] for address in values})


def test_what_follows_none_moves_alone_and_values_that_are_stated_stay(variables: LiveVariables) -> None:
    assert variables.accepted({"robots.abb.base.x_mm": 1900.0}) == {"robots.abb.base.x_mm": 1900.0}
    both = {"robots.left.base.y_mm": -900.0, "robots.right.base.y_mm": 1000.0}
    assert variables.accepted(both) == both


def test_no_range_is_wider_than_that_of_what_follows() -> None:
    layout = (
        "layout={vary: {left.base: {y_mm: [-1500, -700]}, right.base: {y_mm: [900, 1200]}}, "
        "mirrored: [{bases: [left.base, right.base], plane: xz}]}"
    )
    session = edit(CELLS / "planar_pair.yaml", settings=[layout, "robots.left.base.xyz_mm=[0, -1000, 500]"])
    ranges = [session._engine.given.variables.variable(f"robots.{it}.base.y_mm") for it in ("left", "right")]

    assert [(it.lower, it.upper) for it in ranges] == [(-1200.0, -900.0), (300.0, 1200.0)]  # it stands at 300
    with pytest.raises(InputError, match=r"robots.left.base.y_mm: expected a number from -1200 to -900 mm"):
        session.move("left", y_mm=-1300)


@pytest.mark.slow
def test_advice_says_what_comes_of_a_base_with_the_one_that_follows_it() -> None:
    with edit(CELLS / "four_robots_initial.yaml", settings=TIED) as session:
        answer = session.answer()
        while (more := session.settle()) is not None:
            answer = more
        robots = [it["name"] for it in session.open_record()["view"]["scenes"][0]["robots"]]
        arrows = {robots[it["robot"]]: it for it in answer["advice"]}
        margins = list[float]()
        arrow = arrows["kuka"]
        for step in (-1.0, 1.0):
            values = {
                f"{axis}_mm": answer["values"][f"robots.kuka.base.{axis}_mm"] + step * part
                for axis, part in zip("xyz", arrow["direction"], strict=True)
            }
            moved = session.move("kuka", **values)
            assert moved["values"]["robots.staubli.base.z_mm"] == pytest.approx(values["z_mm"])
            margins.append(next(it["value"] for it in moved["figures"] if it["name"] == "margin"))

    said = float(arrow["text"].split(": ")[1].split(" deg")[0]) / arrow["step_mm"]
    assert np.abs(arrow["direction"][2]) > 0.1  # it takes the other one along
    assert np.diff(margins)[0] / 2.0 == pytest.approx(said, rel=0.05)
