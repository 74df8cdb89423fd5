"""Heavy work of a session: verdicts become states of answers, trials and remedies become changes."""

import time
from base64 import b64decode
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders.editor import coarse_pair

from cellplan.errors import InputError
from cellplan.runs.solve import solve
from cellplan.session.session import Session

LIMIT_S = 600.0  # [s] for work to end on a slow machine
X = "robots.right.base.x_mm"
pytestmark = pytest.mark.slow
Event = Mapping[str, Any]


@pytest.fixture
def session(cells: Path, tmp_path: Path) -> Iterator[Session]:
    """The planar pair, which is cheap."""
    with Session.open(coarse_pair(cells, tmp_path)) as session:
        yield session


def events_of(session: Session, work: str) -> list[Event]:
    """Events until some work has ended."""
    events, begun = list[Event](), time.monotonic()
    while not any(it.get("work") == work and (it["event"] == "failed" or it.get("text") == "done") for it in events):
        events += session.poll()
        assert time.monotonic() - begun < LIMIT_S
        time.sleep(0.01)
    return events


def test_a_certified_state_is_so_until_it_is_changed_and_again_when_that_is_undone(session: Session) -> None:
    assert session.do("certify")["state"] == "planned"
    events = events_of(session, "certify")

    answers = [event["answer"] for event in events if event["event"] == "answer"]
    assert [(it["state"], it["verdict"]) for it in answers] == [("certified", "certified: every check passed")]
    assert session.change({X: 1901.0})["state"] == "planned"
    assert session.do("undo")["state"] == "certified"


def test_the_picture_of_the_certified_state_is_there_for_pages_that_open_later(session: Session) -> None:
    before = session.open_record()
    session.do("certify")
    certified = session.change({X: 1901.0})  # the verdict is of the state before
    events = events_of(session, "certify")
    [verdict] = [event for event in events if event["event"] == "verdict"]
    opened = session.open_record()

    assert before["certified"] is None
    assert verdict["picture"] == opened["certified"]
    shown, was, now = (it["poses"]["bases"] for it in (opened["certified"], before["answer"], certified))
    assert shown == was != now
    assert opened["certified"]["motions"] == {"0": before["answer"]["motion"]}
    assert opened["certified"]["values"][X] == 1900.0
    session.do("reload")
    assert session.open_record()["certified"] is None


def test_a_saved_state_stays_certified(session: Session) -> None:
    session.change({X: 1901.0})
    session.do("certify")
    events_of(session, "certify")

    answer = session.do("save")

    assert (answer["state"], answer["is_saved"]) == ("certified", True)


def test_a_certificate_is_of_the_file_that_was_read(session: Session) -> None:
    session.do("certify")
    events_of(session, "certify")
    path = session.document.path
    path.write_text(path.read_text(encoding="utf-8").replace("1900, 300", "1900, 301"), encoding="utf-8")

    session.do("certify")
    session.do("reload")

    assert session.answer()["state"] == "planned"
    events_of(session, "certify")
    assert session.answer()["state"] == "planned"


def test_a_state_that_does_not_pass_says_the_check(cells: Path) -> None:
    with Session.open(cells / "four_robots_initial.yaml") as session:
        session.do("certify")
        events_of(session, "certify")
        answer = session.answer()

    assert answer["state"] in {"fails", "breaks off"}
    assert "joint kuka/B2 is 1.732 deg beyond its upper limit" in answer["verdict"]


def test_a_remedy_that_is_taken_passes_and_can_be_undone(cells: Path, tmp_path: Path) -> None:
    path = tmp_path / "cell.yaml"
    text = (cells / "two_robots.yaml").read_text(encoding="utf-8")
    path.write_text(text.replace("duration_s: 4", "duration_s: 0.5"), encoding="utf-8")
    with Session.open(path) as session:
        first = session.answer()
        session.do("repair")
        [event] = [event for event in events_of(session, "repair") if event["event"] == "remedies"]
        remedy = event["remedies"][-1]

        answer = session.do("take", remedy["number"])

        assert answer["history"]
        assert answer["can"]["undo"]
        assert solve(session.document.cell).passed
        session.do("certify")
        events_of(session, "certify")
        assert session.answer()["state"] == "certified"
        undone = session.do("undo")
        assert undone["history"] == []
        assert undone["values"] == first["values"]


def test_a_trial_comes_with_the_picture_of_the_layout_that_it_offers(cells: Path) -> None:
    with Session.open(cells / "four_robots_initial.yaml") as session:
        session.do("improve", 0.1)
        trials = list[Event]()
        while not trials:
            trials = [event for event in session.poll() if event["event"] == "trial"]
            time.sleep(0.01)
        session.do("stop")
        offered, answer = trials[0]["picture"], session.do("take", trials[0]["number"])

    assert offered["values"] == answer["values"]
    assert offered["poses"] == answer["poses"]
    shown, taken = (np.frombuffer(b64decode(it["q"]), "<f4") for it in (offered["motions"]["0"], answer["motion"]))
    assert taken == pytest.approx(shown, abs=1e-3)  # of a motion that came from one nearby


def test_a_map_is_of_a_robot_with_a_task(session: Session) -> None:
    with pytest.raises(InputError, match="map: expected the number of a robot below 2, got 2"):
        session.do("map", 2)
    session.do("map", 1)
    while not (tiles := [event for event in session.poll() if event["event"] == "tiles"]):
        time.sleep(0.01)

    assert session.do("stop")["state"] == "planned"
    assert tiles[0]["robot"] == "right"
    assert not [event for event in session.poll() if event["event"] == "tiles"]


@pytest.mark.parametrize("number", [None, 0, -1])
def test_nothing_is_taken_that_was_not_on_offer(session: Session, number: float | None) -> None:
    with pytest.raises(InputError, match="take: expected a number below 0"):
        session.do("take", number)
