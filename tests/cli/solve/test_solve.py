"""Solving a cell from the shell: what is said, what is written, how it ends."""

import json
import math
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from builders.two_phases import PAIR

from cellplan.cli.main import run
from cellplan.cli.terminal import progress

pytestmark = pytest.mark.usefixtures("stored_solutions")


@pytest.fixture
def coarse_cell(cells: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The four robots on a clock of 5 ms, which is quick; the gain goes with the step. No line tells of slow work."""
    monkeypatch.setattr(progress, "LINE_EVERY_S", math.inf)
    text = (cells / "four_robots.yaml").read_text(encoding="utf-8")
    text = text.replace("step_s: 0.001", "step_s: 0.005").replace("gain_per_s: 650", "gain_per_s: 200")
    path = tmp_path / "coarse.yaml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture
def hasty_pair(cells: Path, tmp_path: Path) -> Path:
    """The planar pair with a tenth of a second for its motion, on a clock of 5 ms: joints are too fast."""
    text = (cells / "planar_pair.yaml").read_text(encoding="utf-8")
    path = tmp_path / "hasty.yaml"
    path.write_text(text.replace("step_s: 0.001", "step_s: 0.005"), encoding="utf-8")
    return path


def test_a_sound_cell_is_reported_and_written(
    sound: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(progress, "LINE_EVERY_S", math.inf)
    cell, folder = sound / "cell" / "small.yaml", tmp_path / "out"

    status = run(["solve", str(cell), "-o", str(folder)])

    out, err = capsys.readouterr()
    assert (status, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == "small-pair: passed"
    assert lines[-4:] == [
        f"report: {folder / 'report.html'}",
        f"tables: {folder / 'tables'}",
        f"next: cellplan view {folder} --cell {cell}",
        f"next: cellplan export {folder} --format csv --cell {cell}",
    ]
    assert sorted(path.name for path in (folder / "tables").iterdir()) == [
        "clock.csv",
        "idle.csv",
        "left.csv",
        "right.csv",
    ]


def test_a_machine_gets_one_object_with_the_whole_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cell, folder = tmp_path / "cell.yaml", tmp_path / "out"
    cell.write_text(PAIR, encoding="utf-8")

    status = run(["solve", str(cell), "-o", str(folder), "--mode", "part_at_rest", "--task", "first", "--json"])

    reported = json.loads(capsys.readouterr().out)
    assert (status, reported["exit"]) == (0, 0)
    assert (reported["schema"], reported["status"]) == ("cellplan.solve/1", "passed")
    assert reported["report_path"] == str(folder / "report.html")
    written = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    series = json.loads((folder / "series.json").read_text(encoding="utf-8"))
    assert len(series["times_s"]) == written["samples"]
    assert reported["report"] == written
    assert list(reported["report"]["tasks"]) == ["first"]


def test_a_failed_cell_ends_with_one_and_leaves_no_tables(
    hasty_pair: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "out"

    status = run(["solve", str(hasty_pair), "-o", str(folder), "--duration", "0.1"])

    out = capsys.readouterr().out
    assert status == 1
    assert out.startswith("planar-pair: failed\n")
    assert "exceeds its velocity limit" in out
    assert (folder / "report.html").is_file()
    assert not (folder / "tables").exists()
    assert not (folder / "rejected").exists()


def test_rejected_tables_are_kept_on_request(
    hasty_pair: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "out"

    status = run(["solve", str(hasty_pair), "-o", str(folder), "--duration", "0.1", "--keep-rejected"])

    assert status == 1
    assert f"tables: {folder / 'rejected'}" in capsys.readouterr().out
    assert "# verdict: REJECTED" in (folder / "rejected" / "right.csv").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("option", "value", "finding"),
    [
        (
            "--mode",
            "pair",
            "CELL with motion.mode = pair: motion.mode: expected simultaneous, pairwise, part_at_rest or "
            "semi_coordinated",
        ),
        ("--task", "circel", "error: --task: expected one of circle, rhombus, rectangle, got 'circel'"),
        ("--method", "magic", "CELL with solver.method = magic: solver.method: expected weighted_pseudo_inverse, "),
        (
            "--integrator",
            "rk4",
            "CELL with solver.integrator = rk4: solver.integrator: expected auto, accurate or euler",
        ),
        ("--set", "solver.sed=3", "CELL with solver.sed = 3: solver.sed: unknown key, did you mean 'seed'?; allowed: "),
        (
            "--duration",
            "-4",
            "CELL with motion.duration_s = -4: motion.duration_s: expected a positive number of seconds, got -4",
        ),
        (
            "--duration",
            "nan",
            "error: CELL with motion.duration_s = nan: expected finite numbers, got nan",
        ),
    ],
)
def test_a_wrong_choice_is_refused_before_anything_is_done(
    coarse_cell: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], option: str, value: str, finding: str
) -> None:
    folder = tmp_path / "out"

    status = run(["solve", str(coarse_cell), "-o", str(folder), option, value])

    out, err = capsys.readouterr()
    assert (status, out) == (2, "")
    assert err.startswith(finding.replace("CELL", str(coarse_cell)))
    assert err.count("\n") == 1
    assert not folder.exists()


@pytest.mark.slow
def test_the_integrator_is_chosen_on_the_command_line_and_reported(
    coarse_cell: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "out"

    status = run(["solve", str(coarse_cell), "-o", str(folder), "--task", "circle", "--integrator", "euler"])

    capsys.readouterr()
    record = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    assert (status, record["solver"]["integrator"], record["solver"]["accuracy_mm"]) == (0, "euler", 1e-4)
    assert "Euler steps of 5 ms; pose errors are fed back" in (folder / "report.html").read_text(encoding="utf-8")
    assert "integrator: euler" in (folder / "cell.yaml").read_text(encoding="utf-8")


def test_an_integrator_that_does_not_go_with_the_cell_names_its_line(
    coarse_cell: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = coarse_cell.read_text(encoding="utf-8").replace("weighted_pseudo_inverse", "jacobian_transpose")
    coarse_cell.write_text(text, encoding="utf-8")
    line = 1 + text[: text.index("jacobian_transpose")].count("\n")

    status = run(["solve", str(coarse_cell), "-o", str(tmp_path / "out"), "--integrator", "accurate"])

    assert status == 2
    assert capsys.readouterr().err == (
        f"{coarse_cell}:{line} with solver.integrator = accurate: solver.method: expected weighted_pseudo_inverse in "
        "the accurate mode, got 'jacobian_transpose', "
        "which follows the path only as far as the feedback of its errors takes it; "
        "choose weighted_pseudo_inverse, or choose solver.integrator: euler\n"
    )


def test_a_folder_with_other_things_in_it_is_never_replaced(
    coarse_cell: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "thesis.tex").write_text("years of work", encoding="utf-8")

    status = run(["solve", str(coarse_cell), "-o", str(folder)])

    assert status == 2
    assert "thesis.tex" in capsys.readouterr().err
    assert (folder / "thesis.tex").read_text(encoding="utf-8") == "years of work"


def test_findings_about_a_cell_come_all_at_once_each_with_its_line(
    coarse_cell: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = coarse_cell.read_text(encoding="utf-8")
    text = text.replace("duration_s: 4", "duration_s: -4").replace("model: kuka_kr6", "modle: kuka_kr6")
    coarse_cell.write_text(text, encoding="utf-8")

    status = run(["solve", str(coarse_cell), "--json"])

    out, err = capsys.readouterr()
    assert status == 2
    lines = err.splitlines()
    assert len(lines) >= 2
    assert all(line.startswith(f"{coarse_cell}:") for line in lines)
    assert any("did you mean 'model'?" in line for line in lines)
    reported = json.loads(out)
    assert (reported["status"], reported["exit"], reported["errors"]) == ("error", 2, lines)


@pytest.mark.slow
def test_plots_are_vector_pictures_unless_others_are_requested(
    hasty_pair: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["solve", str(hasty_pair), "--duration", "0.1", "-q", "-o"]
    run([*options, str(tmp_path / "plain")])
    run([*options, str(tmp_path / "more"), "--plots", "png"])

    plain = {path.name for path in (tmp_path / "plain" / "plots").iterdir()}
    assert {Path(name).suffix for name in plain} == {".svg"}
    more = {path.name for path in (tmp_path / "more" / "plots").iterdir()}
    assert more == plain | {Path(name).with_suffix(".png").name for name in plain}
    page = (tmp_path / "more" / "report.html").read_bytes()
    assert page == (tmp_path / "plain" / "report.html").read_bytes()
    listed = json.loads((tmp_path / "more" / "manifest.json").read_text(encoding="utf-8"))["files"]
    assert {f"plots/{name}" for name in more} <= set(listed)
    capsys.readouterr()


def test_an_unknown_format_of_plots_is_refused_before_the_cell_is_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status = run(["solve", str(tmp_path / "missing.yaml"), "--plots", "gif"])

    assert status == 2
    assert "plots: expected one of png, pdf, got 'gif'" in capsys.readouterr().err


def test_solving_imports_no_plotting_library(hasty_pair: Path, tmp_path: Path) -> None:
    arguments = ["solve", str(hasty_pair), "--duration", "0.1", "-q", "-o", str(tmp_path / "run")]
    program = f"import sys; from cellplan.cli.main import run; run({arguments}); sys.exit('matplotlib' in sys.modules)"

    completed = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)

    assert completed.returncode == 0, completed.stderr
    assert list((tmp_path / "run" / "plots").glob("*.svg"))


def test_the_lines_to_type_next_do_what_they_say(
    hasty_pair: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["solve", "hasty.yaml", "--set", "motion.duration_s=3.5", "-q"]) == 0
    told = capsys.readouterr().out
    assert run(["solve", "hasty.yaml", "--duration", "0.4", "--set", "motion.step_s=0.0005", "-o", "fast", "-q"]) == 1
    told += capsys.readouterr().out

    steps = [line.removeprefix("next: cellplan ") for line in told.splitlines() if line.startswith("next: ")]

    assert [step.split()[0] for step in steps] == ["view", "export", "view", "fastest", "layout"]
    for step in steps[:3]:
        assert run([*shlex.split(step), "-q"]) == 0, step
    assert steps[3] == "fastest hasty.yaml --set motion.duration_s=0.4 --set motion.step_s=0.0005"
