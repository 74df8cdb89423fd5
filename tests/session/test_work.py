"""Heavy work of a session: verdicts are those of solve, the newest wins, crashes are events."""

import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from builders.editor import coarse_pair

from cellplan.errors import InputError, NoSolutionError
from cellplan.files.cell.load import load_cell
from cellplan.jobs.base_map.base_map import base_map
from cellplan.jobs.base_map.grid import BaseGrid
from cellplan.runs.solve import solve
from cellplan.session.document import Document
from cellplan.session.work import Works
from cellplan.session.works.request import request_of

LIMIT_S = 600.0  # [s] for work to end on a slow machine
Event = dict[str, Any]


@pytest.fixture
def pair(cells: Path, tmp_path: Path) -> Path:
    """The planar pair, which is cheap."""
    return coarse_pair(cells, tmp_path)


@pytest.fixture
def works(pair: Path) -> Iterator[Works]:
    works = Works(load_cell(pair))
    yield works
    works.close()


def events_of(works: Works, is_enough: Callable[[Event], bool] = lambda _: False) -> list[Event]:
    """Events until nothing is under way, or one is enough."""
    events, begun = list[Event](), time.monotonic()
    while works.running and not any(map(is_enough, events)):
        events += works.poll()
        assert time.monotonic() - begun < LIMIT_S
        time.sleep(0.01)
    return events


def named(events: list[Event], name: str) -> list[Event]:
    return [event for event in events if event["event"] == name]


@pytest.mark.slow
def test_a_crash_is_an_event_and_the_next_work_is_done(works: Works, pair: Path) -> None:
    works.start("certify", load_cell(pair), 1)
    os.kill(works.running["certify"], signal.SIGKILL)

    failed = events_of(works)

    text = "its process was ended (SIGKILL); begin it again"
    assert failed == [{"event": "failed", "work": "certify", "text": text}]
    works.start("certify", load_cell(pair), 2)
    [verdict] = named(events_of(works), "verdict")
    assert (verdict["version"], verdict["passed"]) == (2, True)
    assert verdict["lines"][0] == "planar-pair: passed"


@pytest.mark.slow
def test_the_newest_work_of_a_kind_wins(works: Works, pair: Path) -> None:
    cell = load_cell(pair)
    works.start("certify", cell, 1)
    first = works.running["certify"]
    works.start("certify", cell, 2)

    assert works.running["certify"] != first
    assert [event["version"] for event in named(events_of(works), "verdict")] == [2]


def test_stopped_work_sends_nothing_more(works: Works, pair: Path) -> None:
    works.start("certify", load_cell(pair), 1)

    works.stop()

    assert works.running == {}
    assert works.poll() == []


def test_there_is_no_other_work(works: Works) -> None:
    with pytest.raises(ValueError, match="expected one of certify, improve, repair, map"):
        works.start("os.system")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("planar_pair.yaml", {}),
        ("two_robots.yaml", {}),
        ("two_robots.yaml", {"robots.pen.base.x_mm": 2600}),  # beyond reach
        ("four_robots_initial.yaml", {}),
        ("in_turn.yaml", {}),  # a program from home to home
    ],
)
def test_the_verdict_is_that_of_solve(works: Works, cells: Path, name: str, values: dict[str, object]) -> None:
    cell = load_cell(cells / name).with_values(values)
    works.start("certify", cell, 7)
    [verdict] = named(events_of(works), "verdict")
    try:
        solution = solve(cell)
        messages = [check.message for run in solution.runs for check in run.report.checks if not check.passed]
        first, passed = f"{cell.name}: {'passed' if solution.passed else 'failed'}", solution.passed
    except (InputError, NoSolutionError) as error:
        first, *messages = str(error).splitlines()
        passed = False

    assert (verdict["version"], verdict["passed"], verdict["lines"][0]) == (7, passed, first)
    assert all(any(message in line for line in verdict["lines"]) for message in messages[:3])


@pytest.mark.slow
def test_each_trial_is_better_than_the_one_before_and_its_values_can_be_set(works: Works, cells: Path) -> None:
    document = Document(cells / "four_robots_initial.yaml")
    works.start("improve", *request_of(document), 1.0)

    trials = named(events_of(works), "trial")

    assert trials
    cycles = [float(trial["text"].split("cycle ")[1].split(" s")[0]) for trial in trials[:-1]]
    assert cycles == sorted(cycles, reverse=True)
    assert all(trial["text"].endswith("planned") for trial in trials[:-1])
    assert "finished" in trials[-1]["text"]
    document.changes.set(trials[-1]["values"])
    assert solve(document.cell).passed


@pytest.mark.slow
def test_remedies_are_values_with_which_the_cell_passes(works: Works, cells: Path, tmp_path: Path) -> None:
    path = tmp_path / "cell.yaml"
    text = (cells / "two_robots.yaml").read_text(encoding="utf-8")
    path.write_text(text.replace("duration_s: 4", "duration_s: 0.5"), encoding="utf-8")
    document = Document(path, ["checks.clearance_mm=6"])
    assert not solve(document.cell).passed

    works.start("repair", *request_of(document))
    [event] = named(events_of(works), "remedies")

    assert event["remedies"]
    for remedy in event["remedies"]:
        assert "checks.clearance_mm" not in remedy["values"]
        assert remedy["title"]
        assert solve(document.cell.with_values(remedy["values"])).passed


@pytest.mark.slow
def test_a_file_that_was_saved_meanwhile_is_not_searched(works: Works, pair: Path) -> None:
    request = request_of(Document(pair))
    pair.write_bytes(pair.read_bytes() + b"# saved\n")

    works.start("improve", *request)

    [failed] = named(events_of(works), "failed")
    assert failed["text"] == "pair.yaml: was saved by another program since it was read: decide about it first"


@pytest.mark.slow
def test_tiles_are_those_of_the_map(works: Works, cells: Path) -> None:
    cell = load_cell(cells / "two_robots.yaml")
    works.start("map", cell, "pen")
    events = named(events_of(works, lambda event: event.get("size_mm") == 50.0), "tiles")
    works.stop()

    shown: dict[float, dict[tuple[float, float], str]] = {}
    for event in events:
        shown.setdefault(event["size_mm"], {}).update({(it["x_mm"], it["y_mm"]): it["state"] for it in event["tiles"]})
    x, y = ([place[axis] for place in shown[200.0]] for axis in (0, 1))
    for size in (200.0, 100.0):
        record = base_map(cell, "pen", BaseGrid(x=(min(x), max(x)), y=(min(y), max(y)), step=size))
        verdicts = {(place["x_mm"], place["y_mm"]): place["verdict"] for place in record["places"]}
        new = verdicts if size == 200.0 else {it: verdicts[it] for it in verdicts if it not in shown[200.0]}
        assert shown[size] == new
