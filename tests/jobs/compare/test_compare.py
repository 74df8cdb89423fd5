"""Comparisons of modes, cells and runs, from Python and from the command line."""

import csv
import json
import re
import shutil
from collections.abc import Callable
from concurrent.futures import Future
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from builders.study_trials import InThisProcess
from builders.three_feeds import THREE_FEEDS
from builders.two_phases import PAIR

from cellplan import CompareJob, compare, load_cell, solve
from cellplan.cli.improve.compare import exit_status
from cellplan.cli.main import run
from cellplan.files.cell.changes import read_setting
from cellplan.files.input.files import digest
from cellplan.jobs.compare.compare import evaluate_subject
from cellplan.jobs.compare.result import comparison_files
from cellplan.model.cell.cell import Mode
from cellplan.report.record.figures import KEY, figures_of
from cellplan.study.trial import TrialStatus, Variant

pytestmark = pytest.mark.usefixtures("trials_here", "stored_solutions")

TOLERANCES = tuple(f"tasks.{task}.tolerance.position_mm=0.5" for task in ("first", "second"))
COARSE = ("motion.step_s=0.02", "solver.integrator=accurate", *TOLERANCES)
VOID = {"meta", "br", "hr", "img", "link", "input", "path", "use", "rect", "line"}


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with a cell of two arms that are in each other's way unless they take turns."""
    folder = tmp_path_factory.mktemp("compare")
    (folder / "pair.yaml").write_text(PAIR)
    return folder


@pytest.fixture(scope="module")
def modes(place: Path) -> dict[str, Any]:
    """The modes of the cell, in the study folder ``modes``."""
    return dict(compare(CompareJob(subjects=(place / "pair.yaml",), settings=COARSE), place / "modes"))


@pytest.fixture(scope="module")
def mixed(place: Path, sound: Path) -> dict[str, Any]:
    """A cell beside its own run, in the study folder ``mixed``."""
    job = CompareJob(subjects=(sound / "cell" / "small.yaml", sound / "run"))
    return dict(compare(job, place / "mixed"))


def figures(record: dict[str, Any], name: str) -> dict[str, Any]:
    """Figures of a variant."""
    (result,) = [variant["figures"] for variant in record["variants"] if variant["name"] == name]
    return result


def test_figures_are_those_of_a_plain_solve(sound: Path, mixed: dict[str, Any]) -> None:
    report = json.loads((sound / "run" / "report.json").read_text())
    result = figures(mixed, "cell/small.yaml")
    assert result["cycle_time_s"] == report["cycle_time_s"]
    assert result["min_clearance_mm"] == report["clearance"]["whole"]["minimum_mm"]
    assert result["not_in_program"] == report["not_in_program"]
    for robot, joints in report["joints"].items():
        load = sum(joint["travel"] / joint["velocity_limit"] for joint in joints.values())
        for kind in ("load_s", "phase_load_s", "work_load_s"):
            assert result["robots"][robot][kind] == pytest.approx(load, rel=1e-11)
        assert result["robots"][robot]["role"] == report["motion_share"][robot]["role"]
        assert result["robots"][robot]["motion_share"] == pytest.approx(
            report["motion_share"][robot]["share"], rel=1e-11
        )
    for name, task in report["tasks"].items():
        errors = (task["max_position_error_mm"], task["max_position_error_between_rows_mm"])
        assert result["tasks"][name]["position_error_mm"] == max(errors)


def test_a_run_has_the_figures_of_its_cell_and_says_that_its_proof_was_not_made_again(mixed: dict[str, Any]) -> None:
    cell, stored = figures(mixed, "cell/small.yaml"), figures(mixed, "run")
    assert cell.pop("proof") == "solved"
    proof = stored.pop("proof")
    assert "it depends on files beside its cell file (" in proof
    assert re.search(r"; cellplan verify \S*run --cell small\.yaml compares them$", proof)  # compare has no --cell
    assert cell == stored
    assert "take the same time (1 s), and each load, peak, margin and clearance is the same." in mixed["sentences"][0]
    assert mixed["sentences"][-1].startswith("run was not verified again: ")


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["simultaneous", "pairwise"])
def test_figures_from_records_are_those_from_reports(place: Path, modes: dict[str, Any], mode: str) -> None:
    """A second derivation of the key figures that a sweep has."""
    values = dict(map(read_setting, COARSE)) | {"motion.mode": mode}
    solution = solve(load_cell(place / "pair.yaml").with_values(values))
    expected = figures_of([run.report for run in solution.runs]).record(KEY)
    result = figures(modes, mode)
    assert {key: result[key] for key in expected} == expected
    for kind in ("velocity", "acceleration"):  # every phase works on a task
        assert result[f"work_{kind}_ratio"] == expected[f"max_{kind}_ratio"]  # type: ignore[literal-required]


