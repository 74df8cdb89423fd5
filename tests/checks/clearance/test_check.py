"""Clearance of a motion: contacts to the sample, minima to 0.1 mm, tools at work on the part, and plain verdicts."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import (
    body,
    fixed_part,
    floor,
    make_cell,
    placed,
    schedule,
    slide_model,
    thing,
    work,
)

from cellplan.checks.clearance.check import check_clearance
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Cylinder, Solid, Sphere
from cellplan.geometry.transforms import Array, pose
from cellplan.model.cell.cell import Cell, Robot, Tool
from cellplan.model.report.report import Check, ClearanceClass, ClearanceReport
from cellplan.scene.scene import Scene

EXACT = 1e-4  # [m] promised accuracy of a minimum


def checked(cell: Cell, q: Array, *tasks, duration: float = 1.0) -> tuple[ClearanceReport, tuple[Check, ...]]:
    return check_clearance(Scene.from_cell(cell), schedule(len(q), *tasks, duration=duration), q)


def drill(shape: Solid, *, back: float, tip: float) -> Robot:
    """A tool that slides along -z; its solid's middle is ``back`` above the tip, the tip at height ``tip``."""
    tool = Tool(
        X_FT=pose((0.0, 0.0, 0.0), (np.pi, 0.0, 0.0)), bodies=(body("tool", 0, shape=shape, at=(0.0, 0.0, back)),)
    )
    model = replace(slide_model(Sphere(0.01), axis=(0.0, 0.0, -1.0)), bodies=())
    return placed("drill", model, base=pose((0.0, 0.0, tip)), tool=tool)


def failed(checks: tuple[Check, ...], name: str) -> list[str]:
    return [check.message for check in checks if check.name == name and not check.passed]


def test_contacts_are_found_to_the_sample_and_named_with_their_time() -> None:
    sliders = (
        placed("a", slide_model(Box((0.1, 0.1, 0.1))), base=pose((-0.5, 0.0, 0.0))),
        placed("b", slide_model(Box((0.1, 0.1, 0.1)))),
    )
    x = np.linspace(0.0, 1.0, 1001)

    report, checks = checked(make_cell(*sliders), np.stack([x, 0.0 * x], axis=1))

    assert [(c.pair, c.is_allowed) for c in report.contacts] == [(("a/block", "b/block"), False)]
    assert report.contacts[0].first_s == pytest.approx(0.4, abs=1.1e-3)  # the sample of the first touch itself
    assert report.contacts[0].last_s == pytest.approx(0.6, abs=1.1e-3)
    minimum = report.minima[ClearanceClass.ROBOT_ROBOT]
    assert (minimum.minimum, minimum.pair, minimum.certified) == (0.0, ("a/block", "b/block"), True)
    assert minimum.at_s == report.contacts[0].first_s
    first, last = report.contacts[0].first_s, report.contacts[0].last_s
    assert failed(checks, "collision") == [f"collision: a/block touches b/block from {first:.3f} s to {last:.3f} s"]
    assert failed(checks, "clearance") == [
        f"clearance robot_robot: a/block to b/block 0.0 mm at {first:.3f} s, required 5.0 mm"
    ]
    free = [check.subject for check in checks if check.name == "collision" and check.passed]
    assert str(ClearanceClass.ROBOT_ROBOT) not in free  # the class in which they touch


def test_a_touch_at_a_single_sample_is_found() -> None:
    sliders = (
        placed("a", slide_model(Sphere(0.01)), base=pose((-1.0, 0.0, 0.0))),
        placed("b", slide_model(Sphere(0.01))),
    )
    q = np.zeros((1001, 2))
    q[617, 0] = 1.0

    report, checks = checked(make_cell(*sliders), q)

    assert [(c.first_s, c.last_s) for c in report.contacts] == [(0.617, 0.617)]
    assert failed(checks, "collision") == ["collision: a/block touches b/block at 0.617 s"]


def test_too_little_clearance_names_pair_instant_and_amount() -> None:
    slider = placed("kuka", slide_model(Box((0.1, 0.1, 0.1))))
    part = fixed_part(Box((0.1, 0.1, 0.1)), pose((0.5, 0.0, 0.0)))
    x = 0.39675 * np.sin(np.pi * np.linspace(0.0, 1.0, 1001))  # nearest at 0.5 s: 3.25 mm, printed as 3.2

    report, checks = checked(make_cell(slider, part=part), x[:, None])

    assert report.minima[ClearanceClass.PART].minimum == pytest.approx(0.00325, abs=EXACT)
    assert report.minima[ClearanceClass.PART].minimum <= 0.00325 + 1e-12  # rounding of the poses
    assert failed(checks, "collision") == []
    assert report.minima[ClearanceClass.PART].at_s == pytest.approx(0.5, abs=0.006)  # where it is 0.05 mm more
    assert failed(checks, "clearance")[0].startswith("clearance part: kuka/block to part 3.2 mm at ")
    assert failed(checks, "clearance")[0].endswith(" s, required 5.0 mm")
    assert report.minima[ClearanceClass.SELF].minimum is None


