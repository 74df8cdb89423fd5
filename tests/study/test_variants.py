"""Axes and combinations of a study."""

import pytest

from cellplan.errors import InputError
from cellplan.study.variants import Axis, combinations, read_axis


def test_a_range_is_exact_in_its_decimals_and_includes_both_ends() -> None:
    assert read_axis("motion.duration_s=2:2.3:0.1") == Axis("motion.duration_s", (2.0, 2.1, 2.2, 2.3))


def test_a_range_of_whole_numbers_stays_whole_and_may_fall() -> None:
    values = read_axis("motion.repeat = 5:1:-2").values
    assert values == (5, 3, 1)
    assert all(isinstance(value, int) for value in values)


def test_a_range_whose_step_does_not_divide_it_ends_before_its_last_value() -> None:
    assert read_axis("a.b=0:1:0.4").values == (0.0, 0.4, 0.8)


def test_listed_values_are_read_as_in_a_cell_file() -> None:
    assert read_axis("a.b=1,2.5,true,pairwise").values == (1, 2.5, True, "pairwise")
    assert read_axis("a.b=[1, 2],[3, 4]").values == ((1, 2), (3, 4))


def test_combinations_change_the_last_axis_first() -> None:
    variants = combinations([Axis("a", (1, 2)), Axis("b", ("x", (3, 4)))])
    assert [dict(variant.values) for variant in variants] == [
        {"a": 1, "b": "x"},
        {"a": 1, "b": [3, 4]},
        {"a": 2, "b": "x"},
        {"a": 2, "b": [3, 4]},
    ]
    assert [variant.number for variant in variants] == [0, 1, 2, 3]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("motion.duration_s", "--vary: expected KEY=FROM:TO:STEP or KEY=VALUE,VALUE,…, such as"),
        ("=1:2:1", "--vary: expected KEY=FROM:TO:STEP"),
        ("a=3:1:0.5", "--vary: expected a step that leads from 3 to 1, got 0.5 in 'a=3:1:0.5'"),
        ("a=1:2:0", "--vary: expected a step that leads from 1 to 2, got 0 in 'a=1:2:0'"),
        ("a=0:1e9:1", "--vary: expected at most 100000 values, got 1000000000 in 'a=0:1e9:1'"),
        ("a=1,2,1", "--vary a: expected every value once, got '1,2,1'"),
    ],
)
def test_an_axis_that_cannot_be_read_is_refused(text: str, message: str) -> None:
    with pytest.raises(InputError) as raised:
        read_axis(text)
    assert str(raised.value).startswith(message)


def test_combinations_need_keys_that_differ_and_are_not_too_many() -> None:
    with pytest.raises(InputError, match="expected every key once, got 'a' again"):
        combinations([Axis("a", (1,)), Axis("a", (2,))])
    with pytest.raises(InputError, match="expected at least one key"):
        combinations([])
    with pytest.raises(InputError, match="expected at most 100000 combinations, got 1000000"):
        combinations([Axis(name, tuple(range(100))) for name in "abc"])
