"""The solver ends where a user interrupts it."""

import os
import signal
import threading

import pytest
from builders.assignments import small_instance

from cellplan.search.assign.schedules.blocks import solve_blocks


def test_an_interruption_ends_the_search_and_is_heard() -> None:
    pytest.importorskip("ortools")
    hard = small_instance(0, 24, stations=5)
    timer = threading.Timer(1.5, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()

    with pytest.raises(KeyboardInterrupt):
        solve_blocks(hard, least=5, effort=1000.0)

    timer.cancel()