def test_enough_clearance_passes_every_check() -> None:
    slider = placed("kuka", slide_model(Box((0.1, 0.1, 0.1))))
    part = fixed_part(Box((0.1, 0.1, 0.1)), pose((0.5, 0.0, 0.0)))

    report, checks = checked(make_cell(slider, part=part), np.linspace(0.0, 0.39, 50)[:, None])

    assert all(check.passed for check in checks)
    assert {(check.name, check.subject) for check in checks} == {("collision", "part"), ("clearance", "part")}
    assert report.contacts == ()


def test_curves_hold_both_ends_and_the_minimum_and_are_kept_all_around_their_instants() -> None:
    slider = placed("kuka", slide_model(Box((0.1, 0.1, 0.1))))
    part = fixed_part(Box((0.1, 0.1, 0.1)), pose((0.5, 0.0, 0.0)))
    x = 0.3968 * np.sin(np.pi * np.linspace(0.0, 1.0, 1001))

    report, _ = checked(make_cell(slider, part=part), x[:, None])
    curve, truth = report.curves[ClearanceClass.PART], 0.4 - x
    at = np.round(report.curve_times * 1000).astype(int)
    lowest = np.array([truth[max(0, k - 5) : k + 6].min() for k in at])

    assert {0, 1000} <= set(at)
    assert report.minima[ClearanceClass.PART].at_s in report.curve_times
    assert np.all(curve <= truth[at] + 1e-12)  # rounding
    assert np.all(curve >= 0.95 * lowest - 0.0011 - 5 * 0.00125)  # promised room, and the way within a stretch
    assert curve.min() == pytest.approx(truth.min(), abs=EXACT)
    assert set(report.curves) == {ClearanceClass.PART}


@pytest.mark.parametrize("depth", [0.0, 0.005, 0.015])
def test_a_tool_at_work_may_touch_the_part_at_its_tip(depth: float) -> None:
    cell = make_cell(
        drill(Cylinder(0.01, 0.1), back=0.05, tip=-depth), part=fixed_part(Box((0.3, 0.3, 0.2)), pose((0.0, 0.0, -0.1)))
    )
    task = work("drill")

    report, checks = checked(replace(cell, tasks=(task,)), np.zeros((11, 1)), task)

    assert all(check.passed for check in checks)
    assert [(c.pair, c.is_allowed, c.first_s, c.last_s) for c in report.contacts] == [
        (("drill/tool", "part"), True, 0.0, 1.0)
    ]
    assert report.contacts[0].reason == "at work, within 20 mm of the tool tip"
    assert ("drill/tool", "part") in {(first, second) for first, second, _ in report.exclusions}


@pytest.mark.parametrize(
    ("shape", "depth"), [(Cylinder(0.01, 0.1), 0.03), (Cylinder(0.03, 0.1), 0.001), (Box((0.01, 0.01, 0.1)), 0.05)]
)
def test_a_tool_that_touches_outside_its_contact_zone_collides(shape: Solid, depth: float) -> None:
    for solid in (Box((0.3, 0.3, 0.2)), tessellate(Box((0.3, 0.3, 0.2)))):
        cell = make_cell(drill(shape, back=0.05, tip=-depth), part=fixed_part(solid, pose((0.0, 0.0, -0.1))))
        task = work("drill")

        _, checks = checked(replace(cell, tasks=(task,)), np.zeros((11, 1)), task)

        assert failed(checks, "collision") == [
            "collision: drill/tool touches part outside the contact zone of the tool at work from 0.000 s to 1.000 s"
        ]


def test_without_a_task_the_same_touch_is_a_collision() -> None:
    cell = make_cell(
        drill(Cylinder(0.01, 0.1), back=0.05, tip=-0.005), part=fixed_part(Box((0.3, 0.3, 0.2)), pose((0.0, 0.0, -0.1)))
    )

    _, checks = checked(cell, np.zeros((11, 1)))

    assert failed(checks, "collision") == ["collision: drill/tool touches part from 0.000 s to 1.000 s"]


