"""Maps of a base: verdicts beside plain solves, symmetry, messages, files."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cellplan import BaseGrid, base_map, load_cell, solve, write_base_map
from cellplan.cli.main import run
from cellplan.errors import InputError, NoSolutionError
from cellplan.jobs.base_map.prepared import prepared
from cellplan.model.cell.cell import Cell
from cellplan.search.base_map.verdicts import PlaceVerdict, Verdict, judge, verdicts_at_start

CELLS = Path(__file__).resolve().parents[2] / "cells"
CELL = CELLS / "planar_pair.yaml"
STARTS = {"robots.left.start_deg": [50, -85, 35], "motion.duration_s": 2.0, "motion.step_s": 0.02}
SOLVED = {**STARTS, "solver.integrator": "accurate", "tasks.circle.tolerance.position_mm": 0.5}
GRID = BaseGrid(x=(1000, 2600), y=(-600, 1000), step=200)


@pytest.fixture(scope="module")
def cell() -> Cell:
    return load_cell(CELL).with_values(SOLVED)


@pytest.fixture(scope="module")
def mapped(cell: Cell) -> Any:
    return base_map(cell, "right", GRID)


def passes(cell: Cell, place: Any) -> bool:
    """Whether a plain solve of a place passes every check."""
    values = {"robots.right.base.x_mm": place["x_mm"], "robots.right.base.y_mm": place["y_mm"]}
    try:
        solution = solve(cell.with_values({**values, "robots.right.start_deg": place["start"] or "auto"}))
    except (InputError, NoSolutionError):
        return False
    return all(run.report.passed for run in solution.runs)


@pytest.mark.slow
def test_ten_random_places_pass_or_fail_as_plain_solves_do(cell: Cell, mapped: Any) -> None:
    chosen = np.random.default_rng(5).choice(len(mapped["places"]), 10, replace=False).tolist()
    places = [mapped["places"][place] for place in chosen]

    verdicts = [place["verdict"] == "passes" for place in places]

    assert verdicts == [passes(cell, place) for place in places]
    assert 2 <= sum(verdicts) <= 8  # both kinds are among them


@pytest.mark.parametrize("verdict", ["passes", "limit"])
def test_a_place_passes_or_fails_as_a_plain_solve_does(cell: Cell, mapped: Any, verdict: str) -> None:
    place = [place for place in mapped["places"] if place["verdict"] == verdict][3]

    assert passes(cell, place) == (verdict == "passes")


def test_a_map_moves_with_its_cell(cell: Cell, mapped: Any) -> None:
    by = {"robots.left.base.x_mm": 400, "robots.left.base.y_mm": -200}
    moved = cell.with_values({**by, "robots.right.base.x_mm": 2300, "robots.right.base.y_mm": 100})

    other = base_map(moved, "right", BaseGrid(x=(1400, 3000), y=(-800, 800), step=200))

    assert [place["verdict"] for place in other["places"]] == [place["verdict"] for place in mapped["places"]]
    cycles = [[p["figures"]["cycle_s"] for p in entry["places"] if p["figures"]] for entry in (mapped, other)]
    np.testing.assert_allclose(*cycles, rtol=1e-4)


def test_every_place_has_a_verdict_and_what_fails_has_a_reason(mapped: Any) -> None:
    assert sum(mapped["counts"].values()) == len(mapped["places"]) == 81
    assert all((place["reason"] == "") == (place["verdict"] == "passes") for place in mapped["places"])
    best = [mapped["places"][entry["place"]]["figures"]["cycle_s"] for entry in mapped["best"]]
    assert best == sorted(best)
    assert best[0] == min(place["figures"]["cycle_s"] for place in mapped["places"] if place["verdict"] == "passes")


def test_equal_maps_have_equal_bytes(cell: Cell, mapped: Any, tmp_path: Path) -> None:
    write_base_map(mapped, tmp_path / "one")
    write_base_map(base_map(cell, "right", GRID), tmp_path / "other")

    files = [{file.name: file.read_bytes() for file in (tmp_path / name).iterdir()} for name in ("one", "other")]
    assert files[0] == files[1]
    assert set(files[0]) == {"map.json", "map.html", "map.svg"}
    assert json.loads(files[0]["map.json"]) == json.loads(json.dumps(mapped))


def test_the_picture_is_written_in_requested_formats_too(mapped: Any, tmp_path: Path) -> None:
    write_base_map(mapped, tmp_path / "map", formats=["png"])
    write_base_map(mapped, tmp_path / "map", formats=["pdf"])  # an earlier map is replaced

    assert {file.name for file in (tmp_path / "map").iterdir()} == {"map.json", "map.html", "map.svg", "map.pdf"}
    assert (tmp_path / "map" / "map.pdf").read_bytes().startswith(b"%PDF")


def test_the_base_is_turned_to_the_part_on_request(cell: Cell) -> None:
    grid = BaseGrid(x=(1900, 1900), y=(0, 300), step=300, yaw="toward")

    angles = [place["yaw_deg"] for place in base_map(cell, "right", grid)["places"]]

    assert angles[0] != angles[1]
    assert all(90.0 < abs(angle) <= 180.0 for angle in angles)  # the part is on the side of smaller x


def test_the_best_place_is_certified_by_a_solve(cell: Cell) -> None:
    few = base_map(cell, "right", BaseGrid(x=(1900, 1900), y=(300, 300)), certify=1)

    assert few["best"][0]["certified"]["status"] == "passed"
    assert few["best"][0]["options"][:2] == ["robots.right.base.x_mm=1900", "robots.right.base.y_mm=300"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--robot", "left"], "--robot: expected a robot with a task that does not hold the part (right), got 'left'"),
        (["--robot", "right", "--x", "9"], "--x: expected FROM:TO in mm, such as 500:2000, got '9'"),
        (["--robot", "right", "--y", "9:3"], "--y: expected FROM:TO in mm with FROM not above TO, got 9:3"),
        (["--robot", "right", "--yaw", "left"], "--yaw: expected degrees or toward, got 'left'"),
        (["--robot", "right", "--grid", "0"], "--grid: expected millimetres above 0, got 0"),
        (
            ["--robot", "right", "--mode", "semi_coordinated"],
            "motion.mode: expected simultaneous, pairwise or part_at_rest without program, got 'semi_coordinated': add "
            "program: {} for a program from home to home",
        ),
        (
            ["--robot", "right", "--set", "motion.cyclic=true"],
            "motion.cyclic: expected false for a map of bases, got true",
        ),
    ],
)
def test_what_cannot_be_mapped_is_one_located_line(
    options: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status = run(["map", str(CELL), "-q", "-o", str(tmp_path / "map"), *options])

    assert status == 2
    error = capsys.readouterr().err.strip()
    assert error.endswith(message)
    assert "\n" not in error


SLOW = {"robots.left.start_deg": [50, -85, 35], "motion": {"duration_s": 4, "step_s": 0.02, "time_law": "quintic"}}
WIDE = BaseGrid(x=(1000, 2600), y=(-600, 1000), step=400)
RING = {"circle": {"radius_mm": 40, "center_mm": [110, -90], "plane": "xy"}, "project": "+z"}


@pytest.fixture(scope="module")
def block() -> Cell:
    return load_cell(CELL).with_values(SLOW)


@pytest.fixture(scope="module")
def block_map(block: Cell) -> Any:
    return base_map(block, "right", WIDE)


def test_a_program_of_one_block_has_the_map_of_the_block(block: Cell, block_map: Any) -> None:
    alone, program = block_map, base_map(block.with_values({"program": {}}), "right", WIDE)

    for one, other in zip(alone["places"], program["places"], strict=True):
        assert one["verdict"] == other["verdict"]
        assert one["figures"].get("margin") == pytest.approx(
            other["figures"].get("margin"), abs=0.1
        )  # as good as margins at nodes are
    assert (alone["phases"], program["phases"]) == ([], ["circle"])


@pytest.fixture(scope="module")
def two_tasks(block: Cell) -> Cell:
    written: Any = block.origin.document["tasks"]
    return block.with_values({"program": {}, "tasks.ring": {**written["circle"], "path": RING}})


@pytest.fixture(scope="module")
def two_tasks_map(two_tasks: Cell) -> Any:
    return base_map(two_tasks, "right", WIDE)


@pytest.mark.slow
def test_a_place_of_a_program_passes_where_it_does_for_each_of_its_tasks_alone(
    block: Cell, block_map: Any, two_tasks_map: Any
) -> None:
    ring = base_map(block.with_values({"tasks.circle.path": RING}), "right", WIDE)
    places, *alone = (entry["places"] for entry in (two_tasks_map, block_map, ring))

    verdicts = [place["verdict"] == "passes" for place in places]
    assert verdicts == [all(place["verdict"] == "passes" for place in pair) for pair in zip(*alone, strict=True)]
    assert len(set(verdicts)) == 2
    failing = {place["reason"].partition(":")[0] for place in places if place["reason"]}
    assert failing == {"circle", "ring"}  # the task by which a place fails is named


@pytest.mark.slow
def test_no_place_is_too_fast_for_a_program_that_is_as_fast_as_its_limits_allow(two_tasks: Cell) -> None:
    hurried = two_tasks.with_values({"motion.duration_s": 1.5, "motion.step_s": 0.004})
    fastest = hurried.with_values({"motion.timing": "fastest"})

    written, retimed = (base_map(cell, "right", WIDE)["places"] for cell in (hurried, fastest))

    verdicts = [(one["verdict"], other["verdict"]) for one, other in zip(written, retimed, strict=True)]
    assert ("speed", "passes") in verdicts
    assert all(one == other for one, other in verdicts if one != "speed")
    assert all(other != "speed" for _, other in verdicts)


def test_a_place_of_a_program_is_written_with_the_start_of_every_task(two_tasks: Cell, two_tasks_map: Any) -> None:
    places = two_tasks_map
    best = places["best"][0]

    again = base_map(two_tasks.with_values(best["settings"]), "right", _at(places["places"][best["place"]]))

    assert {"robots.right.start_deg", "tasks.ring.start_deg"} < set(best["settings"])
    (place,) = again["places"]
    assert place["figures"]["cycle_s"] == pytest.approx(places["places"][best["place"]]["figures"]["cycle_s"], rel=1e-6)


def _at(place: Any) -> BaseGrid:
    """The grid of one place."""
    return BaseGrid(x=(place["x_mm"],) * 2, y=(place["y_mm"],) * 2)


@pytest.mark.slow
def test_a_base_from_which_nothing_is_reached_is_mapped_too(two_tasks: Cell, two_tasks_map: Any) -> None:
    away = base_map(two_tasks.with_values({"robots.right.base.x_mm": 9000}), "right", WIDE)

    verdicts = [[place["verdict"] for place in entry["places"]] for entry in (two_tasks_map, away)]

    assert verdicts[0] == verdicts[1]


@pytest.mark.parametrize(("clearance", "verdict"), [(20, Verdict.PASSES), (60, Verdict.COLLISION)])
def test_starts_judged_together_are_judged_as_each_by_itself(clearance: float, verdict: Verdict) -> None:
    near = load_cell(CELL).with_values({**STARTS, "checks.clearance_mm": clearance})  # the arms are 30 mm apart
    ready = prepared(near, "right", BaseGrid(x=(1900, 2300), y=(100, 100), step=400))
    ((q, at),), (job,) = ready.starts(), ready.jobs
    known, inside = verdicts_at_start(job, q, at)
    q, at = q[inside], at[inside]

    together = judge(job, q, at)

    alone: dict[int, PlaceVerdict] = {}
    for start, place in zip(q, at.tolist(), strict=True):
        (judgement,) = judge(job, start[None], np.array([place])).values()
        alone[place] = judgement.or_better(alone.get(place))
    assert len(known) == 2
    assert len(set(at.tolist())) < len(at)
    assert verdict in {value.verdict for value in together.values()}
    assert together.keys() == alone.keys()
    for place, judgement in together.items():
        assert judgement.verdict is alone[place].verdict
        np.testing.assert_array_equal(judgement.start, alone[place].start)
        assert judgement.cycle == pytest.approx(alone[place].cycle, rel=1e-9)
