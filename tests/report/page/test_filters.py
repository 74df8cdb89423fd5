"""Numbers beside their limits."""

import pytest

from cellplan.report.page.filters import against, small, stated


@pytest.mark.parametrize("limit", [1e-7, 0.1, 5.0, 624.0, 1229.0, 12345.678])
def test_a_limit_is_shown_as_it_is_stated(limit: float) -> None:
    assert float(stated(limit)) == limit
    assert "e" not in stated(limit)


@pytest.mark.parametrize("limit", [1e-7, 0.003, 0.1, 5.0, 624.0, 1229.0])
@pytest.mark.parametrize("excess", [-1e-3, -1e-6, 1e-12, 1e-6, 1e-3, 0.01, 3.0])
def test_a_value_does_not_look_like_its_limit(limit: float, excess: float) -> None:
    value = limit * (1.0 + excess)
    shown = float(against(value, limit).replace("<", ""))

    assert (shown > limit) is (value > limit)
    assert shown == pytest.approx(value, rel=0.006)


def test_a_value_far_from_its_limit_has_three_digits_and_one_equal_to_it_is_equal() -> None:
    assert against(0.0123456, 0.1) == small(0.0123456) == "0.0123"
    assert against(0.1, 0.1) == stated(0.1) == "0.1"
    assert against(None, 0.1) == "–"
