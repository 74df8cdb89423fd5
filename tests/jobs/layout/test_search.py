"""A layout search from end to end: what it calls best is what ``solve`` passes."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.layout_search import CELL, SETTINGS, searched_pair
from builders.study_trials import InThisProcess
from jsonschema import Draft202012Validator

from cellplan import CellplanError, LayoutRequest, LayoutResult, Stop, load_cell, search_layout, solve
from cellplan.jobs.layout.finish.finish import Finish
from cellplan.jobs.layout.record import layout_schema
from cellplan.jobs.layout.result import layout_lines
from cellplan.study.folder import prepare_folder

pytestmark = pytest.mark.usefixtures("stored_solutions")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("searched")


@pytest.fixture(scope="module")
def searched(folder: Path) -> LayoutResult:
    return searched_pair(folder)


def test_the_result_is_a_cell_file_that_passes_solve(searched: LayoutResult, folder: Path) -> None:
    solution = solve(load_cell(folder / "study" / "best.yaml"))

    best = searched.record["best"]
    assert best is not None
    assert solution.passed
    assert solution.motion.times[-1] == best["cycle_s"]
    margins = [np.degrees(use.margin) for run in solution.runs for use in run.report.joints]
    assert min(margins) == pytest.approx(best["margin_deg"], abs=1e-5)
    assert min(margins) >= 10.0


def test_the_result_keeps_the_words_of_the_given_file(searched: LayoutResult, folder: Path) -> None:
    given, best = ((folder / name).read_text().splitlines() for name in ("given.yaml", "study/best.yaml"))

    left = [line for line in given if line not in best]
    assert searched.record["status"] == "certified"
    assert any("was xyz_mm: [1900, 300, 500]" in line for line in best)
    assert all(any(key in line for key in ("base:", "start_deg:", "motion:")) for line in left)


def test_an_earlier_search_is_replaced_unless_its_result_was_changed(searched: LayoutResult, folder: Path) -> None:
    study = shutil.copytree(folder / "study", folder / "again")
    prepare_folder(study, resume=False)
    left = [entry.name for entry in study.iterdir() if not entry.name.startswith(".")]

    changed = shutil.copytree(folder / "study", folder / "changed")
    (changed / "best.yaml").write_text("mine")

    assert not left
    with pytest.raises(CellplanError, match=r"holds 'best\.yaml', which no study wrote"):
        prepare_folder(changed, resume=False)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "limit"), [("turntable", 1.5), ("dual_arm", 1.2), ("load_sharing", 2.5)])
def test_cells_of_other_kinds_are_improved(name: str, limit: float, tmp_path: Path) -> None:
    request = LayoutRequest(cell=CELL.parent / "layout" / f"{name}.yaml")

    searched = search_layout(request, tmp_path / "study", stop=Stop(trials=4))

    best = searched.record["best"]
    assert best is not None
    assert best["cycle_s"] <= limit
    assert solve(load_cell(tmp_path / "study" / "best.yaml")).passed


def test_the_cycle_is_the_shortest_of_this_motion(searched: LayoutResult, folder: Path) -> None:
    cell = load_cell(folder / "study" / "best.yaml")
    step = cell.motion.step
    faster = cell.with_values({"motion.duration_s": (cell.motion.duration or 0.0) - step})

    assert searched.record["given"]["status"] in {"conforming", "violating"}
    assert not solve(faster).passed


@pytest.mark.slow
def test_a_given_layout_that_is_not_beaten_is_the_result(
    searched: LayoutResult, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert searched.best is not None
    rejected = replace(searched.best, reason="nothing passes")
    monkeypatch.setattr(Finish, "certified", lambda *_: rejected)
    best = folder / "study" / "best.yaml"
    request = LayoutRequest(cell=best, vary=("right.base={x_mm: [1500, 2300], y_mm: [0, 600]}",), margin=9.9)

    result = search_layout(request, folder / "again", stop=Stop(trials=1), workers=InThisProcess())

    assert result.record["best"] is not None
    assert result.record["best"]["cycle_s"] == result.record["given"]["cycle_s"]
    assert any(remark.startswith("no gain: nothing better") for remark in result.record["remarks"])
    assert solve(load_cell(folder / "again" / "best.yaml")).motion.times[-1] == result.record["best"]["cycle_s"]


def test_record_page_and_console_say_the_same(searched: LayoutResult, folder: Path) -> None:
    record = json.loads((folder / "study" / "study.json").read_text())
    page = (folder / "study" / "study.html").read_text()

    lines = layout_lines(record, folder / "study")
    assert record == searched.record
    assert lines[0].startswith("planar-pair: CERTIFIED: cycle ")
    assert lines[0].partition(": ")[2] in page
    assert lines[-2] == f"next: cellplan solve {folder / 'study' / 'best.yaml'} -o {folder / 'study'}-run"
    assert page.count("<svg") >= 2


def test_the_record_is_of_its_schema_without_further_keys(searched: LayoutResult) -> None:
    schema = layout_schema()

    errors = [error.message for error in Draft202012Validator(schema).iter_errors(searched.record)]
    assert errors == []
    assert set(searched.record) == set(schema["$defs"]["LayoutRecord"]["properties"])


def test_effects_of_the_variables_are_derivatives_of_the_cycle(searched: LayoutResult) -> None:
    best = searched.best
    assert best is not None
    problem, x = best.standing.problem, best.standing.measures.point.x
    step = 1e-5

    changed = []
    for sign in (1.0, -1.0):
        point = problem.evaluate(x + sign * step * np.eye(len(x))[0], best.start)
        assert point is not None
        node, column = np.unravel_index(best.standing.measures.speeds.value.argmax(), point.qd.shape)
        changed.append(abs(point.qd[node, column]) / problem.limits.velocity[column])

    slope = (changed[0] - changed[1]) / (2.0 * step) * float(problem.times[-1]) * 0.1  # of 100 mm
    assert searched.record["variables"][0]["cycle_s"] == pytest.approx(slope, rel=0.05, abs=1e-3)


@pytest.mark.slow
def test_equal_trials_give_equal_bytes_with_any_number_of_workers(tmp_path: Path) -> None:
    request = LayoutRequest(cell=CELL, settings=SETTINGS)
    for name, workers in (("one", 1), ("two", 2)):
        search_layout(request, tmp_path / name, stop=Stop(trials=5), workers=workers)

    for name in ("study.jsonl", "study.json", "study.html", "best.yaml"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