@pytest.mark.parametrize(("tip", "touches"), [(-0.05, True), (-0.005, True), (0.004, False)])
def test_a_robot_whose_task_is_not_worked_on_is_judged_like_everybody_else(tip: float, *, touches: bool) -> None:
    """Not even within its contact zone may its tool touch the part, and it keeps the demanded clearance."""
    cell = make_cell(
        drill(Cylinder(0.01, 0.1), back=0.05, tip=tip), part=fixed_part(Box((0.3, 0.3, 0.2)), pose((0.0, 0.0, -0.1)))
    )

    report, checks = checked(replace(cell, tasks=(work("drill"),)), np.zeros((11, 1)))

    collision = ["collision: drill/tool touches part from 0.000 s to 1.000 s"] if touches else []
    assert failed(checks, "collision") == collision
    assert len(failed(checks, "clearance")) == 1
    assert [contact.is_allowed for contact in report.contacts] == [False] * touches
    assert report.pair_count == 1


def test_a_part_sunk_into_the_floor_is_a_collision() -> None:
    slider = placed("lift", slide_model(Box((0.1, 0.1, 0.1)), axis=(0.0, 0.0, 1.0)), base=pose((0.0, 0.0, 0.5)))
    z = np.linspace(0.0, -0.6, 61)

    report, checks = checked(make_cell(slider, things=(floor(),)), z[:, None])

    assert failed(checks, "collision")[0].startswith("collision: lift/block touches floor from 0.7")
    assert report.minima[ClearanceClass.ENVIRONMENT].minimum == 0.0


def test_height_above_the_floor_is_the_minimum_of_its_class() -> None:
    slider = placed("lift", slide_model(Sphere(0.1), axis=(0.0, 0.0, 1.0)), base=pose((0.0, 0.0, 0.5)))
    post = thing("post", Cylinder(0.05, 1.0), pose((3.0, 0.0, 0.5)))

    report, _ = checked(make_cell(slider, things=(floor(), post)), np.linspace(0.0, -0.375, 40)[:, None])
    minimum = report.minima[ClearanceClass.ENVIRONMENT]

    assert minimum.pair == ("lift/block", "floor")
    assert minimum.minimum == pytest.approx(0.025, abs=1e-12)  # arithmetic only
    assert minimum.at_s == 1.0


def test_a_body_inside_a_closed_mesh_from_the_start_is_a_collision() -> None:
    tank = thing("tank", tessellate(Box((2.0, 2.0, 2.0))))
    slider = placed("a", slide_model(Box((0.1, 0.1, 0.1))))

    report, checks = checked(make_cell(slider, things=(tank,)), np.linspace(0.0, 0.1, 30)[:, None])

    assert failed(checks, "collision") == ["collision: a/block touches tank from 0.000 s to 1.000 s"]
    assert report.minima[ClearanceClass.ENVIRONMENT].minimum == 0.0


def test_a_contact_between_two_samples_is_found_with_its_instant() -> None:
    sliders = (
        placed("a", slide_model(Sphere(0.01)), base=pose((-1.0, 0.0, 0.0))),
        placed("b", slide_model(Sphere(0.01))),
    )
    q = np.zeros((11, 2))
    q[:, 0] = np.linspace(0.0, 2.1, 11)  # 0.21 m a step: past b between 0.4 s and 0.5 s

    report, checks = checked(make_cell(*sliders), q)

    assert [contact.pair for contact in report.contacts] == [("a/block", "b/block")]
    contact = report.contacts[0]
    assert 1.0 - 0.02 <= 2.1 * contact.first_s <= 2.1 * contact.last_s <= 1.0 + 0.02  # they touch within 20 mm
    assert failed(checks, "collision")[0].startswith("collision: a/block touches b/block ")
    assert report.minima[ClearanceClass.ROBOT_ROBOT].minimum == 0.0


def test_bodies_too_near_for_a_proof_are_not_certified_and_fail() -> None:
    """Two balls that pass each other at a millionth of a millimetre: no contact, and no proof that there is none."""
    sliders = (
        placed("a", slide_model(Sphere(0.01)), base=pose((-0.1, 0.0, 0.0))),
        placed("b", slide_model(Sphere(0.01)), base=pose((0.0, 0.02 + 1e-9, 0.0))),
    )
    q = np.zeros((101, 2))
    q[:, 0] = np.linspace(0.0, 0.2, 101)

    report, checks = checked(make_cell(*sliders), q)

    assert report.not_certified == (("a/block", "b/block"),)
    assert report.minima[ClearanceClass.ROBOT_ROBOT].certified is False
    assert report.minima[ClearanceClass.ROBOT_ROBOT].minimum == 0.0
    assert failed(checks, "collision") == []
    (message,) = failed(checks, "clearance")
    assert message.startswith("not certified: a/block to b/block at 0.5")
    assert "no contact was found, but none could be ruled out" in message
