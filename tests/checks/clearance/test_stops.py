"""One robot stops and the others go on: figures of motions whose worst stop is known by hand."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.scene_builders import body, fixed_part, held_part, make_cell, placed, slide_model, work

from cellplan import load_cell, solve
from cellplan.certify.free_clocks.free_boxes import Boxes
from cellplan.certify.free_clocks.free_clocks import MINIMUM_TOL
from cellplan.checks.clearance.stops import BAND_PARTS, check_stops, one_stop, stop_report
from cellplan.geometry.shapes import Box, Cylinder, Sphere
from cellplan.geometry.transforms import Array, pose
from cellplan.model.cell.cell import Cell, Robot, Tool
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.settings.checks import ChecksEntry, StopEntry
from cellplan.model.settings.controllers import ControllerEntry, RobotControlEntry
from cellplan.scene.scene import Scene

SPEED = 0.8  # [m/s] of both robots
EXACT = 2e-4  # [m] a reading is no farther below the truth
PEN = Tool(
    X_FT=pose((0.0, 0.0, 0.1), (0.0, 0.0, 0.0)), bodies=(body("tool", 0, shape=Cylinder(0.003, 0.1), at=(0, 0, 0.05)),)
)


def controlled(robot: Robot, controller: str) -> Robot:
    return replace(robot, control=RobotControlEntry(id=controller))


def controllers(**seconds: tuple[float, float]) -> dict[str, ControllerEntry]:
    """Controllers by name, with the times in [s] in which they react and brake."""
    return {
        name: ControllerEntry(kind="other", reaction_ms=1e3 * reaction, brake_s=brake)
        for name, (reaction, brake) in seconds.items()
    }


def convoy(stop: StopEntry | None = None) -> tuple[Cell, Schedule, dict[str, Array]]:
    """Two balls of 0.1 m that slide along one line at the same speed, the second one 0.5 m ahead."""
    ball = slide_model(Sphere(0.1))
    cell = make_cell(
        controlled(placed("rear", ball), "r"),
        controlled(placed("front", ball, base=pose((0.5, 0.0, 0.0))), "f"),
        checks=ChecksEntry(clearance_mm=10.0, contact_zone_mm=0.0, stop=stop),
    )
    cell = replace(cell, controllers=controllers(r=(0.1, 0.3), f=(0.05, 0.1)))
    times = np.linspace(0.0, 2.0, 41)
    return cell, Schedule(times=times, tasks=()), {"rear": SPEED * times[:, None], "front": SPEED * times[:, None]}


def test_a_robot_runs_up_on_the_one_ahead_by_its_reaction_and_half_of_its_braking() -> None:
    cell, schedule, q = convoy()

    report = stop_report(Scene.from_cell(cell), schedule, q)

    assert report is not None
    assert report.runs_on == pytest.approx({"rear": 0.25, "front": 0.1})
    (pair,) = report.distances
    truth = 0.3 - SPEED * 0.25  # 0.3 m between the balls while both move
    too_far = SPEED * 0.35 / BAND_PARTS
    assert truth - too_far - MINIMUM_TOL - EXACT <= pair.proved <= pair.distance <= truth + EXACT
    assert pair.worst is not None
    assert (pair.worst.stopped, pair.worst.going) == ("front", "rear")
    assert pair.worst.path_s - pair.worst.at_s == pytest.approx(0.25, abs=0.35 / BAND_PARTS + 1e-9)


@pytest.mark.parametrize(("robot", "truth"), [("front", 0.3 - SPEED * 0.25), ("rear", 0.3)])
def test_a_single_stop_is_followed_exactly(robot: str, truth: float) -> None:
    cell, schedule, q = convoy()

    stop = one_stop(Scene.from_cell(cell), schedule, q, robot=robot, at=0.7)

    assert stop is not None
    (pair,) = stop.distances
    assert truth - MINIMUM_TOL - EXACT <= pair.proved <= pair.distance <= truth + MINIMUM_TOL
    assert pair.worst is not None
    assert pair.worst.stopped in {robot, "front"}
    assert pair.worst.at_s == pytest.approx(0.7)


def test_stops_count_to_the_end_of_the_program_only() -> None:
    cell, schedule, q = convoy()

    stop = one_stop(Scene.from_cell(cell), schedule, q, robot="front", at=1.9)

    assert stop is not None
    assert stop.distances[0].distance == pytest.approx(0.3 - SPEED * 0.1, abs=MINIMUM_TOL + EXACT)


@pytest.mark.parametrize(("demand", "passed"), [(0.08, True), (0.12, False)])
def test_a_demanded_clearance_is_a_check(demand: float, passed: bool) -> None:
    cell, schedule, q = convoy(StopEntry(clearance_mm=1e3 * demand))

    (check,) = check_stops(cell, stop_report(Scene.from_cell(cell), schedule, q))

    assert check.passed is passed
    assert check.name == "stop_clearance"
    assert "'front' stops at" in check.message


def pressed(stop: StopEntry | None = None) -> tuple[Cell, Schedule, dict[str, Array]]:
    """A block that slides up at 0.1 m/s and a pen above it that goes up with it; its tip is on the block."""
    up = replace(slide_model(Sphere(0.01), axis=(0.0, 0.0, 1.0)), bodies=())
    down = replace(slide_model(Sphere(0.01), axis=(0.0, 0.0, -1.0)), bodies=())
    task = work("pen")
    cell = make_cell(
        controlled(placed("table", up), "t"),
        controlled(placed("pen", down, base=pose((0.0, 0.0, 0.2), (np.pi, 0.0, 0.0)), tool=PEN), "p"),
        part=held_part(Box((0.2, 0.2, 0.2)), "table", np.eye(4)),
        tasks=(task,),
        checks=ChecksEntry(clearance_mm=0.0, stop=stop),
    )
    cell = replace(cell, controllers=controllers(t=(0.2, 0.4), p=(0.1, 0.0)))
    times = np.linspace(0.0, 2.0, 21)
    scheduled = TaskSchedule(
        task=task,
        X_PT=np.broadcast_to(np.eye(4), (len(times), 4, 4)),
        V_PT_P=np.zeros((len(times), 6)),
        travelled=np.zeros(len(times)),
        length=1.0,
        end=2.0,
    )
    height = 0.1 * times[:, None]
    return cell, Schedule(times=times, tasks=(scheduled,)), {"table": height, "pen": height}


def test_a_part_that_goes_on_runs_onto_the_stopped_tool() -> None:
    cell, schedule, q = pressed(StopEntry(depth_mm=30.0))

    report = stop_report(Scene.from_cell(cell), schedule, q)

    assert report is not None
    (depth,) = report.depths
    assert depth.depth == pytest.approx(0.1 * 0.4, abs=1e-5)  # the table goes on for 0.2 s and half of 0.4 s
    assert depth.worst is not None
    assert (depth.worst.stopped, depth.worst.going) == ("pen", "table")
    assert depth.worst.path_s - depth.worst.at_s == pytest.approx(0.4, abs=1e-6)
    (check,) = check_stops(cell, report)
    assert not check.passed
    assert check.value == pytest.approx(40.0, abs=0.01)


def test_a_tool_that_goes_on_leaves_the_stopped_part() -> None:
    cell, schedule, q = pressed()

    stop = one_stop(Scene.from_cell(cell), schedule, q, robot="table", at=1.0)

    assert stop is not None
    assert stop.depths[0].depth == pytest.approx(0.0, abs=1e-9)


def test_a_part_that_nobody_carries_is_run_onto_by_no_stop() -> None:
    cell, schedule, q = pressed()
    cell = replace(cell, robots=cell.robots[1:], part=fixed_part(cell.part.shape, np.eye(4)))

    report = stop_report(Scene.from_cell(cell), schedule, {"pen": q["pen"]})

    assert report is not None
    assert report.depths == ()
    assert report.distances == ()


def test_nothing_is_said_where_no_controller_states_how_its_robots_go_on() -> None:
    cell, schedule, q = convoy(StopEntry(clearance_mm=10.0))
    silent = replace(
        cell,
        controllers={
            name: controller.changed(reaction_ms=None, brake_s=None) for name, controller in cell.controllers.items()
        },
    )

    assert stop_report(Scene.from_cell(silent), schedule, q) is None
    (check,) = check_stops(silent, None)
    assert not check.passed
    assert "state neither reaction_ms nor brake_s; demanded: at least 10 mm" in check.message


@pytest.mark.parametrize("still", ["rear", "front"])
def test_two_robots_of_which_one_stands_still_are_as_near_as_without_a_stop(still: str) -> None:
    cell, schedule, q = convoy()
    q[still] = np.zeros_like(q[still])
    q["front" if still == "rear" else "rear"] = 0.1 * schedule.times[:, None]
    truth = 0.3 if still == "rear" else 0.1  # the other one moves by 0.2 m, away or nearer

    report = stop_report(Scene.from_cell(cell), schedule, q)

    assert report is not None
    (pair,) = report.distances
    assert truth - MINIMUM_TOL - EXACT <= pair.proved <= pair.distance <= truth + MINIMUM_TOL + EXACT
    assert pair.worst is not None
    assert pair.worst.at_s == pair.worst.path_s


def test_two_robots_that_stand_still_are_measured_where_they_stand() -> None:
    cell, schedule, q = convoy()

    report = stop_report(Scene.from_cell(cell), schedule, {name: np.zeros_like(rows) for name, rows in q.items()})

    assert report is not None
    assert report.distances[0].distance == pytest.approx(0.3, abs=EXACT)


def test_a_tool_on_a_part_at_rest_is_as_deep_as_without_a_stop() -> None:
    cell, schedule, q = pressed()
    inwards = {"table": np.zeros_like(q["table"]), "pen": -0.015 * schedule.times[:, None]}

    report = stop_report(Scene.from_cell(cell), schedule, inwards)

    assert report is not None
    assert report.depths[0].depth == pytest.approx(0.03, abs=1e-5)


@pytest.mark.slow
def test_the_search_of_a_level_distance_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """The tools pass over a turning table at one height: many boxes differ from the level by rounding only."""
    path = Path(__file__).parents[3] / "cells" / "multimove.yaml"
    values = {"controllers.irc5.reaction_ms": 100, "controllers.irc5.brake_s": 0.4}
    most, joined = [0], Boxes.joined

    def counted(*parts: Boxes) -> Boxes:
        most[0] = max(most[0], sum(len(part) for part in parts))
        return joined(*parts)

    monkeypatch.setattr(Boxes, "joined", staticmethod(counted))
    stops = solve(load_cell(path).with_values(values)).runs[0].report.stops

    assert stops is not None
    assert most[0] < 20_000
    nearest = min(pair.distance for pair in stops.distances)
    for pair in stops.distances:
        assert pair.proved >= nearest - MINIMUM_TOL - 1e-8
