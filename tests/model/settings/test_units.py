"""Numbers with a unit: they stay the number of the file and know the same quantity in SI units."""

import math
from types import NoneType
from typing import Annotated, Any, Final, get_args, get_origin

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from cellplan.files.schema import CellDocument, RobotTableDocument
from cellplan.files.schema.robot import SlidingSpeed, TurningJerk
from cellplan.model.settings.entry import Coordinate, Entry
from cellplan.model.settings.units import (
    Deg,
    DegPerS,
    DegPerS2,
    DegPerS3,
    Mm,
    MmPerS,
    MmPerS2,
    MmPerS3,
    Ms,
    NmPerDeg,
    NPerMm,
    Quantity,
    in_si,
    si_or_none,
)

UNITS: Final = {
    "_n_mm": NPerMm,
    "_nm_deg": NmPerDeg,
    "_deg": Deg,
    "_deg_s": DegPerS,
    "_deg_s2": DegPerS2,
    "_deg_s3": DegPerS3,
    "_mm": Mm,
    "_mm_s": MmPerS,
    "_mm_s2": MmPerS2,
    "_mm_s3": MmPerS3,
    "_ms": Ms,
}
NUMBERS = st.floats(min_value=-1e5, max_value=1e5)


@given(NUMBERS)
def test_a_quantity_is_the_number_of_the_file(number: float) -> None:
    for unit in (Mm, MmPerS, Ms, Deg, DegPerS3):
        quantity = unit(number)
        assert (quantity, repr(quantity), f"{quantity:g}") == (number, repr(number), f"{number:g}")


@given(NUMBERS)
def test_si_rounds_once(number: float) -> None:
    assert Mm(number).si == Ms(number).si == number / 1000.0
    assert Deg(number).si == DegPerS3(number).si == math.radians(number)


def test_quantities_in_si() -> None:
    assert in_si([Mm(1500.0), Deg(180.0)]).tolist() == [1.5, math.pi]
    assert si_or_none(None) is None
    assert si_or_none(MmPerS(250.0)) == 0.25


@pytest.mark.parametrize(
    ("kind", "unit", "number"), [(Coordinate, Mm, 12.0), (SlidingSpeed, MmPerS, 250), (TurningJerk, DegPerS3, 1e3)]
)
def test_a_field_gives_its_number_the_unit(kind: object, unit: type[Quantity], number: float) -> None:
    read = TypeAdapter(kind).validate_python(number)

    assert type(read) is unit
    assert read == number


def test_a_field_keeps_its_bounds() -> None:
    with pytest.raises(ValidationError, match="less than or equal to 10000"):
        TypeAdapter(SlidingSpeed).validate_python(10_001.0)


def leaves(annotation: Any) -> set[Any]:
    """Types of single values in an annotation; metadata and texts are left out."""
    parts = get_args(annotation)[:1] if get_origin(annotation) is Annotated else get_args(annotation)
    return set().union(*map(leaves, parts)) if parts else {annotation}


def entries(model: Any, values: dict[Any, None]) -> dict[Any, None]:
    """A mapping of the format, and all mappings below it."""
    if isinstance(model, type) and issubclass(model, Entry) and model not in values:
        values[model] = None
        for field in model.model_fields.values():
            for leaf in leaves(field.annotation):
                entries(leaf, values)
    return values


def numbers(value: Any) -> list[Any]:
    """All numbers of a default; a mapping without entries has none."""
    parts = tuple(value.values()) if isinstance(value, dict) else value
    return [item for part in parts for item in numbers(part)] if isinstance(parts, tuple) else [parts]


@pytest.mark.parametrize("model", [CellDocument, RobotTableDocument])
def test_every_key_that_names_a_unit_has_it_in_its_type(model: type[Entry]) -> None:
    named = [(*item, entry) for entry in entries(model, {}) for item in entry.model_fields.items()]
    checked = 0
    for name, field, entry in named:
        unit = next((unit for ending, unit in UNITS.items() if name.endswith(ending)), None)
        if unit is not None:
            assert {
                leaf for leaf in leaves(field.annotation) if isinstance(leaf, type) and issubclass(leaf, float)
            } == {unit}, (entry, name)
            default = [] if field.is_required() else numbers(field.default)
            assert {type(number) for number in default} <= {unit, NoneType}, (entry, name)
            checked += 1
    assert checked > 20
