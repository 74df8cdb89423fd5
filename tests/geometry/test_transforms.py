"""Cross products of a few vectors at a time."""

import numpy as np
import pytest

from cellplan.geometry.transforms import cross


@pytest.mark.parametrize(
    "shapes", [((3,), (3,)), ((40, 3), (40, 3)), ((40, 3), (3,)), ((3,), (5, 8, 3)), ((0, 3), (3,))]
)
def test_cross_products_are_those_of_numpy_to_the_last_bit(shapes: tuple[tuple[int, ...], tuple[int, ...]]) -> None:
    rng = np.random.default_rng(3)
    a, b = (rng.normal(size=shape) for shape in shapes)

    assert cross(a, b).tobytes() == np.cross(a, b).tobytes()
