"""Answers of one long search: recorded one by one, and not worked out again after an interruption."""

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from cellplan.errors import InputError, NoSolutionError
from cellplan.study.answers import recorded_answers
from cellplan.study.folder import AHEAD, JOURNAL
from cellplan.study.running import STATE

HEADER = {"kind": "test", "cell": "pair", "inputs": {"cell.yaml": "1f"}}


def squares(folder: Path, *, until: int = 6, resume: bool = False, header: dict[str, object] = HEADER) -> list[int]:
    """The squares of 0 to 5 but those that were recorded; with Ctrl-C as one of them is worked out."""
    worked_out = []

    def square(number: int) -> Callable[[], tuple[int, float]]:
        def work() -> tuple[int, float]:
            if number == until:
                raise KeyboardInterrupt
            worked_out.append(number)
            return number**2, 0.1 * number

        return work

    with recorded_answers(folder, header, resume=resume) as answers:
        assert [answers("square", str(n), square(n)) for n in range(6)] == [[n**2, 0.1 * n] for n in range(6)]
    return worked_out


def test_an_interrupted_search_ends_with_the_journal_of_an_undisturbed_one(tmp_path: Path) -> None:
    assert squares(tmp_path / "whole") == [0, 1, 2, 3, 4, 5]

    with pytest.raises(KeyboardInterrupt, match=r"^interrupted: 4 answers are recorded in .*cut; --resume goes on"):
        squares(tmp_path / "cut", until=4)
    assert squares(tmp_path / "cut", resume=True) == [4, 5]

    assert [path.name for path in (tmp_path / "cut").iterdir()] == [JOURNAL]
    assert (tmp_path / "cut" / JOURNAL).read_bytes() == (tmp_path / "whole" / JOURNAL).read_bytes()
    assert squares(tmp_path / "cut", resume=True) == []
    assert squares(tmp_path / "cut") == [0, 1, 2, 3, 4, 5]  # begun anew


def test_a_line_that_was_cut_off_is_worked_out_again(tmp_path: Path) -> None:
    squares(tmp_path)
    whole = (tmp_path / JOURNAL).read_bytes()
    for length in (len(whole) - 1, len(whole) - 40, whole.index(b"\n") + 1, whole.index(b"\n")):
        (tmp_path / JOURNAL).write_bytes(whole[:length])
        squares(tmp_path, resume=True)
        assert (tmp_path / JOURNAL).read_bytes() == whole


def test_the_record_of_another_search_is_not_continued_and_stays(tmp_path: Path) -> None:
    squares(tmp_path)
    before = (tmp_path / JOURNAL).read_bytes()

    words = r":1: expected the study that is to be continued, got one with another value of 'cell'; begin anew without "
    with pytest.raises(InputError, match=words):
        squares(tmp_path, resume=True, header=HEADER | {"cell": "trio"})

    assert (tmp_path / JOURNAL).read_bytes() == before


def test_an_answer_to_another_question_is_refused(tmp_path: Path) -> None:
    squares(tmp_path)

    words = re.escape(f"{JOURNAL}:2: expected the trial of variant 0, got another one; begin anew without --resume")
    with (
        pytest.raises(InputError, match=words),
        recorded_answers(tmp_path, HEADER, resume=True) as answers,
    ):
        answers("square", "7", lambda: 49)


def test_a_search_without_a_result_leaves_nothing_but_what_was_there(tmp_path: Path) -> None:
    def fail(folder: Path) -> None:
        with recorded_answers(folder, HEADER, resume=False) as answers:
            answers("square", "0", lambda: 0)
            raise NoSolutionError("no square")

    with pytest.raises(NoSolutionError, match="no square"):
        fail(tmp_path / "new")
    assert not (tmp_path / "new").exists()
    (tmp_path / "older").mkdir()
    (tmp_path / "older" / "best.yaml").touch()
    with pytest.raises(NoSolutionError, match="no square"):
        fail(tmp_path / "older")
    assert [path.name for path in (tmp_path / "older").iterdir()] == ["best.yaml"]


def test_two_searches_do_not_write_to_one_folder(tmp_path: Path) -> None:
    with recorded_answers(tmp_path, HEADER, resume=False), pytest.raises(InputError, match="another study is being"):
        squares(tmp_path)
    assert not any((tmp_path / name).exists() for name in (STATE, AHEAD))


def test_figures_are_those_that_are_read_back(tmp_path: Path) -> None:
    numbers = [0.1 + 0.2, -0.0, 1e-300, 2.0**-1074]

    def said() -> Iterator[object]:
        for resume in (False, True):
            with recorded_answers(tmp_path, HEADER, resume=resume) as answers:
                yield answers("numbers", "", lambda: tuple(numbers))

    first, again = said()
    assert json.dumps(first) == json.dumps(again) == json.dumps(numbers)
