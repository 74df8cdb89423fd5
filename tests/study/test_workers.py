"""Worker processes that help with other work than trials."""

import os
from functools import partial
from pathlib import Path

import pytest

from cellplan.errors import CellplanError
from cellplan.study.workers import Workers

HERE = os.getpid()


def end_unless_here(here: int) -> str:
    """End a process that is not the one of the test."""
    if os.getpid() != here:
        os._exit(7)
    return "done here"


def refuse(path: Path) -> None:
    """An error of our own, and a file as a trace."""
    path.write_text("tried")
    raise CellplanError("no")


@pytest.fixture(scope="module")
def workers():
    with Workers(1, first=partial(os.getpid), at_once=1) as result:
        yield result


def test_work_is_done_in_a_process_of_its_own(workers: Workers) -> None:
    value = workers.begin(os.getpid)

    assert value() != HERE


def test_work_whose_process_ends_is_done_here(workers: Workers) -> None:
    assert workers.begin(end_unless_here, HERE)() == "done here"


def test_errors_are_raised_and_those_of_attempts_are_not(workers: Workers, tmp_path: Path) -> None:
    workers.attempt(refuse, tmp_path / "attempt")

    assert (tmp_path / "attempt").read_text() == "tried"
    with pytest.raises(CellplanError, match="no"):
        workers.begin(refuse, tmp_path / "begun")()


def test_work_that_is_stopped_is_done_here(workers: Workers) -> None:
    begun = workers.begin(end_unless_here, HERE)
    workers.stop()

    assert begun() == "done here"
