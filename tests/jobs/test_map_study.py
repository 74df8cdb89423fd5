"""Maps as studies: the same files for any number of workers, interrupted or not; a lost tile costs its places only."""

import json
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest
from builders.study_trials import InThisProcess

from cellplan import BaseGrid, MapRequest, base_map, load_cell, map_study
from cellplan.cli.main import run
from cellplan.jobs.base_map import base_map as map_module
from cellplan.study.folder import prepare_folder
from cellplan.study.workers import crashed

CELL = Path(__file__).resolve().parents[2] / "cells" / "planar_pair.yaml"
GRID = BaseGrid(x=(1000, 2600), y=(-600, 1000), step=320)
SETTINGS = ("robots.left.start_deg=[50, -85, 35]", "motion.duration_s=2", "motion.step_s=0.02")
REQUEST = MapRequest(cell=CELL, robot="right", grid=GRID, settings=SETTINGS)
FEW = 8  # [-] motions at once, so that a small map has four tiles


@pytest.fixture(scope="module", autouse=True)
def _small_tiles() -> Any:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(map_module, "AT_ONCE", FEW)
        yield


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("maps") / "whole"
    map_study(REQUEST, folder, workers=InThisProcess())
    return folder


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


class Interrupted(InThisProcess):
    """Evaluates the first two tiles; then there is a Ctrl-C."""

    def submit(self, function: Any, /, *arguments: Any, **named: Any) -> Future[Any]:
        if len(self.numbers) < 2:
            return super().submit(function, *arguments, **named)
        future: Future[Any] = Future()
        future.set_exception(KeyboardInterrupt())
        return future


class Crashing(InThisProcess):
    """The second tile ends its process."""

    def submit(self, function: Any, /, *arguments: Any, **named: Any) -> Future[Any]:
        future = super().submit(function, *arguments, **named)
        if self.numbers[-1] != 1:
            return future
        lost: Future[Any] = Future()
        lost.set_result(json.dumps(crashed("its process ended").record))
        return lost


@pytest.mark.slow
def test_the_record_is_that_of_a_map_made_in_one_go(folder: Path) -> None:
    cell = load_cell(CELL).with_values(
        {"robots.left.start_deg": [50, -85, 35], "motion.duration_s": 2, "motion.step_s": 0.02}
    )

    mapped = base_map(cell, "right", GRID)

    assert json.loads((folder / "map.json").read_bytes()) == json.loads(json.dumps(mapped))
    assert set(content(folder)) == {"map.json", "map.html", "map.svg", "study.json", "study.jsonl"}


def test_an_interrupted_map_goes_on_to_the_same_files(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt, match=r"2 of \d+ tiles are recorded in .*; --resume goes on from there"):
        map_study(REQUEST, tmp_path / "map", workers=Interrupted())
    assert set(content(tmp_path / "map")) == {"study.jsonl"}

    rest = InThisProcess()
    map_study(REQUEST, tmp_path / "map", workers=rest, resume=True)

    assert 0 not in rest.numbers
    assert 1 not in rest.numbers
    assert content(tmp_path / "map") == content(folder)


def test_tiles_cover_every_place_with_a_start_once(folder: Path) -> None:
    trials = [json.loads(line) for line in (folder / "study.jsonl").read_text().splitlines()[1:]]
    record = json.loads((folder / "map.json").read_bytes())

    phases = [[sorted(set(phase["places"])) for phase in trial["values"]["phases"]] for trial in trials]
    assert all(tile == same[0] for same in phases for tile in same)
    places = [place for same in phases for place in same[0]]
    moved = [number for number, place in enumerate(record["places"]) if place["figures"]]
    assert len(trials) % map_module.SHARES == 0
    assert len(places) == len(set(places))
    assert set(moved) <= set(places)


def test_a_lost_tile_costs_its_own_places_and_says_why(folder: Path, tmp_path: Path) -> None:
    mapped = map_study(REQUEST, tmp_path / "map", workers=Crashing())

    whole = json.loads((folder / "map.json").read_bytes())
    lost = [place for place, entry in enumerate(mapped["places"]) if entry["verdict"] == "not_judged"]
    assert lost
    assert mapped["counts"]["not_judged"] == len(lost)
    assert {mapped["places"][place]["reason"] for place in lost} == {"its process ended"}
    assert all(
        entry["verdict"] == other["verdict"]
        for place, (entry, other) in enumerate(zip(mapped["places"], whole["places"], strict=True))
        if place not in lost
    )
    assert "its process ended" in (tmp_path / "map" / "map.html").read_text()


def test_an_earlier_map_is_replaced_and_another_one_not_continued(folder: Path, tmp_path: Path) -> None:
    again = tmp_path / "map"
    again.mkdir()
    for name, data in content(folder).items():
        (again / name).write_bytes(data)

    other = MapRequest(cell=CELL, robot="right", grid=BaseGrid(x=(1000, 2600), step=200), settings=SETTINGS)
    with pytest.raises(Exception, match="expected the study that is to be continued, got one with another value"):
        map_study(other, again, workers=InThisProcess(), resume=True)
    prepare_folder(again, resume=False)

    assert not content(again)


def test_the_status_says_how_many_tiles_are_done(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["map", str(CELL), "--robot", "right", "-o", str(folder), "--status"]) == 0

    count = len((folder / "study.jsonl").read_text().splitlines()) - 1
    assert f"{folder}: tile {count}, best cycle_s 0." in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.slow
def test_any_number_of_workers_writes_the_same_files(folder: Path, tmp_path: Path) -> None:
    for count in (1, 2, 4):
        map_study(REQUEST, tmp_path / str(count), workers=count)

    assert all(content(tmp_path / str(count)) == content(folder) for count in (1, 2, 4))