def test_every_mode_is_a_variant_and_what_breaks_is_named(modes: dict[str, Any]) -> None:
    verdicts = {variant["name"]: variant["status"] for variant in modes["variants"]}
    assert list(verdicts) == [str(mode) for mode in Mode]
    assert verdicts["pairwise"] == "passed"
    assert verdicts["simultaneous"] == verdicts["part_at_rest"] == "failed"
    assert "collision: left/C touches right/C from 0.000 s to 2.000 s" in figures(modes, "simultaneous")["failed"]
    assert modes["sentences"][0] == "Only pairwise passes every check: 4 s."


def test_a_mode_that_cannot_be_planned_is_a_variant_with_its_reason(cells: Path) -> None:
    """A holder that carries the part by a task of its own cannot leave it at rest."""
    job = CompareJob(subjects=(cells / "load_sharing_planar.yaml",))
    outcome = evaluate_subject(job, Variant(2, {"motion.mode": "part_at_rest"}))
    assert (outcome.status, outcome.figures) == ("bad_input", {})
    assert "expected a robot that does not hold the part in the mode part_at_rest" in outcome.reason
    assert outcome.reason.startswith("load_sharing_planar.yaml")


def test_inputs_that_differ_are_listed_with_both_values(mixed: dict[str, Any]) -> None:
    """Those of a run: what was to be found when it was solved."""
    result = {difference["key"]: difference["values"] for difference in mixed["differences"]}
    assert result["robots.right.start_deg"][0] == "auto"
    assert len(result["robots.right.start_deg"][1]) == 3
    assert {key.partition(".")[0] for key in result} == {"robots"}
    assert {key.rpartition(".")[2] for key in result} <= {"start_deg", "home_deg"}


def test_a_run_whose_report_lacks_a_figure_is_a_variant_with_that_reason(sound: Path, tmp_path: Path) -> None:
    """As an older version may have written it: the manifest goes with the report."""
    copy = shutil.copytree(sound / "run", tmp_path / "run")
    report, manifest = copy / "report.json", json.loads((copy / "manifest.json").read_text())
    record = json.loads(report.read_text())
    del record["clearance"]["whole"]
    report.write_text(json.dumps(record))
    data = report.read_bytes()
    manifest["files"]["report.json"] = {"bytes": len(data), "sha256": digest(data)}
    (copy / "manifest.json").write_text(json.dumps(manifest, indent=2, ensure_ascii=False) + "\n")
    outcome = evaluate_subject(CompareJob(subjects=(sound / "run", copy)), Variant(1, {"run": "run"}))
    assert (outcome.status, outcome.figures) == ("bad_input", {})
    assert outcome.reason == (
        f"{report}: expected every figure of a run of this version, got none or another one for 'whole'; "
        "solve the cell again"
    )


