"""Several pages of one session: each sees what the others change, and the newest change wins."""

import asyncio
import json
import threading
import time
from contextlib import ExitStack
from typing import Any

import pytest
from builders.edit_server import LIMIT_S, Served, served

from cellplan.cli.edit.responses import ANSWER, MOST_EVENTS, Events


def body_of(answer: tuple[int, dict[str, str], bytes]) -> Any:
    assert answer[0] == 200
    return json.loads(answer[2])


def test_a_change_is_seen_in_every_other_tab_and_what_settles_in_all() -> None:
    with served() as page, page.events(tab=1) as first, page.events(tab=2) as second:
        answer = body_of(page.post("/change", {"tab": 1, "number": 7, "values": {"x": 5.0}}))
        of_first, of_second = [next(first)], [next(second), next(second)]

    assert (answer["number"], answer["values"], answer["is_settled"]) == (7, {"x": 5.0, "y": 2.0}, False)
    assert of_second[0] == {"event": "answer", "answer": answer}
    assert of_first[0] == of_second[1]
    assert of_first[0]["answer"]["is_settled"]


def test_what_would_help_is_found_out_after_an_answer_and_before_it_settles() -> None:
    with served() as page, page.events(tab=1) as events:
        page.session.pieces = 3
        answer = body_of(page.post("/change", {"tab": 1, "number": 1, "values": {"x": 5.0}}))
        event = next(events)

    assert not answer["is_settled"]
    assert event["answer"]["is_settled"]
    assert page.session.pieces == -1


def test_events_of_the_background_come_to_all_tabs() -> None:
    with served() as page, page.events() as first, page.events() as second:
        page.session.events = [{"event": "file", "state": "changed", "text": "saved in an editor"}]

        assert next(first) == next(second) == {"event": "file", "state": "changed", "text": "saved in an editor"}


def waiting_changes(page: Served, *bodies: dict[str, Any]) -> list[Any]:
    """What is answered to changes that come one after the other while a first one is computed."""
    replies: list[Any] = [None for _ in bodies]

    def post(place: int) -> None:
        replies[place] = body_of(page.post("/change", bodies[place]))

    threads = [threading.Thread(target=post, args=[place]) for place in range(len(bodies))]
    page.session.may_change.clear()
    for place, thread in enumerate(threads):
        thread.start()
        until(page, place)
    page.session.may_change.set()
    for thread in threads:
        thread.join(LIMIT_S)
    return replies


def until(page: Served, count: int) -> None:
    """Wait until the session works on the first change, or a change waits that has so many older ones merged."""
    deadline = time.monotonic() + LIMIT_S
    while True:
        waiting = list(page.owner._jobs)
        if (not count and page.session.calls) or (count and waiting and len(waiting[-1].values) == count):
            return
        assert time.monotonic() < deadline
        time.sleep(0.002)


def test_the_newest_change_wins_and_no_value_of_an_older_one_is_lost() -> None:
    with served() as page:
        first, second, third = waiting_changes(
            page,
            {"number": 1, "values": {"x": 3.0}},
            {"number": 2, "values": {"y": 4.0}},
            {"number": 3, "values": {"x": 6.0, "y": 4.0}},
        )
        calls = page.session.calls

    assert first["values"] == {"x": 3.0, "y": 2.0}
    assert second == {"superseded": True, "number": 2}
    assert (third["number"], third["values"]) == (3, {"x": 6.0, "y": 4.0})
    assert calls == [("change", {"x": 3.0}), ("change", {"x": 6.0, "y": 4.0})]


def test_a_refused_value_of_an_older_change_does_not_refuse_the_newest() -> None:
    with served() as page:
        _, second, third = waiting_changes(
            page,
            {"number": 1, "values": {"x": 3.0}},
            {"number": 2, "values": {"nowhere": 4.0}},
            {"number": 3, "values": {"x": 6.0, "y": 7.0}},
        )

    assert second == {"superseded": True, "number": 2}
    assert third["values"] == {"x": 6.0, "y": 7.0}


def test_an_action_is_done_on_the_change_before_it() -> None:
    with served() as page:
        body_of(page.post("/change", {"values": {"x": 3.0}}))
        body_of(page.post("/do", {"action": "save"}))

    assert page.session.calls == [("change", {"x": 3.0}), ("save", None)]


def test_the_end_is_said_to_every_tab_and_streams_end() -> None:
    with served() as page, page.events() as first, page.events() as second:
        body_of(page.post("/do", {"action": "end"}))
        page.owner.end("ended in the page")

        assert next(first) == next(second) == {"event": "end", "text": "ended in the page"}
        status, _, body = page.post("/open")
        assert (status, body) == (503, b'{"error":"the session has ended"}')


def test_streams_end_with_the_server_and_without_a_word_in_its_log(caplog: pytest.LogCaptureFixture) -> None:
    with ExitStack() as opened:
        with served() as page:
            streams = [opened.enter_context(page.events()) for _ in range(2)]

        assert [list(stream) for stream in streams] == 2 * [[{"event": "end", "text": "the test is over"}]]
    assert caplog.records == []


@pytest.mark.parametrize("tab", [-1, 1.5, "1", True])
def test_a_tab_is_a_whole_number(tab: object) -> None:
    with served() as page:
        assert page.post("/events", {"tab": tab})[0] == 400


def test_a_page_that_reads_nothing_keeps_the_newest_answer_only() -> None:
    async def waiting() -> tuple[bytes, bool, bool]:
        events = Events(1)
        for number in range(5000):
            events.put(ANSWER + b',"answer":%d}' % number)
        events.put(b'{"event":"progress"}')
        lines, was_ended = events.take(), events.has_ended
        for _ in range(MOST_EVENTS + 1):
            events.put(b'{"event":"progress"}')
        return lines, was_ended, events.has_ended

    assert asyncio.run(waiting()) == (ANSWER + b',"answer":4999}\n{"event":"progress"}\n', False, True)
