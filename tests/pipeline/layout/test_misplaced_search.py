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
    found = tmp_path_factory.mktemp("misplaced") / "study"
    options = ["--misplacement", "0.4mm,0.2deg", "--trials", "1", "--workers", "1", "-o", str(found)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("cellplan.search.misplacement.robust.SEEDED", 4)
        assert run(["layout", str(PAIR), *SETTINGS, *options]) == 0
    return found


def test_all_sampled_displacements_are_verified_in_one_cycle(folder: Path) -> None:
    record = json.loads((folder / "study.json").read_text())

    found = record["misplacement"]
    assert record["status"] == "certified"
    assert (found["seeded"], found["seeded_kept"]) == (4, 4)
    assert found["ends_kept"] == found["ends"] == 16
    assert found["by_derivatives_kept"] == found["by_derivatives"] > 0
    assert found["cycle_s"] == pytest.approx(record["best"]["cycle_s"])
    assert all(not each["reason"] for each in found["solved"])
    assert "sampled" in (folder / "study.html").read_text().lower()


def test_a_tolerance_passes_solve_and_what_is_beyond_it_fails(folder: Path) -> None:
    record = json.loads((folder / "study.json").read_text())
    found = record["misplacement"]["tolerances"]
    height = next(each for each in found if each["robot"] == "left" and each["direction"] == "z")
    best = load_cell(folder / "best.yaml")

    def checks(by: float) -> bool:
        z = 1e3 * float(best.robot("left").X_WB[2, 3]) + by
        return solve(best.with_values({"robots.left.base.z_mm": z})).passed

    assert "tool depth" in height["first_plus"]
    assert height["plus"] >= 0.4
    assert checks(height["plus"])
    assert not checks(16.0 * 0.4)
