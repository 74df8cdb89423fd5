"""The gate: what it lets through, what it says of the rest, and that there is no way round it."""

import ast
import inspect
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from builders.run_edits import edit_json
from builders.stored_cells import write_cell

from cellplan import export_program, load_cell, open_gate, solve, write_run
from cellplan.cache import store
from cellplan.errors import InputError, NotVerifiedError
from cellplan.guard import isolated_call
from cellplan.model.motion.motion import Resolution
from cellplan.model.report.exported import ExportJob
from cellplan.model.report.verified_run import ACCESS_TOKEN, VerifiedRun
from cellplan.model.solver import Integrator
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.export.exporters import EXPORTERS
from cellplan.runs.overrides import with_overrides

pytestmark = pytest.mark.usefixtures("stored_solutions")

PACKAGE = Path(__file__).resolve().parents[3] / "cellplan"


@pytest.fixture
def copy(sound: Path, tmp_path: Path) -> Path:
    """A copy to spoil."""
    shutil.copytree(sound, tmp_path / "copy")
    return tmp_path / "copy"


UNLISTED = ("manifest.json", "view.html")


def refusal(run: Path, cell: Path | None = None, kind: type[Exception] = InputError) -> str:
    with pytest.raises(kind) as caught:
        open_gate(run, cell=cell)
    return str(caught.value)


def test_a_sound_run_passes_with_everything_compared(sound: Path) -> None:
    run = open_gate(sound / "run", cell=sound / "cell" / "small.yaml")

    assert run.inputs_compared == tuple(json.loads((sound / "run" / "manifest.json").read_text())["inputs"])
    assert run.remarks == ()
    assert [motion.name for motion in run.motions] == [None]
    assert set(run.motions[0].tables) == {"left", "right", "idle"}
    assert run.file_count == sum(path.is_file() for path in (sound / "run").rglob("*")) - len(UNLISTED)


