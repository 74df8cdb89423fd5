"""Entries: what help shows of them, and copies with other values."""

import pytest
from pydantic import ValidationError

from cellplan.model.settings.checks import ChecksEntry
from cellplan.model.settings.units import Mm


def test_help_lists_the_keys_with_what_they_mean() -> None:
    lines = (ChecksEntry.__doc__ or "").splitlines()

    assert lines[0] == "Requirements of the checks."
    assert lines[lines.index("Attributes:") + 1].startswith("    clearance_mm: Smallest allowed distance ")
    assert len(lines) == lines.index("Attributes:") + 1 + len(ChecksEntry.model_fields)


def test_a_copy_is_validated_and_keeps_its_units() -> None:
    given = ChecksEntry()

    copy = given.changed(clearance_mm=7.0)

    assert isinstance(copy.clearance_mm, Mm)
    assert (copy.clearance_mm.si, copy.contact_zone_mm, given.clearance_mm) == (0.007, given.contact_zone_mm, 5.0)
    with pytest.raises(ValidationError, match="greater than or equal to 0"):
        given.changed(clearance_mm=-1.0)
