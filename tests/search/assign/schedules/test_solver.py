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
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # background processes ignore it
    timer = threading.Timer(1.5, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()

    with pytest.raises(KeyboardInterrupt):
        solve_blocks(hard, least=5, effort=30.0)

    timer.join(timeout=5.0)
    signal.signal(signal.SIGINT, before)
