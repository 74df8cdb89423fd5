"""Repairs of small cells: least changes with known answers, verified by solving what is written."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cellplan import load_cell, solve
from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.repair.repair import Repair, repair
from cellplan.jobs.repair.result import write_repair
from cellplan.runs.overrides import with_overrides
from cellplan.search.programs.objective import Objective

pytestmark = pytest.mark.usefixtures("stored_solutions")
CLEARANCE = 200.0  # [mm] that the given cell misses by 59 mm


def request_of(cell: Path, **changes: object) -> LayoutRequest:
    return replace(LayoutRequest(cell=cell, objective=Objective.CHANGE), **changes)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def too_near(sound: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Repair, Path]:
    """The small cell, with more clearance demanded than it has, repaired; and the folder of the repair."""
    request = request_of(sound / "cell" / "small.yaml", clearance=CLEARANCE)
    repaired = repair(request)
    folder = tmp_path_factory.mktemp("repair") / "found"
    write_repair(repaired, request, folder)
    return repaired, folder


@pytest.mark.slow
def test_the_least_change_is_straight_down_by_what_is_missed(too_near: tuple[Repair, Path]) -> None:
    record = too_near[0].record
    assert record["status"] == "repaired"
    first = record["remedies"][0]
    changed = {key: value for key, value in first["settings"].items() if "base" in key}
    assert list(changed) == ["robots.right.base.z_mm"]  # the arms are planar: only the height parts them for good
    assert first["robots"] == ["right"]
    down = 480.0 - changed["robots.right.base.z_mm"]
    assert first["cost"] == pytest.approx(down / 100.0)
    assert first["text"] == f"move right {down:.4g} mm down"
    (failed,) = record["failed"]
    (effect,) = first["effects"]
    assert (effect["before"], effect["check"]) == (failed["value"], "clearance")
    assert CLEARANCE <= effect["after"] == first["smallest_clearance_mm"]
    assert effect["after"] < CLEARANCE + 5.0  # no more than the search asks for


def test_what_is_written_passes_when_it_is_solved(too_near: tuple[Repair, Path]) -> None:
    result, folder = too_near
    first = result.record["remedies"][0]
    solution = solve(load_cell(folder / "best.yaml"))
    assert solution.passed
    closest = [run.report.clearance.closest[0].distance for run in solution.runs]
    assert 1000.0 * min(closest) == pytest.approx(first["smallest_clearance_mm"], abs=1e-6)
    assert json.loads((folder / "advice.json").read_text()) == result.record


def test_the_options_make_the_same_cell(too_near: tuple[Repair, Path], sound: Path) -> None:
    result, _ = too_near
    assert result.best is not None
    pasted = with_overrides(load_cell(sound / "cell" / "small.yaml"), result.record["remedies"][0]["options"])
    for robot, other in zip(pasted.robots, result.best.robots, strict=True):
        assert np.array_equal(robot.X_WB, other.X_WB)
        assert robot.start is not None or other.start is None
        assert other.start is None or np.array_equal(robot.start, other.start)
    assert pasted.checks.clearance_mm.si == result.best.checks.clearance_mm.si


def test_every_attempt_is_a_remedy_or_has_a_reason(too_near: tuple[Repair, Path]) -> None:
    record = too_near[0].record
    assert all(entry["reason"] for entry in record["tried"])
    assert {entry["kind"] for entry in record["tried"]} == {"layout", "spin", "free_spin", "duration", "weights"}
    longer = next(entry for entry in record["tried"] if entry["kind"] == "duration")
    assert longer["reason"] == f"not tried, as a slower motion does not help: {record['failed'][0]['message']}"


def test_a_cell_that_passes_is_left_alone(sound: Path) -> None:
    repaired = repair(request_of(sound / "cell" / "small.yaml"))
    assert (repaired.record["status"], repaired.best) == ("passes", None)
    assert repaired.record["remedies"] == repaired.record["tried"] == []


@pytest.mark.slow
def test_a_cycle_too_short_is_made_as_long_as_the_accelerations_ask(sound: Path) -> None:
    settings = ("motion.step_s=0.001", "layout.vary={right.base: {yaw_deg: [179, 181]}}")
    repaired = repair(request_of(sound / "cell" / "small.yaml", duration=0.15, settings=settings))
    longer = next(remedy for remedy in repaired.record["remedies"] if remedy["kind"] == "duration")
    shares = [check["value"] / check["limit"] for check in repaired.record["failed"]]
    steps = np.ceil(0.15 * np.sqrt(max(shares)) / 0.001)  # an acceleration falls with the square of the time
    assert longer["settings"]["motion.duration_s"] == pytest.approx(0.001 * steps)
    assert longer["text"] == f"0.15 s -> {0.001 * steps:g} s"
    assert longer["cost"] == pytest.approx(10.0 * (0.001 * steps / 0.15 - 1.0), abs=1e-6)
