"""Work done aside: in a child that is no more than a help, and gone when it is no longer needed."""

import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator

import pytest
from builders import crashing_jobs

from cellplan.guard import BackgroundProcess
from cellplan.guard.background import processors

pytestmark = [
    pytest.mark.skipif(processors() < 2, reason="without a second processor nothing is done aside"),
    pytest.mark.usefixtures("two_processors"),
]


@pytest.fixture
def lateral() -> Iterator[BackgroundProcess]:
    with BackgroundProcess() as help_:
        yield help_


def lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def test_work_is_done_by_one_other_process_while_this_one_goes_on(lateral: BackgroundProcess) -> None:
    first = lateral.begin(crashing_jobs.process)
    second = lateral.begin(crashing_jobs.process)

    assert first() == second() != os.getpid()


def test_a_result_can_be_asked_for_twice_and_in_any_order(lateral: BackgroundProcess) -> None:
    results = [lateral.begin(crashing_jobs.same, number) for number in range(5)]

    assert [result() for result in reversed(results)] == [4, 3, 2, 1, 0]
    assert results[0]() == 0


def test_large_work_both_ways_does_not_get_stuck(lateral: BackgroundProcess) -> None:
    load = b"x" * 5_000_000  # many times what a pipe holds
    results = [lateral.begin(crashing_jobs.same, load) for _ in range(4)]

    assert all(result() == load for result in results)


def test_what_the_child_cannot_do_is_done_here(lateral: BackgroundProcess) -> None:
    crashed = lateral.begin(crashing_jobs.leave_unless_in, os.getpid())
    waiting = lateral.begin(crashing_jobs.process)

    assert crashed() == "done at home"
    assert waiting() == os.getpid()
    assert lateral.begin(crashing_jobs.process)() == os.getpid()


def test_what_cannot_be_sent_is_done_here(lateral: BackgroundProcess) -> None:
    lock = threading.Lock()

    assert lateral.begin(crashing_jobs.same, lock)() is lock


def test_an_exception_is_that_of_the_work_itself(lateral: BackgroundProcess) -> None:
    result = lateral.begin(crashing_jobs.stumble)

    with pytest.raises(KeyError, match="word"):
        result()


def test_without_leave_to_start_a_process_all_is_done_here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/nowhere/python")

    with BackgroundProcess() as lateral:
        assert lateral.begin(crashing_jobs.process)() == os.getpid()


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="only Linux binds a process to one processor")
def test_without_a_second_processor_all_is_done_here() -> None:
    code = (
        "import os; os.sched_setaffinity(0, [min(os.sched_getaffinity(0))])\n"
        "from cellplan.guard import BackgroundProcess\n"
        "with BackgroundProcess() as aside: print(aside.begin(os.getpid)() == os.getpid())"
    )

    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert run.stdout == "True\n"


@pytest.mark.skipif(os.name == "nt", reason="asks for a process as Linux and macOS do")
def test_the_child_is_gone_at_the_end_even_in_the_middle_of_its_work() -> None:
    began = time.monotonic()
    with BackgroundProcess() as lateral:
        child = lateral.begin(crashing_jobs.process)()
        lateral.begin(crashing_jobs.sleep_long)
        lateral.begin(crashing_jobs.sleep_long)

    assert not lives(child)
    assert time.monotonic() - began < 30.0


@pytest.mark.skipif(os.name == "nt", reason="asks for a process as Linux and macOS do")
def test_an_exception_of_this_process_ends_the_child_as_well() -> None:
    children = []

    def interrupted() -> None:
        with BackgroundProcess() as lateral:
            children.append(lateral.begin(crashing_jobs.process)())
            lateral.begin(crashing_jobs.loop_forever)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()

    assert not lives(children[0])
