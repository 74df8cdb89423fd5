"""What the record of a search says besides its figures."""

from cellplan.jobs.layout.given_layout import NOT_SOLVED, GivenRecord
from cellplan.jobs.layout.record import no_gain


def test_a_given_layout_than_which_nothing_is_faster_is_named() -> None:
    given: GivenRecord = {**NOT_SOLVED, "status": "conforming", "cycle_s": 10.44}

    expected = "no gain: nothing better than the given layout was found, which takes 10.44 s"
    assert [text.partition(";")[0] for text in no_gain(10.44, given)] == [expected]
    assert not list(no_gain(10.43, given))
    assert not list(no_gain(None, given))
    assert not list(no_gain(10.444, {**given, "status": "violating"}))
    assert not list(no_gain(10.444, {**given, "cycle_s": None}))
