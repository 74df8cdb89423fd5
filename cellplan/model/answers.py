"""Answers to the questions of a long search, one after the other: worked out anew, or recorded for its continuation."""

from collections.abc import Callable
from typing import Any

Answers = Callable[[str, str, Callable[[], Any]], Any]  # (kind of question, what exactly it is about, what answers it)


def worked_out(_question: str, _about: str, work: Callable[[], Any]) -> Any:
    """The answer as it is worked out, plain data, of which nothing is recorded."""
    return work()
