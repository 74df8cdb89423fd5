"""Pages in a real browser: headless Chromium, driven over a pipe by its own protocol.

See https://chromedevtools.github.io/devtools-protocol: commands and events are JSON objects that end with a zero byte.
"""

import io
import json
import os
import shutil
import signal
import tempfile
from base64 import b64decode
from pathlib import Path
from typing import Any, Self

import numpy as np
import pytest
from matplotlib.image import imread

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--hide-scrollbars",
    "--remote-debugging-pipe",
)
TO_BROWSER, FROM_BROWSER = 3, 4  # file descriptors that Chromium reads and writes
READY = (
    "new Promise((go) => { const look = () => document.body?.dataset.ready === 'true' ? go(1) : setTimeout(look, 20);"
)
NEXT_FRAME = "const drawn = () => new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(go)));"


class Browser:
    """A browser with one page; to be used in a ``with`` statement.

    Attributes:
        console: What the page has written to the console, and its uncaught errors.
    """

    def __init__(self, *flags: str) -> None:
        program = next(filter(None, map(shutil.which, NAMES)), None)
        if program is None:
            pytest.fail("no Chromium found: install it with 'apt-get install chromium', or your system's own way")
        self.console: list[str] = []
        self._folder = tempfile.mkdtemp(prefix="cellplan-browser-")
        to_read, self._to = os.pipe()
        self._from, to_write = os.pipe()
        moves = [(os.POSIX_SPAWN_DUP2, to_read, TO_BROWSER), (os.POSIX_SPAWN_DUP2, to_write, FROM_BROWSER)]
        quiet = (os.POSIX_SPAWN_OPEN, 2, os.devnull, os.O_WRONLY, 0)
        command = [program, *FLAGS, *flags, f"--user-data-dir={self._folder}"]
        os.set_inheritable(to_read, True)
        self._process = os.posix_spawn(program, command, os.environ, file_actions=[*moves, quiet], setsid=True)
        os.close(to_read)
        os.close(to_write)
        self._left, self._number, self._session = b"", 0, None

    def __enter__(self) -> Self:
        target = self.command("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.command("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.command(f"{domain}.enable")
        return self

    def __exit__(self, *_: object) -> None:
        os.killpg(self._process, signal.SIGKILL)
        os.waitpid(self._process, 0)
        os.close(self._to)
        os.close(self._from)
        shutil.rmtree(self._folder, ignore_errors=True)

    def command(self, method: str, **parameters: Any) -> dict[str, Any]:
        """One command and its answer."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._number:
                assert "error" not in answer, answer["error"]
                return answer["result"]
            self._note(answer)

    def open(self, page: Path, address: str = "", *, size: tuple[int, int] = (1280, 800), theme: str = "light") -> None:
        """Load a page in a file and wait until it is drawn."""
        self.visit(f"file://{page}{address}", size=size, theme=theme)
        self.run(f"await {READY} look(); }}); await drawn();")

    def visit(self, address: str, *, size: tuple[int, int] = (1280, 800), theme: str = "light") -> None:
        """Load what stands at an address."""
        self.console.clear()
        feature = {"name": "prefers-color-scheme", "value": theme}
        self.command("Emulation.setEmulatedMedia", features=[feature])
        width, height = size
        self.command(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False
        )
        self.command("Page.navigate", url="about:blank")
        self.command("Page.navigate", url=address)

    def pointer(self, kind: str, x: float, y: float) -> None:
        """A true event of the mouse with its left button: ``Pressed``, ``Moved`` or ``Released``."""
        is_held = kind != "Released"
        self.command(
            "Input.dispatchMouseEvent", type=f"mouse{kind}", x=x, y=y, button="left", buttons=int(is_held), clickCount=1
        )

    def key(self, key: str, *, modifiers: int = 0) -> None:
        """Press and release a key; modifiers are 1 alt, 2 ctrl, 4 meta and 8 shift, added."""
        for kind in ("rawKeyDown", "keyUp"):
            self.command("Input.dispatchKeyEvent", type=kind, key=key, modifiers=modifiers)

    def run(self, script: str) -> Any:
        """What the body of an async function in the page returns; errors in it fail the test."""
        text = f"(async () => {{ {NEXT_FRAME} {script} }})()"
        reply = self.command("Runtime.evaluate", expression=text, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in reply, reply["exceptionDetails"]
        return reply["result"].get("value")

    def picture(self) -> Any:
        """The window as a picture, shape (height, width, 3), from 0 to 1."""
        shot = b64decode(self.command("Page.captureScreenshot", format="png")["data"])
        return np.asarray(imread(io.BytesIO(shot)))[..., :3]

    def text(self, element: str) -> str:
        """Text of an element by its id."""
        return str(self.run(f"return document.getElementById('{element}').textContent;"))

    def _next(self) -> dict[str, Any]:
        """The next message of the browser."""
        while b"\0" not in self._left:
            more = os.read(self._from, 1 << 20)
            assert more, "the browser has ended"
            self._left += more
        message, _, self._left = self._left.partition(b"\0")
        return json.loads(message)

    def _note(self, event: dict[str, Any]) -> None:
        """Keep what an event says of the console."""
        if event.get("method") in {"Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded"}:
            text = json.dumps(event["params"])
            if "GL Driver Message" not in text:  # remarks of the software renderer about screenshots
                self.console.append(text)
