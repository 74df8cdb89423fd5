"""The HTTP server of the live cell: a fixed table of assets, jobs of pages, and a stream of events for each page.

It answers one request on each connection and closes it, so that nothing of a request can be taken for the next one.
"""

import asyncio
import contextlib
import os
import socket
import threading
from asyncio import StreamReader, StreamWriter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from typing import Final

from cellplan.cli.edit.jobs import EVENTS, FIELDS, Job, parse_job
from cellplan.cli.edit.owner import encoded
from cellplan.cli.edit.requests import HEAD_LIMIT, RefusedRequestError, body_length, parse_head, require_permitted
from cellplan.cli.edit.responses import JSON, LINES, Events, response
from cellplan.errors import InputError

ERROR_LENGTH: Final = 500  # characters of a message
PIECE: Final = 65_536  # [bytes] that are read and dropped at a time

Assets = Mapping[str, tuple[str, bytes]]  # media type and content by path
Submit = Callable[[Job], None]  # gives a job to the thread that does it


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What a client may take.

    Attributes:
        connections: Number of them at a time.
        receive_s: Time in [s] for the head of a request, and again for its body.
        send_s: Time in [s] for a client to take a response, or an event.
        alive_s: Time in [s] between two signs of life in a stream of events.
        linger_s: Time in [s] for a client to close a connection after its response.
    """

    connections: int = 8
    receive_s: float = 5.0
    send_s: float = 10.0
    alive_s: float = 5.0
    linger_s: float = 1.0


def loopback_listener(port: int) -> socket.socket:
    """A socket that listens on the loopback address alone, on a free port where 0 is given.

    Raises:
        InputError: The port cannot be used.
    """
    try:
        return socket.create_server(("127.0.0.1", port))
    except OSError as error:
        why = os.strerror(error.errno or 0).lower()
        raise InputError(f"--port: {port} cannot be used: {why}; choose another one, or none for a free one") from None


class Server:
    """Serves the pages of one session in a thread of its own."""

    def __init__(self, listener: socket.socket, token: str, assets: Assets, *, limits: Limits | None = None) -> None:
        """Prepare to serve on a socket that listens already."""
        self._listener, self._port = listener, listener.getsockname()[1]
        self._token, self._assets, self._limits = token, assets, limits or Limits()
        self._streams: set[Events] = set()
        self._count = 0  # connections
        self._loop = asyncio.new_event_loop()
        self._end = self._loop.create_future()

    @contextlib.contextmanager
    def serving(self, submit: Submit) -> Iterator[None]:
        """Serve within the ``with`` statement; streams of events end with it."""
        self._submit = submit
        thread = threading.Thread(target=self._loop.run_until_complete, args=[self._serve()], daemon=True)
        thread.start()
        try:
            yield
        finally:
            self._loop.call_soon_threadsafe(self._end.set_result, None)
            thread.join(timeout=3.0 * self._limits.linger_s)

    def publish(self, event: bytes, but: int | None) -> None:
        """Send an event to all pages but one; called from any thread."""
        self._loop.call_soon_threadsafe(self._publish, event, but)

    def _publish(self, event: bytes, but: int | None) -> None:
        for events in self._streams:
            if but is None or events.tab != but:
                events.put(event)

    async def _serve(self) -> None:
        """Serve until the end."""
        server = await asyncio.start_server(self._connect, sock=self._listener, limit=HEAD_LIMIT)
        await self._end
        server.close()
        for events in self._streams:
            events.end()
        if connections := asyncio.all_tasks() - {asyncio.current_task()}:
            _, late = await asyncio.wait(connections, timeout=self._limits.linger_s)
            for task in late:
                task.cancel()
            await asyncio.gather(*late, return_exceptions=True)

    async def _connect(self, reader: StreamReader, writer: StreamWriter) -> None:
        """Answer the one request of a connection."""
        self._count += 1
        try:
            if self._count <= self._limits.connections:
                await self._answer(reader, writer)
            else:
                text = f"expected at most {self._limits.connections} connections; close a tab"
                await self._refuse(writer, HTTPStatus.SERVICE_UNAVAILABLE, text)
            if self._count <= 2 * self._limits.connections:
                await self._linger(reader, writer)
        except (OSError, EOFError, asyncio.CancelledError):  # the client has gone or takes nothing, or all ends
            writer.transport.abort()
        finally:
            self._count -= 1
            writer.close()

    async def _answer(self, reader: StreamReader, writer: StreamWriter) -> None:
        """Read a request and write its response."""
        try:
            target, body = await self._request(reader)
            if target in self._assets:
                await self._send(writer, response(HTTPStatus.OK, *self._assets[target]))
                return
            job = parse_job(target, body)
            if target == EVENTS:
                await self._stream(job.tab, reader, writer)
                return
            self._submit(job)
            reply = await asyncio.wrap_future(job.reply)
            await self._send(writer, response(reply[0], JSON, reply[1]))
        except RefusedRequestError as error:
            await self._refuse(writer, error.status, error.text)
        except InputError as error:
            await self._refuse(writer, HTTPStatus.BAD_REQUEST, str(error))

    async def _request(self, reader: StreamReader) -> tuple[str, bytes]:
        """The path and the body of a permitted request; the body is read only after its head was judged."""
        try:
            async with asyncio.timeout(self._limits.receive_s):
                head = parse_head(await reader.readuntil(b"\r\n\r\n"))
            require_permitted(head, port=self._port, token=self._token, gets=self._assets, posts=FIELDS)
            length = body_length(head)
            async with asyncio.timeout(self._limits.receive_s):
                return head.target, await reader.readexactly(length)
        except TimeoutError:
            text = f"expected the request within {self._limits.receive_s:g} s"
            raise RefusedRequestError(HTTPStatus.REQUEST_TIMEOUT, text) from None
        except asyncio.LimitOverrunError:
            text = f"expected at most {HEAD_LIMIT} bytes of headers"
            raise RefusedRequestError(HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE, text) from None

    async def _stream(self, tab: int | None, reader: StreamReader, writer: StreamWriter) -> None:
        """Send events until the page or the session has gone; an empty line now and then as a sign of life."""
        events = Events(tab)
        self._streams.add(events)
        gone = asyncio.ensure_future(reader.read(1))  # pages send no more: it returns when the page has gone
        gone.add_done_callback(lambda _: events.end())
        is_open = True
        try:
            await self._send(writer, response(HTTPStatus.OK, LINES, None) + b"\n")
            while is_open:
                await asyncio.wait({events.arrival}, timeout=self._limits.alive_s)
                is_open = not events.has_ended
                await self._send(writer, events.take() or b"\n")
        finally:
            self._streams.discard(events)
            gone.cancel()
            await asyncio.wait({gone}, timeout=self._limits.linger_s)  # until it has left the reader to others

    async def _send(self, writer: StreamWriter, data: bytes) -> None:
        """Write, and wait until the client has taken it."""
        writer.write(data)
        async with asyncio.timeout(self._limits.send_s):
            await writer.drain()

    async def _refuse(self, writer: StreamWriter, status: HTTPStatus, text: str) -> None:
        """Answer with a status and one line."""
        line = text.partition("\n")[0][:ERROR_LENGTH]
        await self._send(writer, response(status, JSON, encoded({"error": line})))

    async def _linger(self, reader: StreamReader, writer: StreamWriter) -> None:
        """Drop what the client still sends, so that it reads the response, until it closes the connection."""
        writer.write_eof()
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(self._limits.linger_s):
                while await reader.read(PIECE):
                    pass
