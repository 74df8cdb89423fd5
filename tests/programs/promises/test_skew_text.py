"""A skew in the heads of programs is that of the report, and never rounded up."""

import pytest

from cellplan.programs.promises.skew import skew_text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.0, "0 ms"),
        (5.49e-5, "0.0549 ms"),  # not "0 ms": somebody would give up a program that can be started
        (1.379e-4, "0.137 ms"),
        (0.0365, "36.5 ms"),
        (0.1999, "199 ms"),
        (0.2, "200 ms or more"),
    ],
)
def test_a_skew_is_rounded_down_to_three_digits(seconds: float, text: str) -> None:
    assert skew_text(seconds) == text