def test_the_gate_may_be_opened_from_anywhere(sound: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(sound / "cell")

    assert open_gate(Path("../run"), cell=Path("small.yaml")).remarks == ()


def test_a_cell_with_files_of_its_own_must_be_named(sound: Path) -> None:
    assert refusal(sound / "run") == (
        f"{sound / 'run'}: the run depends on files beside its cell file (meshes/block.stl, paths/bow.csv, "
        "robots/elbow.stl, robots/left.yaml, robots/right.urdf): name the cell file 'small.yaml' with --cell, so that "
        "they can be compared"
    )


def test_a_renamed_cell_file_is_still_the_same(copy: Path) -> None:
    (copy / "cell" / "small.yaml").rename(copy / "cell" / "renamed.yaml")

    assert open_gate(copy / "run", cell=copy / "cell" / "renamed.yaml").remarks == ()


def test_only_the_gate_makes_a_verified_run(sound: Path) -> None:
    run = open_gate(sound / "run", cell=sound / "cell" / "small.yaml")
    with pytest.raises(TypeError, match=r"created by cellplan\.open_gate only"):
        replace(run, token=None)
    with pytest.raises(ValueError, match="has motions"):
        replace(run, motions=(), token=ACCESS_TOKEN)


def test_the_seal_is_held_by_the_gate_alone() -> None:
    holders = []
    for path in PACKAGE.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if "ACCESS_TOKEN" in text else ():
            named = [alias.name for alias in node.names] if isinstance(node, ast.ImportFrom) else []
            is_reached = isinstance(node, ast.Attribute) and node.attr == "ACCESS_TOKEN"
            holders += [path.relative_to(PACKAGE).as_posix()] if "ACCESS_TOKEN" in named or is_reached else []
    assert holders == ["runs/gate/open_gate.py"]


def test_every_format_takes_a_job_or_a_verified_run_and_nothing_else() -> None:
    for name, exporter in EXPORTERS.items():
        signature = inspect.signature(exporter.render)
        taken = [parameter.annotation for parameter in signature.parameters.values()]
        assert taken == ([ExportJob] if isinstance(exporter, Dialect) else [VerifiedRun]), name
    assert next(iter(inspect.signature(export_program).parameters.values())).annotation is VerifiedRun


def test_other_versions_are_reported_and_do_not_matter(copy: Path) -> None:
    for name in ("manifest.json", "report.json"):
        edit_json(copy / "run" / name, lambda record: record["versions"].update(pin="3.0.0"))
    page = copy / "run" / "report.html"
    text = page.read_text(encoding="utf-8")
    page.write_text(re.sub(r"(pin</(?:th|td|dt)>\s*<[^>]*>)[^<]*", r"\g<1>3.0.0", text), encoding="utf-8")
    assert page.read_text(encoding="utf-8") != text
    seal_again(copy / "run")

    (remark,) = open_gate(copy / "run", cell=copy / "cell" / "small.yaml").remarks

    assert remark.startswith("made with pin 3.0.0, verified with pin ")


def test_a_report_of_another_version_of_cellplan_may_have_other_keys(copy: Path) -> None:
    def older(record: dict[str, Any]) -> None:
        record["versions"]["cellplan"] = "0.0.1"
        record.pop("speeds", None)

    for name in ("manifest.json", "report.json"):
        edit_json(copy / "run" / name, older)
    seal_again(copy / "run")

    remarks = open_gate(copy / "run", cell=copy / "cell" / "small.yaml").remarks
    assert remarks[0].startswith("made with cellplan 0.0.1, verified with cellplan ")
    assert remarks[1:] == (
        "the page and the texts of the report were not compared: another version of cellplan wrote them",
    )


def test_a_failed_run_is_reported_with_its_reason(tmp_path: Path) -> None:
    cell = write_cell(tmp_path / "cell")
    by_steps = cell.read_text().replace("position_mm: 1,", "position_mm: 0.0001,") + "solver: {integrator: euler}\n"
    cell.write_text(by_steps, encoding="utf-8")
    write_run(solve(load_cell(cell)), tmp_path / "run", keep_rejected=True)

    message = refusal(tmp_path / "run", cell, NotVerifiedError)

    assert message.startswith(f"{tmp_path / 'run'}: the run failed: position error of task 'path': ")
    assert message.endswith("; it has no tables to verify")


@pytest.mark.parametrize(
    ("make", "finding"),
    [
        (lambda path: None, "expected the folder of a run, got nothing"),
        (lambda path: path.write_text("x"), "expected the folder of a run, got a file"),
        (lambda path: path.mkdir(), "expected the folder of a run, got no manifest.json in it"),
    ],
    ids=["nothing", "a file", "an empty folder"],
)
def test_what_is_no_run_is_refused(make: Any, finding: str, tmp_path: Path) -> None:
    make(tmp_path / "run")

    assert refusal(tmp_path / "run") == f"{tmp_path / 'run'}: {finding}"


def test_a_run_without_a_manifest_is_to_be_solved_again(copy: Path) -> None:
    (copy / "run" / "manifest.json").unlink()

    assert refusal(copy / "run").endswith("got a run without a manifest: solve the cell again")


def test_what_was_set_when_the_cell_was_solved_is_reported(sound: Path, tmp_path: Path) -> None:
    cell = load_cell(sound / "cell" / "small.yaml")
    write_run(solve(with_overrides(cell, mode="part_at_rest", duration=1.5, clearance_mm=7)), tmp_path / "run")

    remarks = open_gate(tmp_path / "run", cell=sound / "cell" / "small.yaml").remarks

    assert sorted(remarks) == [
        "checks.clearance_mm was set to 7 when the cell was solved",
        "motion.duration_s was set to 1.5 when the cell was solved",
        "motion.mode was set to 'part_at_rest' when the cell was solved",
    ]


@pytest.mark.parametrize(
    ("choices", "remarks"),
    [
        pytest.param(
            {"integrator": "euler"},
            ["solver.integrator was set to 'euler' when the cell was solved"],
            marks=pytest.mark.slow,  # the last one says so too
        ),
        (
            {"method": "damped_least_squares"},  # brings its integrator along, which nobody chose
            ["solver.method was set to 'damped_least_squares' when the cell was solved"],
        ),
        (
            {"integrator": "euler", "settings": ["solver.seed=4"]},  # an address without an option of its own
            [
                "solver.integrator was set to 'euler' when the cell was solved",
                "solver.seed was set to 4 when the cell was solved",
            ],
        ),
    ],
)
def test_a_run_with_another_integrator_passes_and_states_what_was_chosen(
    sound: Path, tmp_path: Path, choices: dict[str, Any], remarks: list[str]
) -> None:
    cell = load_cell(sound / "cell" / "small.yaml")
    write_run(solve(with_overrides(cell, **choices)), tmp_path / "run")

    run = open_gate(tmp_path / "run", cell=sound / "cell" / "small.yaml")

    assert list(run.remarks) == remarks
    assert run.cell.solver.integrator == Integrator.EULER


def test_how_finely_a_motion_was_resolved_is_left_to_the_planner(sound: Path, tmp_path: Path) -> None:
    solution = solve(load_cell(sound / "cell" / "small.yaml"))
    made = Resolution(integrator=Integrator.ACCURATE, panels=4, nodes=36, sweeps=9, solves=324, error_between=3e-9)
    runs = tuple(replace(run, motion=replace(run.motion, resolution=made)) for run in solution.runs)

    write_run(replace(solution, runs=runs), tmp_path / "run")

    record = json.loads((tmp_path / "run" / "report.json").read_text(encoding="utf-8"))
    assert record["solver"]["resolution"]["error_between_nodes_mm"] == 3e-6
    assert "36 nodes in 4 panels" in (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    assert open_gate(tmp_path / "run", cell=sound / "cell" / "small.yaml").remarks == ()


def test_another_integrator_than_that_of_the_run_is_found_in_its_report(copy: Path) -> None:
    edit_json(copy / "run" / "report.json", lambda record: record["solver"].update(integrator="euler"))
    seal_again(copy / "run")

    assert refusal(copy / "run", copy / "cell" / "small.yaml") == (
        f"{copy / 'run' / 'report.json'}: solver.integrator: expected 'accurate', got 'euler'; solve the cell again"
    )


def test_runs_of_single_tasks_are_verified_one_by_one(sound: Path, tmp_path: Path) -> None:
    cell = load_cell(sound / "cell" / "small.yaml")
    write_run(solve(with_overrides(cell, mode="pairwise")), tmp_path / "run")
    run = open_gate(tmp_path / "run", cell=sound / "cell" / "small.yaml")
    assert [motion.name for motion in run.motions] == ["path"]

    edit_json(
        tmp_path / "run" / "report.json", lambda record: record["tasks"]["path"].update(mean_position_error_mm=0.001)
    )
    seal_again(tmp_path / "run")

    message = refusal(tmp_path / "run", sound / "cell" / "small.yaml")
    assert message.startswith(f"{tmp_path / 'run' / 'report.json'}: tasks.path.mean_position_error_mm: expected ")


def seal_again(run: Path) -> None:
    """Make the manifest agree with the files as they are now."""
    from cellplan.files.input.files import digest

    def change(record: dict[str, Any]) -> None:
        for name in record["files"]:
            data = (run / name).read_bytes()
            record["files"][name] = {"bytes": len(data), "sha256": digest(data)}

    edit_json(run / "manifest.json", change)


@pytest.mark.slow
def test_a_forged_cache_entry_moves_nothing_that_is_verified(copy: Path, cache_folder: Path) -> None:
    cell = copy / "cell" / "small.yaml"
    isolated_call._end_child()  # the next one knows this cache
    load_cell(cell)
    for path in cache_folder.iterdir():
        vertices, *others = store._unpacked(path.read_bytes())
        path.write_bytes(store._packed((vertices + 6.0, *others)))
    store.forget()
    isolated_call._end_child()  # the child has read what is in the files
    forged = load_cell(cell)
    assert forged.obstacles[1].shape.vertices.min() > 5.0
    write_run(solve(forged), copy / "run")

    assert "closest_pairs" in refusal(copy / "run", cell)


@pytest.mark.slow
def test_pictures_in_requested_formats_are_listed_and_held_to_their_digests(sound: Path, tmp_path: Path) -> None:
    cell = sound / "cell" / "small.yaml"
    write_run(solve(load_cell(cell)), tmp_path / "run", formats=["png"])
    picture = tmp_path / "run" / "plots" / "clearance.png"

    run = open_gate(tmp_path / "run", cell=cell)
    assert run.remarks == ()
    assert run.file_count == sum(path.is_file() for path in (tmp_path / "run").rglob("*")) - len(UNLISTED)

    picture.write_bytes(picture.read_bytes() + b"x")
    assert "clearance.png" in refusal(tmp_path / "run", cell)
