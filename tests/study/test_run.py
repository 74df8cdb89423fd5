"""Running, recording and continuing of a study whose evaluation is a formula."""

import json
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from cellplan.errors import InputError
from cellplan.study.folder import prepare_folder, run_folder, write_results
from cellplan.study.journal import JOURNAL, Journal
from cellplan.study.run import run_trials
from cellplan.study.trial import Outcome, Trial, TrialStatus
from cellplan.study.variants import Axis, Variant, combinations

HEADER = {"kind": "sweep", "cell": "a cell"}
VARIANTS = combinations([Axis("x", tuple(range(7))), Axis("y", (0.5, 2.0))])


def product(variant: Variant) -> Outcome:
    """A figure that can be computed by hand; odd numbers fail."""
    x, y = variant.values["x"], variant.values["y"]
    assert isinstance(x, int)
    assert isinstance(y, float)
    status = TrialStatus.FAILED if x % 2 else TrialStatus.PASSED
    return Outcome(status=status, reason="odd" if x % 2 else "", figures={"product": x * y})


def refuse(variant: Variant) -> Outcome:
    """An evaluation that must not be called."""
    raise AssertionError(f"variant {variant.number} was evaluated again")


def run(folder: Path, evaluate: object = product, *, resume: bool = False, workers: object = 1) -> list[Trial]:
    """All trials of the study in a folder."""
    prepare_folder(folder, resume=resume)
    with Journal(folder, HEADER, VARIANTS, resume=resume) as journal:
        return run_trials(VARIANTS, evaluate, journal, workers=workers)  # type: ignore[arg-type]


def test_every_variant_has_its_line_with_values_and_figures(tmp_path: Path) -> None:
    trials = run(tmp_path / "study")
    lines = [json.loads(line) for line in (tmp_path / "study" / JOURNAL).read_text().splitlines()]
    assert lines[0] == {"schema": "cellplan.study/1", **HEADER}
    assert lines[1:] == [trial.record for trial in trials]
    assert lines[4] == {
        "trial": 3,
        "values": {"x": 1, "y": 2.0},
        "status": "failed",
        "reason": "odd",
        "figures": {"product": 2.0},
    }


@pytest.mark.parametrize("workers", [2, 5])
def test_the_journal_does_not_depend_on_the_workers(tmp_path: Path, workers: int) -> None:
    run(tmp_path / "one")
    with ThreadPoolExecutor(workers) as executor:
        run(tmp_path / "many", workers=executor)
    assert (tmp_path / "one" / JOURNAL).read_bytes() == (tmp_path / "many" / JOURNAL).read_bytes()


def test_worker_processes_give_the_same_journal(tmp_path: Path) -> None:
    run(tmp_path / "one")
    run(tmp_path / "two", workers=2)
    assert (tmp_path / "one" / JOURNAL).read_bytes() == (tmp_path / "two" / JOURNAL).read_bytes()


@pytest.mark.parametrize("cut", [1, 40, 400])
def test_a_study_that_was_cut_off_anywhere_ends_in_the_same_bytes(tmp_path: Path, cut: int) -> None:
    folder = tmp_path / "study"
    run(folder)
    whole = (folder / JOURNAL).read_bytes()
    (folder / JOURNAL).write_bytes(whole[:-cut])
    left: list[int] = []

    def counted(variant: Variant) -> Outcome:
        left.append(variant.number)
        return product(variant)

    run(folder, counted, resume=True)
    assert (folder / JOURNAL).read_bytes() == whole
    assert left == list(range(len(VARIANTS) - len(left), len(VARIANTS)))
    assert 0 < len(left) < len(VARIANTS)


def test_a_finished_study_evaluates_nothing_again(tmp_path: Path) -> None:
    run(tmp_path / "study")
    assert len(run(tmp_path / "study", refuse, resume=True)) == len(VARIANTS)


def test_an_error_keeps_what_is_recorded(tmp_path: Path) -> None:
    def failing(variant: Variant) -> Outcome:
        if variant.number == 5:
            raise OSError("no more")
        return product(variant)

    with pytest.raises(OSError, match="no more"):
        run(tmp_path / "study", failing)
    assert len((tmp_path / "study" / JOURNAL).read_text().splitlines()) == 6


def edited(tmp_path: Path, old: str, new: str) -> str:
    """The message when the journal was edited before the study is continued."""
    folder = tmp_path / "study"
    run(folder)
    text = (folder / JOURNAL).read_text()
    assert old in text
    (folder / JOURNAL).write_text(text.replace(old, new, 1))
    with pytest.raises(InputError) as raised:
        run(folder, refuse, resume=True)
    return str(raised.value).removeprefix(f"{folder}/")


def test_another_study_is_not_continued(tmp_path: Path) -> None:
    message = edited(tmp_path, '"cell": "a cell"', '"cell": "another"')
    assert message == (
        "study.jsonl:1: expected the study that is to be continued, got one with another value of 'cell'; begin anew "
        "without --resume or in another folder"
    )


def test_other_trials_are_not_continued(tmp_path: Path) -> None:
    assert edited(tmp_path, '"x": 1, "y": 0.5', '"x": 1, "y": 0.6').startswith(
        "study.jsonl:4: expected the trial of variant 2, got another one"
    )
    assert edited(tmp_path, '"status": "failed"', '"status": "fine"').startswith(
        "study.jsonl:4: expected a trial of a study, got something else"
    )


def foreign(folder: Path, names: Sequence[str]) -> str:
    """The message for a folder with other things in it."""
    run(folder)
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("mine")
    with pytest.raises(InputError) as raised:
        run(folder, refuse)
    assert all((folder / name).exists() for name in names)
    return str(raised.value).removeprefix(f"{folder}: ")


@pytest.mark.parametrize("name", ["notes.txt", "runs/0001/notes.txt", "runs/mine.txt", "study.jsonl.old"])
def test_a_folder_with_anything_else_in_it_is_left_alone(tmp_path: Path, name: str) -> None:
    message = foreign(tmp_path / "study", [name])
    shown = "runs/0001" if name.startswith("runs/0001") else name
    assert message == f"holds '{shown}', which no study wrote; choose another folder with -o or empty this one"


def test_results_replace_those_of_an_earlier_study(tmp_path: Path) -> None:
    folder = tmp_path / "study"
    run(folder)
    write_results(folder, {"study.json": b"{}", "study.csv": b"a"})
    run(folder, refuse, resume=True)
    assert sorted(path.name for path in folder.iterdir()) == [JOURNAL]
    assert run_folder(folder, 7) == folder / "runs" / "0007"