class Tags(HTMLParser):
    """Fails when a tag is not closed where it should be."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: list[str] = []

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.seen.append(tag)
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag not in VOID:
            assert self.open.pop() == tag


@pytest.mark.parametrize("study", ["modes", "mixed"])
def test_the_page_is_whole_and_needs_nothing_else(
    place: Path, modes: dict[str, Any], mixed: dict[str, Any], study: str
) -> None:
    page = (place / study / "study.html").read_text()
    tags = Tags()
    tags.feed(page)
    assert tags.open == []
    assert page.count("<svg xmlns=") == 3
    assert "://" not in page.replace("http://www.w3.org", "")
    record = modes if study == "modes" else mixed
    assert all(variant["name"] in page for variant in record["variants"])


def test_the_page_and_table_of_modes_without_a_motion_give_their_reasons(modes: dict[str, Any]) -> None:
    gone = [
        {**variant, "status": "no_solution", "reason": "kuka: lost", "figures": {}} for variant in modes["variants"]
    ]
    files = comparison_files({**modes, "variants": gone}, [None] * len(gone))
    assert set(files) == {"study.json", "study.csv", "study.html"}
    assert files["study.html"].decode().count("<li>kuka: lost</li>") == len(gone)
    assert files["study.csv"].decode().count(",no_solution,") == len(gone)


def test_the_table_has_a_row_for_each_variant(place: Path, modes: dict[str, Any]) -> None:
    rows = list(csv.DictReader((place / "modes" / "study.csv").read_text().splitlines()))
    assert [row["name"] for row in rows] == [variant["name"] for variant in modes["variants"]]
    assert float(rows[1]["load_s left"]) == figures(modes, "pairwise")["robots"]["left"]["load_s"]


@pytest.mark.slow
def test_a_study_that_is_continued_has_the_same_bytes(place: Path, modes: dict[str, Any], tmp_path: Path) -> None:
    study = tmp_path / "study"
    study.mkdir()
    lines = (place / "modes" / "study.jsonl").read_bytes().splitlines(keepends=True)
    (study / "study.jsonl").write_bytes(b"".join(lines[:3]) + lines[3][:40])
    compare(CompareJob(subjects=(place / "pair.yaml",), settings=COARSE), study, resume=True)
    assert {path.name: path.read_bytes() for path in study.iterdir()} == {
        path.name: path.read_bytes() for path in (place / "modes").iterdir()
    }


class InterruptedExecutor(InThisProcess):
    """Evaluates the first job; the others are interrupted."""

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        if not self.numbers:
            return super().submit(function, *arguments, **named)
        future: Future[Any] = Future()
        future.set_exception(KeyboardInterrupt())
        return future


def test_an_interruption_leaves_whole_lines_and_nothing_else(place: Path, modes: Any, tmp_path: Path) -> None:
    job = CompareJob(subjects=(place / "pair.yaml",), settings=COARSE)
    with pytest.raises(KeyboardInterrupt, match=r"1 of \d variants are recorded"):
        compare(job, tmp_path / "study", workers=InterruptedExecutor())
    assert [path.name for path in (tmp_path / "study").iterdir()] == ["study.jsonl"]
    whole = (place / "modes" / "study.jsonl").read_bytes().splitlines(keepends=True)
    assert (tmp_path / "study" / "study.jsonl").read_bytes() == b"".join(whole[:2])


def refusal(*arguments: str, capsys: pytest.CaptureFixture[str]) -> str:
    """What the command says when it refuses its arguments."""
    assert run(["compare", *arguments, "-q"]) == 2
    return capsys.readouterr().err.strip()


def test_wrong_arguments_are_named(place: Path, sound: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cell, one_run, study = str(place / "pair.yaml"), str(sound / "run"), str(place / "study")
    assert refusal(cell, cell, "-o", study, capsys=capsys) == (
        f"error: {cell}: expected every cell and run once, got it again"
    )
    assert refusal(cell, str(place), "-o", study, capsys=capsys) == (
        f"error: {place}: expected the folder of a run, got no manifest.json in it"
    )
    assert refusal(one_run, "-o", study, capsys=capsys) == (
        f"error: {one_run}: expected a cell file, to compare its modes, or several cells and runs, got one run; its "
        f"cell is {one_run}/cell.yaml"
    )
    assert refusal(cell, one_run, "--set", "motion.step_s=0.1", "-o", study, capsys=capsys) == (
        f"error: --set: expected cell files only, as a run stays as it is, got the run {one_run}"
    )
    assert refusal(cell, "--set", "motion.mode=pairwise", "-o", study, capsys=capsys) == (
        "error: --set: expected another key than motion.mode, as all modes are compared; use 'cellplan solve'"
    )
    assert refusal(cell, "--task", "third", "-o", study, capsys=capsys).startswith(
        "error: --task: expected one of first"
    )
    assert not (place / "study").exists()


@pytest.mark.slow
def test_the_command_prints_verdicts_first_and_its_status_is_that_of_a_study(
    place: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = [option for text in COARSE for option in ("--set", text)]
    arguments = [str(place / "pair.yaml"), *settings, "-o", str(tmp_path / "s"), "--workers", "1", "-q"]
    assert run(["compare", *arguments]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("in-turns: ")
    assert lines[0].endswith("modes passed")
    (verdict,) = [line.split()[1:6] for line in lines if line.split()[:1] == ["verdict"]]
    assert [verdict[index] for index in (0, 2, 3)] == ["FAILED", "passed", "FAILED"]
    assert run(["compare", *arguments, "--resume", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["exit"] == 0
    assert record["study"]["counts"]["passed"] >= 1
    assert run(["compare", "none.yaml", "-o", str(tmp_path / "s"), "--json", "-q"]) == 2
    assert json.loads(capsys.readouterr().out)["status"] == "error"


@pytest.mark.parametrize(
    ("counts", "expected"),
    [((1, 2, 0, 0, 0), 0), ((0, 2, 1, 1, 0), 1), ((0, 0, 1, 2, 0), 1), ((0, 0, 0, 3, 0), 2), ((0, 0, 0, 2, 1), 1)],
)
def test_the_exit_status_is_that_of_the_best_variant(counts: tuple[int, ...], expected: int) -> None:
    assert exit_status(dict(zip(TrialStatus, counts, strict=True))) == expected


@pytest.mark.slow
def test_a_mode_whose_starts_suit_no_program_is_solved_without_its_moves(tmp_path: Path) -> None:
    (tmp_path / "feeds.yaml").write_text(THREE_FEEDS)
    job = CompareJob(subjects=(tmp_path / "feeds.yaml",))
    outcome = evaluate_subject(job, Variant(0, {"motion.mode": "simultaneous", "program": {}}))

    assert outcome.status is TrialStatus.FAILED
    assert "with its approach of 30 mm" in outcome.figures["not_in_program"][0]
