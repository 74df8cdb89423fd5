"""Every script in ``examples/`` runs and prints what it announces."""

import runpy
from pathlib import Path

import pytest

import cellplan.planning.methods
from cellplan.pipeline.export import EXPORTERS

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
PRINTED = {
    "batch_of_cells": ["examples/plate.yaml: passed; smallest joint margin", "examples/missing.yaml: ", "no such file"],
    "layout": ["certified after 1 trial, 1 solved", "solved again: passed True"],
    "own_exporter": ["written: left.json right.json"],
    "own_method": ["circle: 150 Euler steps, position error 0.2"],
    "plot_joint": ["picture: outputs/examples/joint.png"],
    "rehearse": ["as planned: largest position error of the real tool on the real part 0.8000 mm", "corrected: "],
    "screen": ["25 of 32 follow the path, 22 within all limits", "solved and verified: passed"],
    "solve": ["circle: position error", "passed: True; report: outputs/examples/solve/report.html"],
    "verify_edited_table": ["as written: passed", "edited: position error of task 'circle': 0.159 mm at 1.480 s"],
}  # by script: texts of its output, in their order
WRITTEN = {
    "layout": ["outputs/examples/layout/best.yaml", "outputs/examples/layout/study.html"],
    "own_exporter": ["outputs/examples/json/left.json", "outputs/examples/json/right.json"],
    "plot_joint": ["outputs/examples/joint.png"],
    "solve": ["outputs/examples/solve/report.html", "outputs/examples/solve/tables/right.csv"],
}


def test_every_example_is_run() -> None:
    assert {path.stem for path in EXAMPLES.glob("*.py")} == set(PRINTED)


@pytest.mark.parametrize("name", sorted(PRINTED))
def test_an_example_runs_and_prints_what_it_announces(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(cellplan.planning.methods, "__path__", [*cellplan.planning.methods.__path__])
    monkeypatch.setattr("cellplan.pipeline.export.EXPORTERS", dict(EXPORTERS))

    runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")

    printed = capsys.readouterr().out
    places = [printed.find(text) for text in PRINTED[name]]
    assert -1 not in places, printed
    assert places == sorted(places), printed
    assert [path for path in WRITTEN.get(name, []) if not (tmp_path / path).stat().st_size] == []


@pytest.mark.parametrize("page", ["README.md", "docs/index.md"])
def test_every_example_is_linked(page: str) -> None:
    text = (EXAMPLES.parent / page).read_text(encoding="utf-8")

    assert [name for name in PRINTED if f"examples/{name}.py)" not in text] == []
