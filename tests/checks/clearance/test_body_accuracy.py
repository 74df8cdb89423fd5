"""How good bodies are: told beside each distance, and added to the demand where the cell asks for it."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import make_cell, placed, schedule, slide_model, thing

from cellplan.checks.clearance.check import check_clearance
from cellplan.geometry.shapes import Box, Sphere
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Cell
from cellplan.model.report.report import Check, ClearanceClass, ClearanceReport
from cellplan.model.settings.checks import ChecksEntry
from cellplan.model.settings.robot import BodyAccuracyEntry
from cellplan.report.record.sections.rests_on import unstated_bodies
from cellplan.report.text.notes import accuracy_note
from cellplan.scene.scene import Scene

GOOD = BodyAccuracyEntry(accuracy_mm=30.0, source="test")
EXACT = BodyAccuracyEntry(accuracy_mm=0.0, source="test")


def cell_of(gap: float, *, near: BodyAccuracyEntry | None, adds: bool, far_gap: float = 0.5) -> Cell:
    """A ball that slides past two posts, the nearer one of the surroundings; a second, exact ball passes closer by."""
    model = replace(slide_model(Sphere(0.1)), body_accuracy=near)
    exact = replace(slide_model(Sphere(0.1)), body_accuracy=EXACT)
    posts = (
        thing("post", Box((0.1, 0.1, 1.0)), pose((0.0, 0.15 + gap, 0.0))),
        thing("pole", Box((0.1, 0.1, 1.0)), pose((0.0, 3.15 + far_gap, 0.0))),
    )
    robots = (placed("a", model), placed("b", exact, base=pose((0.0, 3.0, 0.0))))
    return make_cell(
        *robots,
        things=posts,
        checks=ChecksEntry(body_accuracy="add" if adds else "report"),
    )


def judged(cell: Cell) -> tuple[ClearanceReport, Check]:
    q = np.repeat(np.linspace(-0.3, 0.3, 61)[:, None], 2, axis=1)
    report, checks = check_clearance(Scene.from_cell(cell), schedule(61), q)
    return report, next(check for check in checks if check.name == "clearance" and check.subject == "environment")


def test_a_stated_accuracy_is_reported_and_asks_for_no_more_distance() -> None:
    report, check = judged(cell_of(0.010, near=GOOD, adds=False))

    minimum = report.minima[ClearanceClass.ENVIRONMENT]
    assert (minimum.pair, minimum.accuracies) == (("a/block", "post"), (0.030, 0.0))
    assert check.passed
    assert check.limit == pytest.approx(5.0)


@pytest.mark.parametrize(("gap", "passed"), [(0.0345, False), (0.0355, True)])
def test_an_added_accuracy_raises_the_demand_of_the_pair(gap: float, passed: bool) -> None:
    _, check = judged(cell_of(gap, near=GOOD, adds=True))

    assert check.passed is passed
    assert check.limit == pytest.approx(35.0)
    assert check.message.endswith("required 35.0 mm (5.0 mm, and 30.0 mm for the accuracy of both bodies)")


def test_the_pair_that_keeps_least_of_its_own_demand_decides_and_not_the_nearest() -> None:
    report, check = judged(cell_of(0.01995, near=GOOD, adds=True, far_gap=0.008))

    assert report.minima[ClearanceClass.ENVIRONMENT].pair == ("b/block", "pole")
    assert not check.passed
    assert check.message.startswith("clearance environment: a/block to post 19.9 mm at ")


def test_exact_bodies_pass_with_the_demand_of_the_cell_though_the_accuracy_is_added() -> None:
    _, check = judged(cell_of(0.010, near=EXACT, adds=True, far_gap=0.006))

    assert check.passed
    assert check.limit == pytest.approx(5.0)


def test_bodies_without_stated_accuracy_are_named_in_one_line() -> None:
    assert unstated_bodies(cell_of(0.01, near=None, adds=False)) == ["accuracy of bodies of a not stated"]
    assert unstated_bodies(cell_of(0.01, near=GOOD, adds=False)) == []


@pytest.mark.parametrize(
    ("accuracies", "words"),
    [
        ((30.0, 30.0), "between bodies accurate to 30 mm"),
        ((30.0, 45.0), "between bodies accurate to 30 mm (a/arm) and 45 mm (b/arm)"),
        ((0.0, 45.0), "between bodies accurate to 45 mm (b/arm)"),
        ((0.0, 0.0), "between bodies assumed exact"),
        ((None, 45.0), "accuracy of a/arm not stated"),
        (None, ""),
    ],
)
def test_the_verdict_says_how_good_the_two_bodies_are(accuracies, words: str) -> None:
    assert accuracy_note(("a/arm", "b/arm"), accuracies) == words
