"""Processes whose work sends events: order, errors, crashes, and an end with their owner."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from builders import eventful_jobs

from cellplan.guard import Ended, EventProcess
from cellplan.guard.event_process import DROPPED

LIMIT_S = 60.0  # [s] for an event to come on a slow machine


@pytest.fixture
def process() -> Iterator[EventProcess]:
    process = EventProcess()
    yield process
    process.end()


def until(process: EventProcess, is_last: Callable[[Any], bool]) -> list[Any]:
    """Events up to one."""
    events, begun = list[Any](), time.monotonic()
    while not (events and is_last(events[-1])):
        events += process.poll()
        assert time.monotonic() - begun < LIMIT_S
        time.sleep(0.005)
    return events


def is_ended(event: object) -> bool:
    return isinstance(event, Ended)


def lives(number: int) -> bool:
    """Whether a process runs; one that has ended but is not yet waited for does not."""
    try:
        return "\nState:\tZ" not in Path(f"/proc/{number}/status").read_text(encoding="utf-8")
    except OSError:
        return False


def test_events_come_in_order_before_the_end_of_their_work(process: EventProcess) -> None:
    process.begin(eventful_jobs.count, 3)
    first = until(process, is_ended)
    process.begin(eventful_jobs.count, 1)
    process.begin(eventful_jobs.count, 2)

    assert process.left == 2
    assert first == [0, 1, 2, Ended()]
    assert until(process, lambda event: is_ended(event) and not process.left) == [0, Ended(), 0, 1, Ended()]


def test_nobody_waits_for_work_that_is_larger_than_a_pipe(process: EventProcess) -> None:
    process.begin(eventful_jobs.measure, bytes(10_000_000))
    process.begin(eventful_jobs.count, 1)

    assert process.left == 2  # and not one that a full pipe would have ended before
    assert until(process, lambda event: is_ended(event) and not process.left)[0] == 10_000_000


@pytest.mark.parametrize(
    ("job", "error"),
    [
        (eventful_jobs.refuse, "cell.yaml:3: expected a robot, got a fish"),
        (eventful_jobs.fail, "ZeroDivisionError: integer division or modulo by zero"),
    ],
)
def test_an_error_ends_the_work_but_not_the_process(process: EventProcess, job: Any, error: str) -> None:
    process.begin(job)

    assert until(process, is_ended)[-1] == Ended(error)
    process.begin(eventful_jobs.count, 1)
    assert until(process, is_ended) == [0, Ended()]


def test_a_crash_is_an_event(process: EventProcess) -> None:
    process.begin(eventful_jobs.kill)

    assert until(process, is_ended) == ["begun", Ended("its process was ended (SIGKILL)", is_crash=True)]
    assert not process.is_usable
    assert not process.left


def test_work_is_ended_in_its_midst(process: EventProcess) -> None:
    process.begin(eventful_jobs.say_number)
    [number] = until(process, lambda event: isinstance(event, int))

    process.end()

    assert number == process.number
    assert not lives(number)


@pytest.mark.parametrize("job", [eventful_jobs.go_on_for_ever, eventful_jobs.send_for_ever])
def test_dropped_work_ends_in_its_midst_and_its_process_does_the_next(process: EventProcess, job: Any) -> None:
    process.begin(job)
    process.begin(eventful_jobs.go_on_for_ever)  # waits
    until(process, lambda _: True)

    process.drop()
    process.begin(eventful_jobs.say_number)
    events = until(process, lambda event: event == process.number)

    assert [event for event in events if is_ended(event)] == [Ended(DROPPED)] * 2
    assert set(events[:-1]) <= {"x" * 300_000, "begun", Ended(DROPPED)}
    assert process.left == 1


def test_a_process_may_be_told_to_drop_work_before_it_runs(process: EventProcess) -> None:
    for _ in range(20):
        process.begin(eventful_jobs.go_on_for_ever)
        process.drop()
    process.begin(eventful_jobs.count, 1)

    assert until(process, lambda event: event == Ended()) == [*[Ended(DROPPED)] * 20, 0, Ended()]


def test_a_killed_owner_takes_its_processes_along() -> None:
    program = """
        import sys, time
        from builders import eventful_jobs
        from cellplan.guard import EventProcess
        process = EventProcess()
        process.begin(eventful_jobs.say_number)
        while not (events := process.poll()):
            time.sleep(0.01)
        print(events[0], flush=True)
        time.sleep(600.0)
    """
    tests = Path(__file__).resolve().parents[1]
    owner = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(program)],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(tests)},
    )
    assert owner.stdout is not None
    number = int(owner.stdout.readline())
    assert lives(number)

    owner.send_signal(signal.SIGKILL)
    owner.wait()

    begun = time.monotonic()
    while lives(number):
        assert time.monotonic() - begun < LIMIT_S
        time.sleep(0.01)
