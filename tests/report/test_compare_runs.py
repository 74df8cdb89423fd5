"""The script that compares two trees of runs: it accepts what may differ and finds what must not."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import compare_runs
import pytest


@pytest.fixture
def trees(sound: Path, tmp_path: Path) -> tuple[Path, Path]:
    """Two equal trees; the old one keeps the series in the report, as earlier versions did."""
    for name in ("old", "new"):
        shutil.copytree(sound / "run", tmp_path / name / "pair")
    report, series = tmp_path / "old/pair/report.json", tmp_path / "old/pair/series.json"
    record = json.loads(report.read_text(encoding="utf-8"))
    record["series"] = json.loads(series.read_text(encoding="utf-8"))
    del record["series"]["schema"], record["figures"]
    record["caution"] = "old words"
    report.write_text(json.dumps(record), encoding="utf-8")
    series.unlink()
    return tmp_path / "old", tmp_path / "new"


def texts(trees: tuple[Path, Path]) -> dict[str, str]:
    new = json.loads((trees[1] / "pair/report.json").read_text(encoding="utf-8"))
    return {"old words": new["caution"]}


def test_renamed_texts_new_keys_and_split_series_are_accepted(
    trees: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert not compare_runs.compare_run(trees[0] / "pair", trees[1] / "pair", texts=texts(trees))
    assert capsys.readouterr().out == "pair: 4 tables, 0 differ; report: 0 differences, 1 new keys, 0 texts reworded\n"


def without_a_row(text: str) -> str:
    return text[: text.rstrip().rindex("\n") + 1]


@pytest.mark.parametrize(
    ("file", "change"),
    [
        ("tables/left.csv", without_a_row),
        ("report.json", lambda text: text.replace('"samples": ', '"samples": 1')),
        ("report.json", lambda text: text.replace('"seed"', '"sead"')),
        ("series.json", lambda text: text.replace('"every": 1', '"every": 2')),
    ],
)
def test_any_other_difference_is_found(
    trees: tuple[Path, Path], file: str, change: Callable[[str], str], capsys: pytest.CaptureFixture[str]
) -> None:
    path = trees[1] / "pair" / file
    path.write_text(change(path.read_text(encoding="utf-8")), encoding="utf-8")

    assert compare_runs.compare_run(trees[0] / "pair", trees[1] / "pair", texts=texts(trees))
    assert "differ" in capsys.readouterr().out


@pytest.mark.parametrize(("old", "is_different"), [("other words, no figure", False), ("at most 7.5 mm", True)])
def test_texts_may_be_reworded_round_the_same_figures_only(
    trees: tuple[Path, Path], old: str, is_different: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    report = trees[0] / "pair/report.json"
    record = json.loads(report.read_text(encoding="utf-8"))
    report.write_text(json.dumps(record | {"caution": old}), encoding="utf-8")

    result = compare_runs.compare_run(trees[0] / "pair", trees[1] / "pair", texts={}, may_be_reworded=True)

    assert result is is_different
    assert f"{0 if is_different else 1} texts reworded" in capsys.readouterr().out


def test_rows_of_a_task_are_found_in_the_program_of_several() -> None:
    assert compare_runs.contains(["a", "b", "b", "c"], ["b", "c"])
    assert not compare_runs.contains(["a", "b", "c"], ["a", "c"])
