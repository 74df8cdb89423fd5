"""Speeds of ``cellplan recover``: what may be given, and what is refused at once."""

import pytest

from cellplan.cli.real_cell.recover import speed_limits
from cellplan.errors import InputError


def test_a_percentage_may_have_its_sign_and_what_is_not_given_is_left_to_the_cell() -> None:
    assert speed_limits("25%", None) == speed_limits("25", None) == {"speed_percent": 25.0}
    assert speed_limits(None, 250.0) == {"tcp_mm_s": 250.0}
    assert speed_limits(None, None) == {}


@pytest.mark.parametrize(
    ("speed", "tcp_speed", "message"),
    [
        ("fast", None, "--speed: expected 1 to 100 percent, such as 25%, got 'fast'"),
        ("0.25", None, "--speed: expected 1 to 100 percent, such as 25%, got '0.25'"),
        ("120%", None, "--speed: expected 1 to 100 percent, such as 25%, got '120%'"),
        ("nan", None, "--speed: expected 1 to 100 percent, such as 25%, got 'nan'"),
        (None, 0.0, "--tcp-speed: expected a speed above 0 up to 10000 mm/s, got 0"),
        (None, float("nan"), "--tcp-speed: expected a speed above 0 up to 10000 mm/s, got nan"),
    ],
)
def test_other_speeds_are_refused(speed: str | None, tcp_speed: float | None, message: str) -> None:
    with pytest.raises(InputError) as refused:
        speed_limits(speed, tcp_speed)

    assert str(refused.value) == message
