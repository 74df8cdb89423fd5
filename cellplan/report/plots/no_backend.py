"""Import of the plotting library independent of the display backend that the environment names."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Final

VARIABLE: Final = "MPLBACKEND"  # a shell started by a notebook may name a backend that is not installed


@contextmanager
def no_backend() -> Iterator[None]:
    """Allow the library to be imported although the environment names an unknown backend.

    The environment and the choice of a known backend are restored afterwards, for a calling program that opens windows.
    """
    desired = None if "matplotlib" in sys.modules else os.environ.pop(VARIABLE, None)
    try:
        yield
    finally:
        if desired is not None:
            os.environ[VARIABLE] = desired
    if desired:
        with suppress(ValueError):
            sys.modules["matplotlib"].rcParams["backend"] = desired
