"""Joint positions as the controller counts them, against those of the model."""

import numpy as np
import pytest

from cellplan.model.robot.controller import ControllerZero


def counting(zero: list[float], sign: list[float], coupling: dict[tuple[int, int], float]) -> ControllerZero:
    """A counting of joints with some couplings."""
    factors = np.zeros((len(zero), len(zero)))
    for place, factor in coupling.items():
        factors[place] = factor
    return ControllerZero(zero=np.array(zero), sign=np.array(sign), coupling=factors, source="test")


def test_a_coupled_joint_follows_its_closed_form() -> None:
    """Axis 3 counts against the horizontal, as its drive sits on the base: c3 = q3 + c2."""
    zero = counting([0.0, -0.5, 0.25], [1.0, -1.0, 1.0], {(2, 1): 1.0})

    values = zero.from_model(np.array([0.1, 0.2, 0.3]))

    np.testing.assert_allclose(values, [0.1, -0.2 - 0.5, 0.3 + 0.25 + (-0.2 - 0.5)], atol=1e-15)


def test_couplings_in_a_chain_add_up() -> None:
    zero = counting([1.0, 2.0, 3.0], [1.0, 1.0, 1.0], {(1, 0): 2.0, (2, 1): 3.0})

    np.testing.assert_array_equal(zero.from_model(np.zeros(3)), [1.0, 4.0, 15.0])


def test_both_conversions_undo_each_other() -> None:
    generator = np.random.default_rng(3)
    for n in (1, 3, 7):
        zero = ControllerZero(
            zero=generator.uniform(-2.0, 2.0, n),
            sign=generator.choice([-1.0, 1.0], n),
            coupling=np.tril(generator.uniform(-1.0, 1.0, (n, n)), -1),
            source="test",
        )
        q = generator.uniform(-3.0, 3.0, (20, n))

        np.testing.assert_allclose(zero.to_model(zero.from_model(q)), q, atol=1e-12)  # rounding
        np.testing.assert_allclose(zero.from_model(zero.to_model(q)), q, atol=1e-12)


def test_a_counting_without_differences_is_the_identity() -> None:
    same = counting([0.0, 0.0], [1.0, 1.0], {})
    q = np.array([[0.3, -0.2]])

    assert same.is_identity
    np.testing.assert_array_equal(same.from_model(q), q)
    assert not counting([0.0, 0.1], [1.0, 1.0], {}).is_identity
    assert not counting([0.0, 0.0], [1.0, -1.0], {}).is_identity
    assert not counting([0.0, 0.0], [1.0, 1.0], {(1, 0): 1.0}).is_identity


@pytest.mark.parametrize(
    ("sign", "coupling"), [([1.0, 0.5], {}), ([1.0], {}), ([1.0, 1.0], {(0, 1): 1.0}), ([1.0, 1.0], {(1, 1): 1.0})]
)
def test_a_counting_that_cannot_be_undone_is_refused(sign: list[float], coupling: dict[tuple[int, int], float]) -> None:
    with pytest.raises(ValueError, match="controller: expected signs"):
        counting([0.0, 0.0], sign, coupling)
