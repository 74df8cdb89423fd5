"""Tests of the plots paint every picture themselves."""

from collections.abc import Iterator

import pytest
from builders.picture_memo import painted_anew


@pytest.fixture(autouse=True)
def anew() -> Iterator[None]:
    """No picture is taken from an earlier test."""
    with painted_anew():
        yield
