"""Every script in ``examples/`` runs and prints what it announces, and so does the notebook."""

import runpy
import shutil
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

import cellplan.planning.methods
from cellplan.programs.dialects import DIALECTS

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
NOTEBOOK = EXAMPLES / "gallery" / "first_look.ipynb"
PRINTED = {
    "batch_of_cells": ["examples/plate.yaml: passed; smallest joint margin", "examples/missing.yaml: ", "no such file"],
    "gallery/clearance_over_time": [
        "passed: 25 checks",
        "short tool  long tool",
        "smallest distance of the robots: +7",
    ],
    "gallery/layout_result": ["<Layout search of 'planar-pair'", "robots.right.base.x_mm", "solved again: passed True"],
    "gallery/solve_and_plot": [
        "passed: 25 checks",
        "picture: ",
        "below half of the largest feed in 46% of the path's time",
    ],
    "gallery/sweep_into_frame": [
        "0.4                failed",
        "0.6                passed",
        "20% reserve: 0.6 s",
        "same table: True",
    ],
    "gallery/worst_moments": [
        "smallest margin, right B at 0.000 s",
        "smallest clearance, left/C - right/C at",
        "subject  used",
    ],
    "layout": ["certified after 1 trial, 1 solved", "solved again: passed True"],
    "own_exporter": ["written: left.rows right.rows"],
    "own_method": ["circle: 150 Euler steps, position error 0.2"],
    "plot_joint": ["picture: outputs/examples/joint.png"],
    "rehearse": ["as planned: largest position error of the real tool on the real part 0.8000 mm", "corrected: "],
    "screen": ["25 of 32 follow the path, 22 within all limits", "solved and verified: passed"],
    "solve": ["circle: position error", "passed: True; report: outputs/examples/solve/report.html"],
    "verify_edited_table": ["as written: passed", "edited: position error of task 'circle': 0.159 mm at 1.480 s"],
}  # by script: texts of its output, in their order
WRITTEN = {
    "gallery/solve_and_plot": ["outputs/examples/gallery/feed.png"],
    "layout": ["outputs/examples/layout/best.yaml", "outputs/examples/layout/study.html"],
    "own_exporter": ["outputs/examples/rows/left.rows", "outputs/examples/rows/right.rows"],
    "plot_joint": ["outputs/examples/joint.png"],
    "solve": ["outputs/examples/solve/report.html", "outputs/examples/solve/tables/right.csv"],
}
PROCESSES = ("gallery/layout_result", "gallery/sweep_into_frame", "layout")
OTHERS = (  # solve as others do
    "batch_of_cells",
    "rehearse",
    "verify_edited_table",
    "gallery/clearance_over_time",
    "gallery/solve_and_plot",
    "gallery/worst_moments",
)
MARKS = dict.fromkeys((*PROCESSES, *OTHERS), pytest.mark.slow)


def test_every_example_is_run() -> None:
    scripts = {path.relative_to(EXAMPLES).with_suffix("").as_posix() for path in EXAMPLES.rglob("*.py")}

    assert scripts == set(PRINTED)


@pytest.mark.parametrize("name", [pytest.param(name, marks=MARKS.get(name, ())) for name in sorted(PRINTED)])
def test_an_example_runs_and_prints_what_it_announces(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(cellplan.planning.methods, "__path__", [*cellplan.planning.methods.__path__])
    monkeypatch.setitem(DIALECTS, "rows", DIALECTS["csv"])  # what an example puts there is gone after it

    runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")

    printed = capsys.readouterr().out
    places = [printed.find(text) for text in PRINTED[name]]
    assert -1 not in places, printed
    assert places == sorted(places), printed
    assert [path for path in WRITTEN.get(name, []) if not (tmp_path / path).stat().st_size] == []


def test_every_example_is_linked_from_one_page_that_the_readme_leads_to() -> None:
    text = (EXAMPLES.parent / "docs" / "index.md").read_text(encoding="utf-8")

    assert "(docs/index.md#examples)" in (EXAMPLES.parent / "README.md").read_text(encoding="utf-8")
    assert "## Examples" in text
    assert [name for name in PRINTED if "/" not in name and f"examples/{name}.py)" not in text] == []
    gallery = (EXAMPLES / "gallery" / "README.md").read_text(encoding="utf-8")
    assert "examples/gallery/README.md)" in text
    assert [name for name in PRINTED if "/" in name and f"({name.partition('/')[2]}.py)" not in gallery] == []


def test_the_notebook_is_kept_without_outputs() -> None:
    book = nbformat.read(NOTEBOOK, as_version=4)
    nbformat.validate(book)
    code = [cell for cell in book.cells if cell.cell_type == "code"]

    assert code
    assert [cell for cell in code if cell.outputs or cell.execution_count] == []
    assert len(NOTEBOOK.read_bytes()) < 10_000


@pytest.mark.slow
def test_the_notebook_runs_and_shows_results(tmp_path: Path) -> None:
    shutil.copytree(EXAMPLES, tmp_path / "examples")
    folder = tmp_path / "examples" / NOTEBOOK.parent.name
    book = nbformat.read(NOTEBOOK, as_version=4)

    NotebookClient(book, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()

    code = [cell for cell in book.cells if cell.cell_type == "code"]
    shown = [output["data"] for cell in code for output in cell.outputs if output.output_type == "execute_result"]
    pages = [data["text/html"] for data in shown if "✓ passed" in data.get("text/html", "")]
    assert len(pages) == 1
    assert all(set(data) >= {"text/plain", "text/html"} and len(data["text/html"]) < 200_000 for data in shown)
    assert sum("✗ failed: " in data["text/html"] for data in shown) == 1
    assert shown[0]["text/plain"].startswith("<Cell 'plate'")
