"""Whether cache entries may be used: never by a command that verifies the output of another one."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import partial
from typing import Final, TypeVar

Value = TypeVar("Value")

_IS_USED: Final = ContextVar("_IS_USED", default=True)


@contextmanager
def without_cache() -> Iterator[None]:
    """Neither read nor write the cache folder for as long as the ``with`` statement lasts.

    What this process makes meanwhile, from the files themselves, is still made once only.
    """
    before = _IS_USED.set(False)
    try:
        yield
    finally:
        _IS_USED.reset(before)


def is_cache_used() -> bool:
    """Whether entries of the cache folder may be read and written."""
    return _IS_USED.get()


def as_here(function: Callable[..., Value]) -> Callable[..., Value]:
    """The function as another process has to run it: with the cache used there as it is here."""
    return partial(_run, is_cache_used(), function)


def _run(is_used: bool, function: Callable[..., Value], *arguments: object) -> Value:
    """Result of a function, with or without the cache folder."""
    if is_used:
        return function(*arguments)
    with without_cache():
        return function(*arguments)
