"""The plotting library, imported without a window: whatever display the environment names, nothing is ever shown."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Final

VARIABLE: Final = "MPLBACKEND"  # of the display; in a shell started by a notebook it names a module that is not there


@contextmanager
def no_backend() -> Iterator[None]:
    """Let the library be imported although the environment names a display that it does not know.

    Afterwards the environment is as it was, and so is the choice of a display that it does know: a program that uses
    this one may want to draw windows of its own.
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
