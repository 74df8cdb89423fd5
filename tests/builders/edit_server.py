"""A server of the live cell with a session of two numbers, and requests to it by raw sockets."""

import json
import socket
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from cellplan.cli.edit.owner import Owner
from cellplan.cli.edit.server import Limits, Server, loopback_listener
from cellplan.errors import InputError
from cellplan.report.record.common import Record

TOKEN = "t" * 43
ASSETS = {"/": ("text/html; charset=utf-8", b"<p>page</p>"), "/edit.js": ("text/javascript; charset=utf-8", b"go();")}
LIMIT_S = 20.0  # [s] for a response on a slow machine
FAST = Limits(receive_s=0.3, send_s=2.0, alive_s=0.2, linger_s=0.2)


class TwoNumbers:
    """A session whose answer is its values; the smallest that keeps to what is agreed."""

    def __init__(self) -> None:
        self.values = {"x": 1.0, "y": 2.0}
        self.calls: list[tuple[str, Any]] = []
        self.events: list[Record] = []
        self.version, self.is_settled = 0, True
        self.pieces = 0  # of what would help, that are left
        self.may_change = threading.Event()  # lets a change wait, as a long computation would
        self.may_change.set()

    def answer(self, number: int = 0) -> dict[str, Any]:
        history = [f"--set {address}={value:g}" for address, value in self.values.items()]
        is_saved = self.values == {"x": 1.0, "y": 2.0}
        return {
            "number": number,
            "version": self.version,
            "values": dict(self.values),
            "is_settled": self.is_settled,
            "is_saved": is_saved,
            "history": history,
        }

    def open_record(self) -> Record:
        return {"schema": "cellplan.edit/1", "answer": self.answer()}

    def change(self, values: Mapping[str, float], *, block: int | None = None, number: int = 0) -> Record:
        self.calls.append(("change", dict(values)))
        self.may_change.wait(LIMIT_S)
        if unknown := sorted(values.keys() - self.values.keys()):
            raise InputError(f"{unknown[0]}: is no address of this cell")
        self.values |= values
        self.version, self.is_settled = self.version + 1, False
        return self.answer(number)

    def advise(self) -> bool:
        self.pieces -= 1
        return self.pieces >= 0

    def settle(self) -> Record | None:
        if self.is_settled:
            return None
        self.is_settled = True
        return self.answer()

    def do(self, action: str, argument: float | None = None) -> Record:
        self.calls.append((action, argument))
        if action == "repair":
            raise RuntimeError("a fault of the program")
        return self.answer()

    def poll(self) -> list[Record]:
        events, self.events = self.events, []
        return events


class Served:
    """A running server."""

    def __init__(self, session: TwoNumbers, server: Server, owner: Owner, port: int) -> None:
        self.session, self.server, self.owner, self.port = session, server, owner, port

    def connect(self) -> socket.socket:
        return socket.create_connection(("127.0.0.1", self.port), timeout=LIMIT_S)

    def head(self, path: str, **headers: str | None) -> dict[str, str]:
        """The headers of a permitted POST, with others in their place; None leaves one out."""
        usual = {
            "Host": f"127.0.0.1:{self.port}",
            "Origin": f"http://127.0.0.1:{self.port}",
            "Content-Type": "application/json",
            "X-Cellplan-Token": TOKEN,
        }
        changed = {name.replace("_", "-"): value for name, value in headers.items()}
        return {name: value for name, value in {**usual, **changed}.items() if value is not None}

    def post(self, path: str, body: object = None, **headers: str | None) -> tuple[int, dict[str, str], bytes]:
        """Status, headers and body of the response to a POST."""
        data = body if isinstance(body, bytes) else json.dumps({} if body is None else body).encode()
        return self.send(
            f"POST {path} HTTP/1.1", {**self.head(path, **headers), "Content-Length": str(len(data))}, data
        )

    def get(self, path: str, **headers: str) -> tuple[int, dict[str, str], bytes]:
        return self.send(f"GET {path} HTTP/1.1", {"Host": f"127.0.0.1:{self.port}", **headers})

    def send(self, line: str, headers: Mapping[str, str], data: bytes = b"") -> tuple[int, dict[str, str], bytes]:
        head = "".join(f"{text}\r\n" for text in [line, *(f"{name}: {value}" for name, value in headers.items()), ""])
        return self.exchange(head.encode("latin-1") + data)

    def exchange(self, data: bytes) -> tuple[int, dict[str, str], bytes]:
        """Send bytes and read until the server closes the connection."""
        with self.connect() as connection:
            connection.sendall(data)
            return parsed(everything(connection))

    @contextmanager
    def events(self, tab: int | None = None) -> Iterator[Any]:
        """The stream of events as an iterator of JSON objects, without the signs of life."""
        body = json.dumps({} if tab is None else {"tab": tab}).encode()
        lines = [f"{name}: {value}\r\n" for name, value in self.head("/events").items()]
        with self.connect() as connection:
            head = f"POST /events HTTP/1.1\r\n{''.join(lines)}Content-Length: {len(body)}\r\n\r\n"
            connection.sendall(head.encode() + body)
            with connection.makefile("rb") as file:
                assert file.readline().startswith(b"HTTP/1.1 200")
                while file.readline().strip():
                    pass
                assert file.readline() == b"\n"  # the stream has begun
                yield (json.loads(line) for line in file if line.strip())


def everything(connection: socket.socket) -> bytes:
    pieces = []
    while piece := connection.recv(65536):
        pieces.append(piece)
    return b"".join(pieces)


def parsed(data: bytes) -> tuple[int, dict[str, str], bytes]:
    head, _, body = data.partition(b"\r\n\r\n")
    first, *lines = head.decode().split("\r\n")
    return int(first.split()[1]), dict(line.split(": ", 1) for line in lines), body


@contextmanager
def served(limits: Limits = FAST) -> Iterator[Served]:
    """A server of two numbers within the ``with`` statement."""
    session, listener = TwoNumbers(), loopback_listener(0)
    server = Server(listener, TOKEN, ASSETS, limits=limits)
    owner = Owner(session, server.publish)
    thread = threading.Thread(target=owner.run, daemon=True)
    with server.serving(owner.submit):
        thread.start()
        yield Served(session, server, owner, listener.getsockname()[1])
        session.may_change.set()
        owner.end("the test is over")
        thread.join(LIMIT_S)
