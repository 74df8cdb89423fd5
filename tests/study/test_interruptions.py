"""Interruptions at the worst moment: between a lock that is taken and the code that would give it back."""

import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Future

import pytest

from cellplan.study.interruptions import is_one_done, result_of


@pytest.fixture
def ctrl_c() -> Iterator[None]:
    """Ctrl-C raises, as on a terminal."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("ctrl_c")
def test_an_interruption_leaves_no_lock_of_a_future_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    future: Future[int] = Future()
    condition = future._condition  # the lock that `wait` takes
    acquire = condition.acquire

    def interrupted(*arguments: object, **settings: object) -> bool:
        is_taken = acquire(*arguments, **settings)
        signal.raise_signal(signal.SIGINT)
        return is_taken

    monkeypatch.setattr(condition, "acquire", interrupted)
    with pytest.raises(KeyboardInterrupt):
        is_one_done([future], 10.0)
    monkeypatch.undo()

    thread = threading.Thread(target=future.set_result, args=(7,), daemon=True)
    thread.start()
    thread.join(10.0)
    assert not thread.is_alive()
    assert is_one_done([future], 10.0)
    assert result_of(future, 10.0) == 7


def test_what_does_not_come_is_late() -> None:
    future: Future[int] = Future()

    assert not is_one_done([future], 0.01)
    with pytest.raises(TimeoutError):
        result_of(future, 0.01)
