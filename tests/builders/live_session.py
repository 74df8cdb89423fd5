"""A session of the live cell for tests of its page: a small server whose answers are simple functions of the values."""

import json
import threading
import time
from base64 import b64decode
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from queue import Empty, Queue
from typing import Any

import numpy as np

from cellplan.cli.edit.page.texts import page_texts
from cellplan.geometry.transforms import pose
from cellplan.jobs.view.result import packed
from cellplan.jobs.view.write import ViewRequest, view

Record = dict[str, Any]
TOKEN = "t" * 43
POLICY = "default-src 'none'; script-src 'self'; style-src 'self'; img-src data: blob:; connect-src 'self'"
KINDS = {"x_mm": "base_x", "y_mm": "base_y", "z_mm": "base_z", "yaw_deg": "base_yaw"}
LOST_FROM = 2500.0  # [mm] of x of the right base, from which the job of this fake breaks off


@dataclass
class FakeSession:
    """Answers of a session without an engine.

    Attributes:
        record: What a page gets when it opens.
        received: Bodies of requests by address, in their order.
        events: What the stream says next.
    """

    record: Record
    received: list[tuple[str, Record]] = field(default_factory=list)
    events: Queue[Record] = field(default_factory=Queue)
    version: int = 0
    state: str = "planned"
    delay_s: float = 0.0
    refusal: str = ""
    reasons: list[str] = field(default_factory=list)

    def change(self, values: Mapping[str, float], block: int | None) -> Record:
        """Take values; nothing is certified then."""
        self.record["answer"]["values"] |= values
        self.state = (
            "breaks off" if self.record["answer"]["values"]["robots.right.base.x_mm"] > LOST_FROM else "planned"
        )
        return self.answer(block)

    def answer(self, block: int | None = None) -> Record:
        """The answer for the values as they are: bases where these say, and a figure that is the sum of them."""
        self.version += 1
        answer = self.record["answer"]
        values, is_lost = answer["values"], self.state == "breaks off"
        for number, robot in enumerate(self.record["view"]["scenes"][0]["robots"]):
            x, y, z, yaw = (values[f"robots.{robot['name']}.base.{key}"] for key in KINDS)
            X_WB = pose(1e-3 * np.array([x, y, z]), np.array([0.0, 0.0, np.deg2rad(yaw)]))
            answer["poses"]["bases"][number] = X_WB.ravel().tolist()
        answer |= {
            "version": self.version,
            "state": self.state,
            "verdict": " ".join(["left/C leaves its range", *self.reasons]) if is_lost else "all limits hold",
            "reasons": self.reasons if is_lost else [],
            "lost_at": 0.6 if is_lost else None,
            "block": answer["block"] if block is None else block,
            "figures": [_margin(sum(values.values()), is_met=not is_lost)],
            "history": [f"--set {address}={value:g}" for address, value in values.items()],
            "is_settled": True,
            "is_saved": False,
        }
        return deepcopy(answer)

    def do(self, action: str, argument: float | None) -> Record:
        """Certify at once; anything else changes nothing."""
        if action == "certify":
            self.state = "certified"
            answer = deepcopy(self.record["answer"])
            shown = {**{key: answer[key] for key in ("values", "poses")}, "motions": {"0": answer["motion"]}}
            verdict = {"event": "verdict", "work": "certify", "version": self.version, "passed": True}
            self.events.put({**verdict, "lines": [], "picture": shown})
        return self.answer()


def _margin(value: float, *, is_met: bool) -> Record:
    return {
        "name": "smallest margin",
        "value": value,
        "unit": "deg",
        "limit": 0.0,
        "is_met": is_met,
        "binds": "left/A",
        "at": 0.5,
    }


