"""Several formats of one run at once: each as if it were exported alone, refused by name, or written whole."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.plain_dialect import dialect, job_of, read_back

from cellplan import Exported, VerifiedRun, export_program, export_programs, open_gate
from cellplan.errors import InputError
from cellplan.model.report.exported import Interpolation, ProgramRows, RobotRows
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.export import program
from cellplan.programs.export.choice import Choice
from cellplan.programs.export.exporters import EXPORTERS
from cellplan.programs.judgement import judge as judging
from cellplan.programs.judgement import judge_path
from cellplan.programs.rows.rows import full_rows
from cellplan.programs.shared import Shared


@pytest.fixture(scope="module")
def run(sound: Path) -> VerifiedRun:
    return open_gate(sound / "run", cell=sound / "cell" / "small.yaml")


@pytest.fixture(scope="module")
def all_of(run: VerifiedRun, tmp_path_factory: pytest.TempPathFactory) -> tuple[Exported, ...]:
    return export_programs(run, tmp_path_factory.mktemp("all"))


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_all_formats_are_written_or_refused_with_the_reason(all_of: tuple[Exported, ...]) -> None:
    refused = {entry.form: str(entry.refusal) for entry in all_of if entry.refusal is not None}

    assert [entry.form for entry in all_of] == list(EXPORTERS)
    assert set(refused) == {"fanuc_ls", "inform", "krl", "rapid", "urscript", "val3"}
    for form, reason in refused.items():
        assert reason.splitlines() == [
            f"robots.{robot}.controller: expected the controller that plays {form}, got none"
            for robot in ("left", "right", "idle")
        ]
    for entry in all_of:
        assert entry.folder.exists() is (entry.refusal is None)
        assert not entry.is_named


@pytest.mark.parametrize("form", ["csv", "json", "ros2", "stream", "wide"])
def test_a_format_among_several_is_the_same_as_alone(
    form: str, run: VerifiedRun, all_of: tuple[Exported, ...], tmp_path: Path
) -> None:
    result = next(entry for entry in all_of if entry.form == form)

    files = export_program(run, tmp_path / form, form=form)

    assert files == result.files
    assert contents(tmp_path / form) == contents(result.folder)


def test_formats_are_taken_once_in_the_order_in_which_they_are_asked_for(run: VerifiedRun, tmp_path: Path) -> None:
    exports = export_programs(run, tmp_path, formats=["json", "krl", "csv", "json"])

    assert [(entry.form, entry.is_named, entry.refusal is None) for entry in exports] == [
        ("json", True, True),
        ("krl", True, False),
        ("csv", True, True),
    ]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["csv", "json"]


@pytest.mark.parametrize(
    ("formats", "robots", "finding"),
    [
        (["csv", "apt"], (), r"--format: expected one of csv, .*, got 'apt'"),
        ([], (), "--format: expected all, or one or more of csv, "),
        (["all"], ["rigth"], "--robot: expected one of left, right, idle, got 'rigth'"),
    ],
)
def test_what_no_format_could_take_is_refused_before_anything_is_written(
    formats: list[str], robots: list[str], finding: str, run: VerifiedRun, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=finding):
        export_programs(run, tmp_path, formats=formats, choice=Choice(robots=tuple(robots)))

    assert list(tmp_path.iterdir()) == []


def test_a_folder_of_other_things_is_refused_before_anything_is_written(run: VerifiedRun, tmp_path: Path) -> None:
    (tmp_path / "wide").mkdir()
    (tmp_path / "wide" / "mine.txt").write_text("mine", encoding="utf-8")

    with pytest.raises(InputError, match="wide: contains files other than exported programs"):
        export_programs(run, tmp_path, formats=["csv", "wide"])

    assert [path.name for path in tmp_path.iterdir()] == ["wide"]


def test_a_choice_that_a_format_cannot_hold_refuses_that_format_only(run: VerifiedRun, tmp_path: Path) -> None:
    exports = export_programs(run, tmp_path, formats=["csv", "ros2"], choice=Choice(split=50))

    assert str(exports[0].refusal) == "--split: expected no --split with csv, whose files have no limit"
    assert exports[1].files[0] == "left_1_of_1.yaml"


def test_a_format_whose_rows_fail_is_refused_and_leaves_the_others(
    run: VerifiedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A reader that finds one joint elsewhere: the judgement of csv before it may not stand for it."""

    def off(frame: object, files: object) -> tuple[ProgramRows, ...]:
        (first,) = DIALECTS["csv"].read(frame, files)  # type: ignore[arg-type]
        return (replace(first, robots={**first.robots, "right": _moved(first.robots["right"])}),)

    broken = replace(DIALECTS["csv"], name="broken", read=off)
    monkeypatch.setitem(DIALECTS, "broken", broken)  # type: ignore[arg-type]

    exports = export_programs(run, tmp_path, formats=["csv", "broken", "json"])

    assert [entry.refusal is None for entry in exports] == [True, False, True]
    assert "robot 'right': row 21: expected joint B" in str(exports[1].refusal)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["csv", "json"]


def _moved(rows: RobotRows) -> RobotRows:
    q = rows.q.copy()
    q[20, 1] += 1e-3
    return replace(rows, q=q)


def _later(rows: RobotRows) -> RobotRows:
    times = None if rows.times is None else rows.times + 1e-9 * (np.arange(len(rows)) > 0)
    return replace(rows, times=times)


def test_rows_that_are_played_alike_are_judged_once_and_any_others_again(
    run: VerifiedRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    counted: list[object] = []
    result = judging._program_findings

    def counting(*words: object) -> object:
        counted.append(words)
        return result(*words)  # type: ignore[arg-type]

    monkeypatch.setattr(judging, "_program_findings", counting)
    depths: list[object] = []
    evaluate = judge_path.task_depth
    monkeypatch.setattr(judge_path, "task_depth", lambda *of, **at: depths.append(of) or evaluate(*of, **at))
    shared, job = Shared(run), job_of(run, full_rows(run))
    read = read_back(job, decimals=9)

    def count(program: object = None, changed: Callable[[RobotRows], RobotRows] | None = None, **other: object) -> int:
        (first,) = read
        rows = (
            read
            if changed is None
            else (replace(first, robots={**first.robots, "idle": changed(first.robots["idle"])}),)
        )
        counted.clear()
        judging.judge(run, dialect(decimals=9, **other), program or job, rows, shared=shared)  # type: ignore[arg-type]
        return len(counted)

    assert (count(), count()) == (1, 0)
    assert count(changed=_later) == 1
    assert count(interpolation=Interpolation.CUBIC) == 1
    assert count(is_thinned=True) == 1
    assert depths
    depths.clear()
    assert count(program=replace(job, blend=0.1)) == 1
    assert not depths  # rounded rows count with what they may be off: straight motion is the same
    assert count() == 0
    shared = Shared(run)
    assert count() == 1


def test_what_is_worked_out_for_several_formats_is_forgotten_between_calls(
    run: VerifiedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[Shared] = []

    def making(of: VerifiedRun) -> Shared:
        made.append(Shared(of))
        return made[-1]

    monkeypatch.setattr(program, "Shared", making)
    for name in ("first", "second"):
        export_programs(run, tmp_path / name, formats=["csv", "json"])

    assert len(made) == 2
    assert contents(tmp_path / "first") == contents(tmp_path / "second")
