"""A layout search with displaced bases from end to end: every sampled displacement passes the checks of ``solve``."""

import json
from pathlib import Path

import pytest

from cellplan import load_cell, solve
from cellplan.cli.main import run

PAIR = Path(__file__).resolve().parents[3] / "cells" / "planar_pair.yaml"
SETTINGS = ("--set", "motion.duration_s=2", "--set", "motion.step_s=0.004")

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    result = tmp_path_factory.mktemp("misplaced") / "study"
    options = ["--misplacement", "0.4mm,0.2deg", "--trials", "1", "--workers", "1", "-o", str(result)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("cellplan.search.misplacement.robust.SEEDED", 4)
        assert run(["layout", str(PAIR), *SETTINGS, *options]) == 0
    return result


def test_all_sampled_displacements_are_verified_in_one_cycle(folder: Path) -> None:
    record = json.loads((folder / "study.json").read_text())

    result = record["misplacement"]
    assert record["status"] == "certified"
    assert (result["seeded"], result["seeded_kept"]) == (4, 4)
    assert result["ends_kept"] == result["ends"] == 16
    assert result["by_derivatives_kept"] == result["by_derivatives"] > 0
    assert result["cycle_s"] == pytest.approx(record["best"]["cycle_s"])
    assert all(not entry["reason"] for entry in result["solved"])
    assert "sampled" in (folder / "study.html").read_text().lower()


def test_a_tolerance_passes_solve_and_what_is_beyond_it_fails(folder: Path) -> None:
    record = json.loads((folder / "study.json").read_text())
    result = record["misplacement"]["tolerances"]
    height = next(entry for entry in result if entry["robot"] == "left" and entry["direction"] == "z")
    best = load_cell(folder / "best.yaml")

    def checks(by: float) -> bool:
        z = 1e3 * float(best.robot("left").X_WB[2, 3]) + by
        return solve(best.with_values({"robots.left.base.z_mm": z})).passed

    assert "tool depth" in height["first_plus"]
    assert height["plus"] >= 0.4
    assert checks(height["plus"])
    assert not checks(16.0 * 0.4)
