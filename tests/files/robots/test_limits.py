"""The one rule for limits of a cell: they tighten or supply those of the model, whatever file that comes from."""

import math
from dataclasses import fields

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellplan.files.robots.limits import LIMIT_TOL, RATES, StatedLimits, limit_findings, tightest

STATED = StatedLimits(lower=-1.0, upper=2.0, velocity=3.0, acceleration=4.0)
VALUES = st.none() | st.floats(0.01, 10.0)


@st.composite
def stated(draw: st.DrawFn) -> StatedLimits:
    lower = draw(VALUES)
    return StatedLimits(
        lower=None if lower is None else -lower,
        upper=draw(VALUES),
        velocity=draw(VALUES),
        acceleration=draw(VALUES),
        jerk=draw(VALUES),
    )


def test_every_limit_has_a_rate() -> None:
    assert [field.name for field in fields(StatedLimits)] == [*RATES, "wraps"]


@given(stated(), stated())
def test_the_result_is_allowed_by_both_and_missing_only_where_both_are(
    stated: StatedLimits, cell: StatedLimits
) -> None:
    made = tightest(stated, cell)

    for entry in (stated, cell):
        assert not [text for _, text in limit_findings(entry, made, is_revolute=True) if "limit of the model" in text]
    for name in RATES:
        known = {getattr(stated, name), getattr(cell, name)} - {None}
        assert getattr(made, name) in (known or {None})


@given(stated(), stated())
def test_limits_without_findings_are_taken_as_the_cell_states_them(stated: StatedLimits, cell: StatedLimits) -> None:
    if list(limit_findings(stated, cell, is_revolute=False)):
        return

    made = tightest(stated, cell)

    for name in RATES:
        value = getattr(cell, name)
        assert value is None or getattr(made, name) == pytest.approx(value, abs=LIMIT_TOL)


@pytest.mark.parametrize(
    ("cell", "is_revolute", "findings"),
    [
        (StatedLimits(), True, []),
        (StatedLimits(lower=-1.0, upper=2.0, velocity=3.0, acceleration=4.0, jerk=9.0), True, []),
        (StatedLimits(lower=-1.0 - 0.9 * LIMIT_TOL, velocity=3.0 + 0.9 * LIMIT_TOL), True, []),
        (
            StatedLimits(lower=-1.5),
            False,
            [("lower_mm", "expected at least -1000, the limit of the model, got -1500")],
        ),
        (
            StatedLimits(upper=math.radians(180.0), velocity=4.0),
            True,
            [
                ("upper_deg", "expected at most 114.591559, the limit of the model, got 180"),
                ("velocity_deg_s", "expected at most 171.887339, the limit of the model, got 229.183118"),
            ],
        ),
        (
            StatedLimits(acceleration=4.1),
            False,
            [("acceleration_mm_s2", "expected at most 4000, the limit of the model, got 4100")],
        ),
        (
            StatedLimits(upper=-1.0),
            False,
            [("upper_mm", "expected a lower limit below the upper one, got -1000 and -1000")],
        ),
        (
            StatedLimits(lower=2.5),
            False,
            [("lower_mm", "expected a lower limit below the upper one, got 2500 and 2000")],
        ),
    ],
)
def test_wider_limits_are_found_by_key_in_its_unit(
    cell: StatedLimits, is_revolute: bool, findings: list[tuple[str, str]]
) -> None:
    assert list(limit_findings(STATED, cell, is_revolute=is_revolute)) == findings
