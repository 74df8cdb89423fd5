"""The one thread that calls the session: jobs of pages in their order, and what follows a change later."""

import json
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from http import HTTPStatus
from typing import TYPE_CHECKING, Any, Final, Protocol

from cellplan.cli.edit.jobs import CHANGE, DO, OPEN, Job, Reply
from cellplan.cli.edit.responses import ANSWER
from cellplan.cli.terminal.errors import error_lines
from cellplan.errors import CellplanError, InputError

if TYPE_CHECKING:
    from cellplan.report.record.common import Record

QUIET_S: Final = 0.1  # [s] without a change after which the session settles
SENT_S: Final = 0.003  # [s] after which an answer is sent: until then nothing else is done
POLL_S: Final = 0.02  # [s] between two polls of worker processes and of the file

Publish = Callable[[bytes, int | None], None]  # called with one event as JSON, and the tab that has it already


class LiveSession(Protocol):
    """What is served; see ``cellplan.session``."""

    def open_record(self) -> "Record":
        """What a page needs once."""

    def change(self, values: Mapping[str, float], *, block: int | None = None, number: int = 0) -> "Record":
        """The answer to new values."""

    def advise(self) -> bool:
        """A piece of what would help, between two changes; False if there is nothing left to do."""

    def settle(self) -> "Record | None":
        """A fuller answer, once nothing changes; None if there is nothing left to do."""

    def do(self, action: str, argument: float | None = None) -> "Record":
        """The answer to an action."""

    def poll(self) -> "list[Record]":
        """What has happened in the background."""


class Owner:
    """Calls the session for all pages.

    Attributes:
        answer: The last answer; empty before the first one.
        is_open: Set once a page has the cell.
    """

    def __init__(self, session: LiveSession, publish: Publish) -> None:
        """Take over a session; ``publish`` sends an event to all pages but one."""
        self.answer: Record = {}
        self.is_open = threading.Event()
        self._session, self._publish = session, publish
        self._jobs: deque[Job] = deque()
        self._arrived = threading.Condition()
        self._has_ended = False
        self._is_settled, self._is_advised = False, True
        self._changed_at = self._polled_at = time.monotonic()
        self._failure = ""  # that was published last

    def submit(self, job: Job) -> None:
        """Let a job be done; called from any thread. A change that still waits is superseded by a newer one."""
        older = None
        job.reply.set_running_or_notify_cancel()  # from now on it cannot be cancelled
        with self._arrived:
            if self._has_ended:
                job.reply.set_result(_refusal(HTTPStatus.SERVICE_UNAVAILABLE, "the session has ended"))
                return
            if job.path == CHANGE and self._jobs and self._jobs[-1].path == CHANGE:
                older = self._jobs.pop()
                job = job.after(older)
            self._jobs.append(job)
            self._arrived.notify()
        if older is not None:
            older.reply.set_result((HTTPStatus.OK, encoded({"superseded": True, "number": older.number})))

    def run(self) -> None:
        """Do jobs until one of them ends the session."""
        while not self._has_ended:
            job = self._next()
            if job is not None:
                job.reply.set_result(self._replied(job))
            elif not self._is_advised:
                self._advise()
            elif not self._is_settled and time.monotonic() - self._changed_at >= QUIET_S:
                self._settle()
            if time.monotonic() - self._polled_at >= POLL_S:
                self._polled_at = time.monotonic()
                self._poll()

    def end(self, text: str) -> None:
        """Refuse what still waits and what comes, and let the pages say why."""
        with self._arrived:
            self._has_ended = True
            jobs, self._jobs = self._jobs, deque()
        for job in jobs:
            job.reply.set_result(_refusal(HTTPStatus.SERVICE_UNAVAILABLE, "the session has ended"))
        self._publish(encoded({"event": "end", "text": text}), None)

    def _next(self) -> Job | None:
        """The next job, waited for as long as nothing else is to be done."""
        with self._arrived:
            if not self._jobs:
                now = time.monotonic()
                quiet = QUIET_S if self._is_advised else SENT_S
                due = self._polled_at + POLL_S if self._is_settled else self._changed_at + quiet
                self._arrived.wait(max(0.0, min(due, self._polled_at + POLL_S) - now))
            return self._jobs.popleft() if self._jobs else None

    def _replied(self, job: Job) -> Reply:
        """Do one job."""
        try:
            record = self._done(job)
            reply = HTTPStatus.OK, encoded(record)
        except CellplanError as error:
            return _refusal(HTTPStatus.BAD_REQUEST, _line(error))
        except Exception as error:  # noqa: BLE001 - the session goes on, whatever one change has met
            return _refusal(HTTPStatus.INTERNAL_SERVER_ERROR, _line(error))
        if job.path != OPEN and not self._has_ended:
            self._note(record, reply[1], job.tab)
        return reply

    def _done(self, job: Job) -> "Record":
        if job.path == OPEN:
            record = self._session.open_record()
            self.answer = record["answer"]
            self.is_open.set()
            return record
        if job.path == DO:
            record = self._session.do(job.action, job.argument)
            self._has_ended = job.action == "end"
            return record
        try:
            return self._session.change({**job.superseded, **job.values}, block=job.block, number=job.number)
        except InputError:
            if not job.superseded:
                raise
            return self._session.change(job.values, block=job.block, number=job.number)

    def _note(self, record: "Record", text: bytes, tab: int | None) -> None:
        """Publish an answer or an event, and settle again later."""
        self._is_settled, self._is_advised, self._changed_at = False, False, time.monotonic()
        if "event" in record:
            self._publish(text, tab)
        else:
            self.answer = record
            self._publish(ANSWER + b',"answer":' + text + b"}", tab)

    def _advise(self) -> None:
        """One piece of what would help."""
        try:
            self._is_advised = not self._session.advise()
        except Exception as error:  # noqa: BLE001 - likewise
            self._is_advised = True
            self._fail("advise", error)

    def _settle(self) -> None:
        """One piece of what follows when nothing changes."""
        try:
            answer = self._session.settle()
            text = b"" if answer is None else encoded(answer)
        except Exception as error:  # noqa: BLE001 - likewise
            self._is_settled = True
            self._fail("settle", error)
            return
        if answer is None:
            self._is_settled = True
            return
        self.answer = answer
        self._publish(ANSWER + b',"answer":' + text + b"}", None)

    def _poll(self) -> None:
        """Publish what has happened in the background."""
        try:
            events = [(event, encoded(event)) for event in self._session.poll()]
        except Exception as error:  # noqa: BLE001 - likewise
            self._fail("poll", error)
            return
        for event, text in events:
            self.answer = event.get("answer", self.answer)
            self._is_settled = False
            self._publish(text, None)

    def _fail(self, work: str, error: Exception) -> None:
        """Publish a failure, unless it is the same as the last one."""
        line = _line(error)
        if line != self._failure:
            self._failure = line
            self._publish(encoded({"event": "failed", "work": work, "text": line}), None)


def encoded(record: Mapping[str, Any]) -> bytes:
    """A record as JSON on one line."""
    return json.dumps(record, allow_nan=False, separators=(",", ":")).encode("ascii")


def _refusal(status: HTTPStatus, text: str) -> Reply:
    return status, encoded({"error": text})


def _line(error: Exception) -> str:
    """A failure as one line."""
    return "; ".join(line.strip() for line in error_lines(error)).removeprefix("error: ")
