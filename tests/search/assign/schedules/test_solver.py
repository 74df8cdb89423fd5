"""The solver ends where a user interrupts it, and what it solved before is not solved again."""

import os
import signal
import threading
from pathlib import Path

import pytest
from builders.assignments import small_instance

from cellplan.cache.store import forget
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


def test_another_process_takes_over_what_was_solved(cache_folder: Path) -> None:
    """The entry of the first answer serves another solver with the same model; another effort has its own."""
    pytest.importorskip("ortools")
    instance = small_instance(1, 5)

    first = solve_blocks(instance, least=5, effort=2.0)
    entries = [(it.name, it.stat().st_ino) for it in cache_folder.rglob("*.entry")]
    forget()

    assert solve_blocks(instance, least=5, effort=2.0) == first
    assert [(it.name, it.stat().st_ino) for it in cache_folder.rglob("*.entry")] == entries
    assert solve_blocks(instance, least=5, effort=1.0).bound == first.bound
    assert len(list(cache_folder.rglob("*.entry"))) == 1 + len(entries) == 2
