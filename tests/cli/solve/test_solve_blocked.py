"""Solving a program of which a transfer move is not found: its name, what is in the way, and a page of the best try."""

import json
import re
from pathlib import Path

import pytest
from builders.home_to_home import PICK_AND_PLACE
from builders.view_pages import data_of, rows_of

from cellplan.cli.main import run

PILLAR = "  pillar: {box: {size_mm: [120, 120, 1600]}, at: {xyz_mm: [700, -700, 800]}}\nmotion:"
ON_PART = "home_deg: [7.426416495712, -80, -118.820825943611, 26.231452660417, 82.573583504285, 90]"


@pytest.fixture(autouse=True)
def few_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is in the way of the straight move then stays there."""
    monkeypatch.setattr("cellplan.planning.transfer.in_turn.SAMPLES", 2)
    monkeypatch.setattr("cellplan.planning.transfer.in_time.SAMPLES", 2)
    monkeypatch.setattr("cellplan.planning.transfer.in_time.DELAYS", 1)


def solved(text: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """What is said of a cell whose transfer move is not found."""
    cell = folder / "cell.yaml"
    cell.write_text(text, encoding="utf-8")
    assert run(["solve", str(cell), "-o", str(folder / "run"), "-q"]) == 3
    out, err = capsys.readouterr()
    assert out == ""
    assert not (folder / "run").exists()
    return err


@pytest.mark.slow
def test_a_transfer_that_is_not_found_has_a_name_a_pair_an_amount_and_a_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = solved(PICK_AND_PLACE.replace("motion:", PILLAR), tmp_path, capsys)

    assert ": robots.holder: transfer-1, from home to grip: found no transfer move of 'holder': at the best try" in said
    assert re.search(r" mm deep in 'pillar' near \(.*\) mm at \d+ % of the try, 5 mm are demanded; tried were: ", said)
    page = tmp_path / "run-transfer-1.html"
    assert said.rstrip().endswith(f"; 3-D page of the best try: {page}")
    (scene,) = data_of(page.read_text(encoding="utf-8"))["scenes"]
    (failure,) = scene["failures"]
    assert {scene["bodies"][body]["name"] for body in failure["bodies"]} >= {"pillar"}
    times, _ = rows_of(scene["motion"])
    assert 0.0 < failure["at"] < times[-1]


@pytest.mark.slow
def test_a_script_reads_the_pair_the_place_and_the_share_of_the_try(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cell = tmp_path / "cell.yaml"
    cell.write_text(PICK_AND_PLACE.replace("motion:", PILLAR), encoding="utf-8")

    assert run(["solve", str(cell), "-o", str(tmp_path / "run"), "-q", "--json"]) == 3

    record = json.loads(capsys.readouterr().out)
    blocked = record["blocked"]
    assert (record["status"], blocked["phase"]) == ("error", "transfer-1")
    assert "pillar" in blocked["pair"]
    assert blocked["missing_mm"] > 5.0
    assert blocked["place_mm"][:2] == pytest.approx([700, -700], abs=400)  # the middle of a link that is in the pillar
    assert 0.0 < blocked["share_of_try"] < 1.0
    assert blocked["try"] in record["errors"][0]