def fake_session(cell: Path) -> FakeSession:
    """A session of a cell whose motion is one row and the same row again, a second later."""
    record = json.loads(json.dumps(view(ViewRequest(path=cell))[0]))
    scene = record["scenes"][0]
    row = np.frombuffer(b64decode(scene["motion"]["q"]), dtype="<f4")
    motion = {
        "count": 2,
        "total": 2,
        "times": packed(np.array([0.0, 1.0]), "<f8"),
        "q": packed(np.concatenate([row, row]), "<f4"),
        "phases": [],
    }
    variables = list(_variables(scene))
    answer = {
        "number": 0,
        "values": {variable["address"]: variable["value"] for variable in variables},
        "block": 0,
        "motion": motion,
        "poses": {"bases": [None] * len(scene["robots"]), "tools": [r["tip"] for r in scene["robots"]], "bodies": {}},
        "worst": {"times": [0.0, 0.5, 1.0], "values": [0.2, 0.7, 1.1]},
        "strip": [{"name": name, "state": "planned", "text": ""} for name in ("first", "second")],
        "advice": [
            {"robot": 1, "direction": [0.0, 1.0, 0.0], "step_mm": 20.0, "text": "20 mm along +y: +3.1 deg margin"}
        ],
        "can": {"undo": True, "redo": False, "save": True},
    }
    opened = {"schema": "cellplan.edit/1", "cell": record["cell"], "file": cell.name, "view": record}
    session = FakeSession(
        {**opened, "variables": variables, "blocks": [], "demands": {}, "certified": None, "answer": answer}
    )
    session.answer()
    return session


def _variables(scene: Record) -> Iterator[Record]:
    """Place and heading of all bases; that of the idle robot is locked, and that of the right one has a range in x."""
    for base in scene["bases"]:
        name = scene["robots"][base["robot"]]["name"]
        for key, value in zip(KINDS, [*base["xyz_mm"], base["rpy_deg"][2]], strict=True):
            is_varied = (name, key) == ("right", "x_mm")
            unit = "deg" if key.endswith("deg") else "mm"
            reach = 1000.0 if is_varied else 9000.0
            yield {
                "address": f"robots.{name}.base.{key}",
                "label": key.partition("_")[0],
                "kind": KINDS[key],
                "subject": name,
                "unit": unit,
                "value": value,
                "given": value,
                "lower": value - reach,
                "upper": value + reach,
                "is_locked": name == "idle",
                "is_varied": is_varied,
            }


def _handler(session: FakeSession) -> type[BaseHTTPRequestHandler]:
    texts = page_texts()

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def log_message(self, *_: object) -> None:
            """Say nothing."""

        def do_GET(self) -> None:
            kind, text = texts[self.path]
            self._send(200, kind, text.encode())

        def do_POST(self) -> None:
            body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            if self.headers["X-Cellplan-Token"] != TOKEN:
                self._send(403, "text/plain", b"wrong token")
                return
            tab = body.pop("tab")
            assert isinstance(tab, int)
            session.received.append((self.path, body))
            if self.path == "/events":
                self._stream()
                return
            time.sleep(session.delay_s)
            if session.refusal:
                self._send(400, "application/json", json.dumps({"error": session.refusal}).encode())
                return
            answers = {
                "/open": lambda: session.record,
                "/change": lambda: {**session.change(body["values"], body["block"]), "number": body["number"]},
                "/do": lambda: session.do(body["action"], body.get("argument")),
            }
            self._send(200, "application/json", json.dumps(answers[self.path]()).encode())

        def _stream(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "application/x-ndjson")
            self.send_header("Connection", "close")
            self.end_headers()
            self.close_connection = True
            while True:
                try:
                    event = session.events.get(timeout=0.5)
                except Empty:
                    event = None
                if event == {"event": "cut"}:
                    return
                line = b"\n" if event is None else json.dumps(event).encode() + b"\n"
                try:
                    self.wfile.write(line)
                except OSError:
                    return

        def _send(self, status: int, kind: str, body: bytes) -> None:
            self.send_response(status)
            self.send_header("Content-Type", f"{kind}; charset=utf-8")
            self.send_header("Content-Length", str(len(body)))
            self.send_header("Content-Security-Policy", POLICY)
            self.end_headers()
            self.wfile.write(body)

    return Handler


@contextmanager
def serving(session: FakeSession) -> Iterator[str]:
    """The address of a server of a session, with its token."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), _handler(session))
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}/#token={TOKEN}"
    finally:
        session.events.put({"event": "cut"})
        server.shutdown()
        server.server_close()
