"""Running, recording and continuing of a study whose evaluation is a formula."""

import json
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest
from builders.study_trials import InThisProcess, not_finite_at_5, product, product_until_5

from cellplan.errors import InputError, NotFiniteError, StudyStoppedError
from cellplan.study.folder import AHEAD, JOURNAL, run_folder, write_results
from cellplan.study.study import Study
from cellplan.study.variants import Axis, combinations

HEADER = {"kind": "sweep", "cell": "a cell"}
VARIANTS = combinations([Axis("x", tuple(range(7))), Axis("y", (0.5, 2.0))])


def run(folder: Path, evaluate: Any = product, *, resume: bool = False, workers: Any = None) -> list[dict[str, Any]]:
    """All trials of the study in a folder."""
    study = Study.of_variants(folder, HEADER, VARIANTS)
    finished = study.run(evaluate, workers=workers or InThisProcess(), resume=resume)
    return [trial.record for trial in finished.trials]


def test_every_variant_has_its_line_with_values_and_figures(tmp_path: Path) -> None:
    trials = run(tmp_path / "study")
    lines = [json.loads(line) for line in (tmp_path / "study" / JOURNAL).read_text().splitlines()]
    assert lines[0] == {"schema": "cellplan.study/1", **HEADER}
    assert lines[1:] == trials
    assert lines[4] == {
        "trial": 3,
        "values": {"x": 1, "y": 2.0},
        "status": "failed",
        "reason": "odd",
        "figures": {"product": 2.0},
    }


class LastFirst(InThisProcess):
    """Ends trials in the reverse of the order in which they were begun."""

    count = 5

    def __init__(self) -> None:
        super().__init__()
        self.held: list[tuple[Future[Any], Future[Any]]] = []

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        given: Future[Any] = Future()
        self.held.append((given, super().submit(function, *arguments, **named)))
        if len(self.held) == self.count or arguments[1].number == len(VARIANTS) - 1:
            while self.held:
                given_last, done = self.held.pop()
                given_last.set_result(done.result())
        return given


def test_the_journal_does_not_depend_on_the_order_in_which_trials_end(tmp_path: Path) -> None:
    run(tmp_path / "one")
    run(tmp_path / "many", workers=LastFirst())
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
    executor = InThisProcess()
    run(folder, resume=True, workers=executor)
    assert (folder / JOURNAL).read_bytes() == whole
    left = executor.numbers
    assert left == list(range(len(VARIANTS) - len(left), len(VARIANTS)))
    assert 0 < len(left) < len(VARIANTS)


def test_a_finished_study_evaluates_nothing_again(tmp_path: Path) -> None:
    run(tmp_path / "study")
    executor = InThisProcess()
    assert len(run(tmp_path / "study", resume=True, workers=executor)) == len(VARIANTS)
    assert executor.numbers == []


def test_a_study_that_cannot_go_on_keeps_what_is_recorded(tmp_path: Path) -> None:
    with pytest.raises(StudyStoppedError, match="no more"):
        run(tmp_path / "study", product_until_5)
    assert len((tmp_path / "study" / JOURNAL).read_text().splitlines()) == 6


def test_a_figure_that_is_no_number_ends_the_study_and_is_no_lost_trial(tmp_path: Path) -> None:
    with pytest.raises(NotFiniteError, match="table/turn: expected a finite speed"):
        run(tmp_path / "study", not_finite_at_5)
    assert len((tmp_path / "study" / JOURNAL).read_text().splitlines()) == 6


def test_a_trial_that_ended_before_others_is_not_lost(tmp_path: Path) -> None:
    folder = tmp_path / "study"
    run(folder)
    whole = (folder / JOURNAL).read_bytes()
    lines = whole.splitlines(keepends=True)
    (folder / JOURNAL).write_bytes(b"".join(lines[:4]))
    (folder / AHEAD).write_bytes(lines[7] + lines[6] + lines[9][:-5])
    executor = InThisProcess()
    run(folder, resume=True, workers=executor)
    assert (folder / JOURNAL).read_bytes() == whole
    assert executor.numbers == [3, 4, *range(7, len(VARIANTS))]
    assert not (folder / AHEAD).exists()


def edited(tmp_path: Path, old: str, new: str) -> str:
    """The message when the journal was edited before the study is continued."""
    folder = tmp_path / "study"
    run(folder)
    text = (folder / JOURNAL).read_text()
    assert old in text
    (folder / JOURNAL).write_text(text.replace(old, new, 1))
    with pytest.raises(InputError) as raised:
        run(folder, resume=True)
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
        run(folder)
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
    run(folder, resume=True)
    assert sorted(path.name for path in folder.iterdir()) == [JOURNAL]
    assert run_folder(folder, 7) == folder / "runs" / "0007"
