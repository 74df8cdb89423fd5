"""Work done in copies of this process: no more than a help, and gone when they are no longer needed."""

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Iterator

import pytest
from builders import crashing_jobs

from cellplan.guard import ForkedWork

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="only Linux lets copies use the system's libraries"),
    pytest.mark.usefixtures("two_processors"),
]
Progress = Callable[[str, float], None]


def silent(_stage: str, _share: float) -> None:
    """Do not listen."""


@pytest.fixture
def work() -> Iterator[ForkedWork]:
    if threading.active_count() > 1:
        pytest.skip("the runner of the tests has threads of its own")
    with ForkedWork(silent) as work:
        yield work


def lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def process(progress: Progress) -> int:
    """Who works."""
    progress("working", 0.5)
    return os.getpid()


def test_work_is_done_by_other_processes_while_this_one_goes_on(work: ForkedWork) -> None:
    first, second = work.begin(process), work.begin(process)

    assert len({first(), second(), os.getpid()}) == 3
    assert first() == first()
    assert not lives(first())


def test_no_more_copies_work_than_there_are_processors(work: ForkedWork) -> None:
    results = [work.begin(process) for _ in range(3)]

    assert results[2]() == os.getpid()


def test_a_copy_has_what_this_process_has_and_its_answer_may_be_large(work: ForkedWork) -> None:
    lock, load = threading.Lock(), b"x" * 5_000_000  # cannot be sent; many times what a pipe holds

    result = work.begin(lambda progress: (lock.locked(), load * 2))

    assert result() == (False, load * 2)


def test_what_a_copy_cannot_do_is_done_here(work: ForkedWork) -> None:
    home = os.getpid()

    assert work.begin(lambda progress: crashing_jobs.leave_unless_in(home))() == "done at home"
    with pytest.raises(KeyError, match="word"):
        work.begin(lambda progress: crashing_jobs.stumble())()
    unsent = work.begin(lambda progress: threading.Lock())()
    assert not unsent.locked()


def test_progress_of_a_copy_is_told_where_its_result_is_waited_for() -> None:
    if threading.active_count() > 1:
        pytest.skip("the runner of the tests has threads of its own")
    told: list[tuple[str, float]] = []

    def slow(progress: Progress) -> int:
        for step in range(5):
            time.sleep(0.12)
            progress("slow work", step / 5.0)
        return 7

    with ForkedWork(lambda *words: told.append(words)) as work:
        assert work.begin(slow)() == 7

    assert told
    assert {stage for stage, _ in told} == {"slow work"}
    assert [share for _, share in told] == sorted(share for _, share in told)


def test_beside_other_threads_all_is_done_here(work: ForkedWork) -> None:
    over = threading.Event()
    other = threading.Thread(target=over.wait)
    other.start()

    assert work.begin(process)() == os.getpid()

    over.set()
    other.join()


def test_without_a_second_processor_all_is_done_here() -> None:
    code = (
        "import os; os.sched_setaffinity(0, [min(os.sched_getaffinity(0))])\n"
        "from cellplan.guard import ForkedWork\n"
        "with ForkedWork(print) as work: print(work.begin(lambda progress: os.getpid())() == os.getpid())"
    )

    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert run.stdout == "True\n"


def test_copies_are_gone_at_the_end_and_after_an_exception_even_in_the_middle_of_their_work() -> None:
    if threading.active_count() > 1:
        pytest.skip("the runner of the tests has threads of its own")
    reading, writing = os.pipe()

    def endless(progress: Progress) -> None:
        os.write(writing, os.getpid().to_bytes(4, "little"))
        crashing_jobs.loop_forever()

    def interrupted() -> None:
        with ForkedWork(silent) as work:
            work.begin(endless)
            children.append(int.from_bytes(os.read(reading, 4), "little"))
            raise KeyboardInterrupt

    children: list[int] = []
    with pytest.raises(KeyboardInterrupt):
        interrupted()

    os.close(reading)
    os.close(writing)
    assert not lives(children[0])


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGTERM])
def test_a_copy_ends_with_the_process_that_it_is_a_copy_of(end: signal.Signals) -> None:
    code = textwrap.dedent("""
        import os, time
        from cellplan.guard import ForkedWork
        from cellplan.guard import forked
        forked.processors = lambda: 2

        def endless(progress):
            print(os.getpid(), flush=True)
            while True:
                pass

        with ForkedWork(print) as work:
            work.begin(endless)()
    """)
    parent = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    child = int(parent.stdout.readline())

    parent.send_signal(end)
    parent.wait()

    deadline = time.monotonic() + 30.0
    while lives(child) and time.monotonic() < deadline:
        time.sleep(0.01)
    parent.stdout.close()
    assert not lives(child)


def test_a_copy_that_never_ends_is_not_waited_for_for_ever(work: ForkedWork, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cellplan.guard.forked.LONGEST_S", 0.3)
    home = os.getpid()

    def hang(progress: Progress) -> int:
        while os.getpid() != home:
            time.sleep(0.05)
        return os.getpid()

    assert work.begin(hang)() == home
    assert work.is_possible  # no thread of the waiting is left behind
