"""Rounded positions stay within the limits, and as near to the position as the limit lets them."""

import numpy as np
import pytest

from cellplan.errors import InputError
from cellplan.model.robot.robot import BASE, Joint, JointKind
from cellplan.programs.elements.joints import from_file_unit, rounded_inside, rounded_quanta, to_file_unit

Z = np.array([0.0, 0.0, 1.0])


def joint(lower: float, upper: float, kind: JointKind = JointKind.REVOLUTE) -> Joint:
    return Joint(
        name="J", kind=kind, parent=BASE, axis_B=Z, point_B=np.zeros(3), lower=lower, upper=upper, velocity=1.0
    )


@pytest.mark.parametrize("decimals", [3, 4, 6, 9])
@pytest.mark.parametrize("kind", [JointKind.REVOLUTE, JointKind.PRISMATIC], ids=str)
def test_a_hundred_thousand_positions_near_their_limits_stay_inside(kind: JointKind, decimals: int) -> None:
    rng = np.random.default_rng(decimals)
    quantum = float(np.deg2rad(10.0**-decimals)) if kind is JointKind.REVOLUTE else 10.0**-decimals / 1e3
    for _ in range(100):
        lower, upper = -rng.uniform(0.5, 3.0), rng.uniform(0.5, 3.0)
        near = rng.uniform(0.0, 3.0, 500) * quantum * rng.integers(0, 2, 500)  # half of them stand on the limit
        q = np.concatenate([upper - near, lower + near])

        written = rounded_inside(joint(lower, upper, kind), q, decimals)

        read = from_file_unit(joint(lower, upper, kind), written)
        assert read.min() >= lower
        assert read.max() <= upper
        assert np.abs(read - q).max() <= quantum * (1.0 + 1e-6)  # one unit of the last decimal, room for float noise


def test_a_position_far_from_the_limits_is_rounded_to_the_nearest() -> None:
    q = np.random.default_rng(1).uniform(-1.0, 1.0, 1000)

    written = rounded_inside(joint(-2.0, 2.0), q, 4)

    assert np.array_equal(written, np.round(np.rad2deg(q), 4) + 0.0)


def test_a_limit_that_can_be_written_is_reached() -> None:
    limit = float(np.deg2rad(170.0))

    assert rounded_inside(joint(-limit, limit), np.array([limit, -limit]), 4).tolist() == [170.0, -170.0]


def test_a_limit_between_two_decimals_is_not_crossed() -> None:
    upper = float(np.deg2rad(169.99999))

    written = rounded_inside(joint(-1.0, upper), np.deg2rad([169.99996]), 4)

    assert written.tolist() == [169.9999]  # the nearest, 170.0000, lies beyond


def test_zero_has_no_sign() -> None:
    assert str(rounded_inside(joint(-1.0, 1.0), np.array([-1e-12]), 4)[0]) == "0.0"


def test_a_range_without_such_a_number_is_refused() -> None:
    third = float(np.deg2rad(1.0 / 3.0))

    with pytest.raises(InputError, match="joint J: no number with 4 decimals lies within its limits"):
        rounded_inside(joint(third, third), np.array([third]), 4)


@pytest.mark.parametrize("value", [np.nan, np.inf, -2e6])
def test_a_number_that_the_format_cannot_hold_is_refused(value: float) -> None:
    with pytest.raises(InputError, match="x: expected numbers below 1e"):
        rounded_quanta(np.array([value]), 9, what="x")


def test_units_go_there_and_back() -> None:
    q = np.array([-1.0, 0.5])

    assert to_file_unit(joint(-2, 2, JointKind.PRISMATIC), q).tolist() == [-1000.0, 500.0]
    assert np.allclose(from_file_unit(joint(-2, 2), to_file_unit(joint(-2, 2), q)), q, rtol=1e-15)
