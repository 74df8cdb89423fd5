"""The start-up test notices an engine that answers wrongly."""

import fcl
import pytest

from cellplan.errors import ExitStatus, SelfTestError
from cellplan.scene.collision import self_test
from cellplan.scene.collision.self_test import prove_engine


def test_the_engine_of_this_machine_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    verdicts: list[tuple[str, bool]] = []
    monkeypatch.setattr(self_test, "_expect", lambda holds, statement: verdicts.append((statement, holds)))

    prove_engine.__wrapped__()

    assert len(verdicts) == len(self_test.HITS) + len(self_test.DISTANCES) + 4
    assert [statement for statement, holds in verdicts if not holds] == []


def test_an_engine_that_always_says_free_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fcl, "collide", lambda *_: 0)

    with pytest.raises(
        SelfTestError, match=r"self-test failed: expected that box and box 0\.9 m apart touch"
    ) as caught:
        prove_engine.__wrapped__()

    assert caught.value.status is ExitStatus.INTERNAL


def test_an_engine_whose_distances_are_wild_is_not_believed_but_still_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    truth, calls = fcl.distance, []

    def too_large(first, second, request, result):
        calls.append(request.enable_nearest_points)
        return truth(first, second, request, result) + (0.1 if request.enable_nearest_points else 0.0)

    monkeypatch.setattr(fcl, "distance", too_large)

    assert prove_engine.__wrapped__() is None  # the surfaces are asked when the proof falls short of the proposal
    assert True in calls
