"""Responses to pages: the headers of all of them, and events that wait for one page."""

import asyncio
from http import HTTPStatus
from typing import Final

HEADERS: Final = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
    "Connection": "close",
}  # of every response
JSON: Final = "application/json"
LINES: Final = "application/x-ndjson"
ANSWER: Final = b'{"event":"answer"'  # how such an event begins
MOST_EVENTS: Final = 1000  # [-] that wait for one page; a page that has stopped reading is dropped


def response(status: HTTPStatus, kind: str, body: bytes | None) -> bytes:
    """A response; without a body its head alone, after which the body lasts until the connection is closed."""
    headers = {**HEADERS, "Content-Type": kind} | ({} if body is None else {"Content-Length": str(len(body))})
    lines = [f"HTTP/1.1 {status} {status.phrase}", *(f"{name}: {value}" for name, value in headers.items())]
    return "".join(f"{line}\r\n" for line in [*lines, ""]).encode("ascii") + (body or b"")


class Events:
    """Events that wait for one page; of answers only the newest one does."""

    def __init__(self, tab: int | None) -> None:
        """Begin without any."""
        self.tab, self.has_ended = tab, False
        self.arrival: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._lines: list[bytes] = []

    def put(self, event: bytes) -> None:
        """Add an event."""
        if event.startswith(ANSWER):
            self._lines = [line for line in self._lines if not line.startswith(ANSWER)]
        self._lines.append(event)
        self.has_ended |= len(self._lines) > MOST_EVENTS
        self._arrive()

    def end(self) -> None:
        """Let the stream end after what waits."""
        self.has_ended = True
        self._arrive()

    def take(self) -> bytes:
        """All that wait, one on each line."""
        if not self.has_ended:
            self.arrival = asyncio.get_running_loop().create_future()
        lines, self._lines = self._lines, []
        return b"".join(line + b"\n" for line in lines)

    def _arrive(self) -> None:
        """Let the stream go on."""
        if not self.arrival.done():
            self.arrival.set_result(None)
