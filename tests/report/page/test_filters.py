"""Numbers beside their limits."""

import pytest

from cellplan.report.page.figures import _acceleration_figures
from cellplan.report.record.numbers import against, small, stated


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


@pytest.mark.parametrize("ratio", [0.998, 0.9998, 1.0004, 7.813])
def test_an_acceleration_next_to_its_limit_does_not_look_like_it(ratio: float) -> None:
    limit = {"acceleration_limit": 480.0, "acceleration_limit_source": "assumed", "unit": "deg"}
    joint = {"acceleration_ratio": ratio, "peak_acceleration": 480.0 * ratio, "peak_acceleration_at_s": 1.0, **limit}
    (figure,) = _acceleration_figures({"joints": {"arm": {"A1": joint}}})

    assert float(figure["value"]) != 100.0
    assert (float(figure["value"]) > 100.0) is figure["is_bad"] is (ratio > 1.0)
