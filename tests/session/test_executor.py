"""What takes longer than an answer: results in their order, the newest steps win, and what is said meanwhile."""

import json
import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from builders.editor import coarse_pair
from builders.eventful_jobs import multiples

from cellplan.session.executor import FAILURE, Executor, InlineExecutor, ProcessExecutor, Result
from cellplan.session.session import Session

LIMIT_S = 600.0  # [s] for work to end on a slow machine
X = "robots.arm.base.x_mm"
Answer = Any


@pytest.fixture
def process() -> Iterator[ProcessExecutor]:
    executor = ProcessExecutor()
    yield executor
    executor.close()


def all_of(executor: Executor) -> list[Result]:
    results, begun = list[Result](), time.monotonic()
    while executor.is_busy:
        results += executor.results()
        assert time.monotonic() - begun < LIMIT_S
        time.sleep(0.002)
    return results


@pytest.mark.parametrize("make", [InlineExecutor, ProcessExecutor])
def test_results_come_in_their_order_and_those_of_older_steps_do_not(make: Callable[[], Executor]) -> None:
    executor = make()
    executor.begin(("old", multiples, (7, 10**9)))
    executor.begin(("twos", multiples, (2, 3)), (5, multiples, (5, 2)))

    assert all_of(executor) == [Result("twos", 0), Result("twos", 2), Result("twos", 4), Result(5, 0), Result(5, 5)]
    executor.begin(("old", multiples, (7, 10**9)))
    executor.stop()
    assert not executor.is_busy
    assert executor.results() == []
    executor.begin()
    assert not executor.is_busy
    executor.close()


def test_a_crash_is_a_failure_and_the_next_steps_have_another_process(process: ProcessExecutor) -> None:
    process.begin(("many", multiples, (1, 10**9)))
    first = process.process
    os.kill(first, signal.SIGKILL)

    assert all_of(process)[-1] == Result(FAILURE, "its process was ended (SIGKILL)")
    process.begin(("one", multiples, (1, 1)))
    assert all_of(process) == [Result("one", 0)]
    assert process.process != first


def test_an_error_is_a_failure_in_the_same_process(process: ProcessExecutor) -> None:
    process.begin(("none", multiples, (1, -1)))

    assert all_of(process) == [Result(FAILURE, "ValueError: expected a count, got -1")]
    first = process.process
    process.begin(("one", multiples, (1, 1)))
    assert all_of(process) == [Result("one", 0)]
    assert process.process == first


class HeldExecutor(InlineExecutor):
    """Works out nothing until it is let."""

    is_held = True
    failure = ""

    def results(self) -> list[Result]:
        if self.failure and self.is_busy:
            self.stop()
            return [Result(FAILURE, self.failure)]
        return [] if self.is_held else super().results()


def settled(session: Session) -> Answer:
    """The last answer, of the background or at rest."""
    answer = session.answer()
    while True:
        more = session.settle()
        events = [event["answer"] for event in session.poll() if event["event"] == "answer"]
        if more is None and not events:
            return answer
        answer = [more, *events][-1] or more


@pytest.fixture(scope="module")
def slow(cells: Path) -> tuple[Session, HeldExecutor]:
    """A cell whose motion is one of the planner: its method depends on the clock."""
    executor = HeldExecutor()
    return Session.open(cells / "papers" / "nicolato_pose.yaml", executor=executor), executor


def test_a_cell_is_shown_before_it_is_planned(slow: tuple[Session, HeldExecutor]) -> None:
    session, executor = slow
    record = json.loads(json.dumps(session._engine.page(), allow_nan=False))
    answer = json.loads(json.dumps(session.answer(), allow_nan=False))

    assert record["variables"]
    assert [it["state"] for it in answer["strip"]] == ["working out"]
    assert (answer["state"], answer["figures"], answer["lost_at"]) == ("working out", [], None)
    assert session.settle() is None
    assert session.poll() == []

    executor.is_held = False
    [event] = session.poll()
    executor.is_held = True
    assert event["answer"]["state"] != "unknown"


def test_a_change_of_a_slow_cell_is_answered_at_once_and_only_the_newest_is_worked_out(
    slow: tuple[Session, HeldExecutor], cells: Path
) -> None:
    session, executor = slow
    executor.is_held = True
    waiting = [session.change({X: x}) for x in (3.0, 1.0)]
    executor.is_held = False
    [event] = session.poll()
    answer = event["answer"]

    assert [it["state"] for it in waiting] == ["working out"] * 2
    assert all(it["figures"] == [] and it["advice"] == [] for it in waiting)
    assert any("start" in setting for setting in waiting[1]["history"])  # known before the motion is
    other = Session.open(cells / "papers" / "nicolato_pose.yaml")
    whole = other.change({X: 1.0})
    for key in ("state", "verdict", "figures", "history", "motion", "strip", "is_settled"):
        assert answer[key] == whole[key], key
    assert whole["state"] != "working out"


def test_what_could_not_be_worked_out_is_said_and_nothing_passes(slow: tuple[Session, HeldExecutor]) -> None:
    session, executor = slow
    executor.is_held = True
    session.change({X: 2.0})
    executor.failure = "its process was ended (SIGKILL)"
    answer = settled(session)
    executor.failure, executor.is_held = "", False

    assert (answer["state"], answer["is_settled"]) == ("unknown", True)
    assert answer["verdict"] == "unknown: its process was ended (SIGKILL)"
    assert session.change({X: 1.5})["state"] not in {"unknown", "working out"}


def test_a_value_changed_before_a_layout_is_planned_gets_its_start_in_the_same_step(
    cells: Path, tmp_path: Path
) -> None:
    executor = HeldExecutor()
    with Session.open(coarse_pair(cells, tmp_path), executor=executor) as session:
        assert session.change({"robots.right.base.x_mm": 1901.0})["history"] == ["--set robots.right.base.x_mm=1901"]
        executor.is_held = False
        answer = settled(session)

        assert len(answer["history"]) > 1
        assert answer["state"] == "planned"
        assert session.do("undo")["history"] == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["planar_pair", "in_turn", "papers/nicolato_circle"])
def test_answers_do_not_depend_on_where_they_are_worked_out(cells: Path, name: str) -> None:
    path = cells / f"{name}.yaml"
    with Session.open(path) as here, Session.open(path, executor=ProcessExecutor()) as other:
        address = next(it for it in here.answer()["values"] if it.endswith(".base.x_mm"))
        answers = list[Answer]()
        for session in (here, other):
            begun = time.monotonic()
            while not settled(session)["is_settled"]:
                assert time.monotonic() - begun < LIMIT_S
                time.sleep(0.01)
            session.change({address: session.answer()["values"][address] + 2.0})
            while not (answer := settled(session))["is_settled"]:
                assert time.monotonic() - begun < LIMIT_S
                time.sleep(0.01)
            answers.append({key: value for key, value in answer.items() if key not in {"version", "number"}})

    assert answers[0] == answers[1]
