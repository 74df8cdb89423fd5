"""Cluster: the trials of a study on the workers of a Dask scheduler, each in a child process of its worker.

The files of the study travel too, once, by their content: workers need no file system in common with it.
"""

import platform
import queue
import threading
import time
import warnings
from collections.abc import Callable
from concurrent.futures import Executor, Future, InvalidStateError
from contextlib import suppress
from functools import partial
from types import TracebackType
from typing import Any, Final

import numpy as np

import cellplan
from cellplan.errors import InputError, NotFiniteError, StudyStoppedError
from cellplan.study.bundle import Bundle
from cellplan.study.workers import Lost

CONNECT_S: Final = 10.0  # [s] within which the scheduler answers at the start
RECONNECT_S: Final = 30.0  # [s] within which it answers again after the connection was lost
NO_WORKERS_S: Final = 60.0  # [s] after which a cluster without a worker is given up
CHECK_EVERY_S: Final = 0.2  # [s] between two checks of the connection
PER_THREAD: Final = 2  # trials begun for each thread of the cluster, so that none waits for the next one

_Sent = tuple[Future[Any], Callable[[], Any], object]  # a job of Dask, what sends it, and through which connection


class Cluster(Executor):
    """Executor of a Dask cluster, to be used in a ``with`` statement.

    A worker that is killed costs its trials a repetition on another one. A connection that is lost is made again, and
    what was under way is begun again.

    Attributes:
        is_remote: That outcomes come from other machines, so that those that count are worked out here again.
    """

    is_remote = True

    def __init__(self, address: str, bundle: Bundle | None = None) -> None:
        """Connect.

        Args:
            bundle: The files that the trials read; None where they read none.

        Raises:
            InputError: Dask is not installed, the address is none or nothing answers there.
        """
        self._address = address
        self._client = _connected(address)
        self._dask = self._client.get_executor(pure=False)
        threads = sum(self._client.sync(self._client.scheduler.ncores, callback_timeout=CONNECT_S).values())
        self.count = max(2, PER_THREAD * threads)
        self._bundle, self._held = bundle, list[tuple[object, Any]]()
        self._running: dict[Future[Any], _Sent] = {}
        self._again: queue.SimpleQueue[tuple[Future[Any], Callable[[], Any]]] = queue.SimpleQueue()
        self._is_over = threading.Event()
        self._watch = threading.Thread(target=self._watched, name="cellplan-cluster", daemon=True)
        self._watch.start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Leave the cluster; what it has not begun is cancelled."""
        self._is_over.set()
        self._watch.join(CONNECT_S)
        with suppress(Exception):
            self._dask.shutdown(wait=False)
            self._client.close(timeout=CONNECT_S)

    def submit(self, function: Callable[..., Any], /, *arguments: object, **named: object) -> Future[Any]:
        """Begin a job on the cluster."""
        outer: Future[Any] = Future()

        def call() -> Future[Any]:
            return self._dask.submit(checked, _versions(), self._files(), function, *arguments, **named)

        self._send(outer, call)
        return outer

    def _files(self) -> Any:
        """The files of the study as a result of Dask, which recomputes what is lost with a worker; None without any."""
        if self._bundle is None:
            return None
        connection = self._client.scheduler_comm
        if not self._held or self._held[-1][0] is not connection:
            key = f"cellplan-files-{self._bundle.digest}-{len(self._held)}"
            with warnings.catch_warnings(action="ignore", category=UserWarning):  # that files are large
                self._held.append((connection, self._client.submit(itself, self._bundle, key=key)))
        return self._held[-1][1]

    def _send(self, outer: Future[Any], call: Callable[[], Any]) -> None:
        """Give a job to Dask."""
        if outer.done():
            self._running.pop(outer, None)
            return
        connection = self._client.scheduler_comm
        try:
            inner: Future[Any] = call()
        except Exception as error:  # noqa: BLE001 - the client is closed, or the job is none that can be sent
            if self._is_connected():
                self._stop(outer, f"cannot be sent a trial: {error}")
            else:
                self._again.put((outer, call))
            return
        self._running[outer] = inner, call, connection
        inner.add_done_callback(partial(self._arrived, outer, call))

    def _arrived(self, outer: Future[Any], call: Callable[[], Any], inner: Future[Any]) -> None:
        """Pass on an answer; a job whose connection was lost is begun again, and its first answer counts."""
        sent = self._running.get(outer)
        if inner.cancelled():
            if sent is not None and sent[0] is inner:
                self._again.put((outer, call))
            return
        self._running.pop(outer, None)
        error = inner.exception(timeout=0)
        if error is None:
            _answer(outer, inner.result(timeout=0))
        elif type(error).__name__ == "KilledWorker":
            _answer(outer, Lost("the workers of the cluster that worked it out ended"))
        elif isinstance(error, StudyStoppedError | NotFiniteError):
            _answer(outer, error)
        else:
            said = (str(error).splitlines() or [""])[0]
            self._stop(outer, f"a worker cannot work out trials: {type(error).__name__}: {said}")

    def _watched(self) -> None:
        """Begin jobs again once there is a connection, and give up when there is none or no worker for too long."""
        lost_since = idle_since = None
        while not self._is_over.wait(CHECK_EVERY_S):
            now = time.monotonic()
            if self._is_connected():
                lost_since = None
                self._renew()
            else:
                lost_since = lost_since or now
                if now - lost_since > RECONNECT_S:
                    self._give_up(f"does not answer any more for {RECONNECT_S:g} s")
            idle_since = None if self._workers() or lost_since else idle_since or now
            if idle_since and now - idle_since > NO_WORKERS_S:
                self._give_up(f"has had no worker for {NO_WORKERS_S:g} s")

    def _renew(self) -> None:
        """Begin again what waits for a connection, and what was sent through one that is gone."""
        while not self._again.empty():
            self._send(*self._again.get_nowait())
        for outer, (_, call, connection) in list(self._running.items()):
            if connection is not self._client.scheduler_comm:
                self._send(outer, call)

    def _is_connected(self) -> bool:
        comm = self._client.scheduler_comm
        return self._client.status == "running" and comm is not None and not comm.closed()

    def _workers(self) -> int:
        """Number of workers that the client knows of."""
        info = getattr(self._client, "_scheduler_identity", None) or {}
        return int(info.get("n_workers", len(info.get("workers", {}))))  # newer versions list no workers unasked

    def _give_up(self, reason: str) -> None:
        """Stop the study."""
        while not self._again.empty():
            self._stop(self._again.get_nowait()[0], reason)
        for outer in list(self._running):
            self._running.pop(outer, None)
            self._stop(outer, reason)

    def _stop(self, outer: Future[Any], reason: str) -> None:
        text = f"--scheduler {self._address}: {reason}; --resume goes on from what is recorded"
        _answer(outer, StudyStoppedError(text))


def _answer(outer: Future[Any], answer: Any) -> None:
    """Pass on a result or an error of our own, unless there is an answer already or none is waited for."""
    with suppress(InvalidStateError):
        outer.set_exception(answer) if isinstance(answer, BaseException) else outer.set_result(answer)


def itself(bundle: Bundle) -> Bundle:
    """The files of a study, on a worker."""
    return bundle


def checked(versions: dict[str, str], bundle: Bundle | None, function: Callable[..., Any], *arguments: object) -> Any:
    """Result of a job on a worker of the cluster; its last argument is the folder of the bundle, if there is one.

    Raises:
        StudyStoppedError: The worker has other versions, so that its figures would be other ones.
    """
    if versions != _versions():
        raise StudyStoppedError(f"--scheduler: expected workers with {versions}, got one with {_versions()}")
    return function(*arguments) if bundle is None else function(*arguments, bundle.root())


def _versions() -> dict[str, str]:
    """What figures depend on."""
    return {"cellplan": cellplan.__version__, "python": platform.python_version(), "numpy": np.__version__}


def _connected(address: str) -> Any:
    """A client of the scheduler."""
    try:
        from distributed import Client
    except ImportError:
        raise InputError(
            '--scheduler: expected Dask, got no package distributed: pip install "cellplan[cluster]"'
        ) from None
    try:
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError, TypeError, ImportError) as error:
        said = (str(error).splitlines() or [""])[0]
        raise InputError(
            f"--scheduler {address}: expected the address of a Dask scheduler that answers, got: {said}"
        ) from None
    client._timeout = RECONNECT_S  # after a loss it would give up earlier
    return client
