"""``cellplan edit`` from its first to its last line: what is shown, what is left, and what nobody sees."""

import json
import os
import re
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from http.client import HTTPConnection
from pathlib import Path
from typing import Any

import pytest

from cellplan.cli.edit.server import loopback_listener
from cellplan.cli.main import run

LIMIT_S = 60.0  # [s] for a step on a slow machine
RECORDER = '#!/bin/sh\necho "$@" > browser.txt\n'


class Editing:
    """A running program, and what its page would send."""

    def __init__(self, cell: Path, *arguments: str, terminal: int | None = None, **variables: str) -> None:
        usual = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
        self.folder = cell.parent
        self._output = (self.folder / "output.txt").open("w+", encoding="utf-8")
        self.process = subprocess.Popen(
            [sys.executable, "-m", "cellplan", "edit", cell.name, *arguments],
            cwd=self.folder,
            env={**usual, **variables},
            stdout=self._output,
            stderr=self._output if terminal is None else terminal,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # noqa: PLW1509 - of background jobs
        )
        self.file = self._until_there_is_a_file()
        text = self.file.read_text(encoding="utf-8")
        self.port, self.token = re.search(r"http://127\.0\.0\.1:(\d+)/#token=([\w-]{43})\"", text).groups()  # type: ignore[union-attr]

    def _until_there_is_a_file(self) -> Path:
        deadline = time.monotonic() + LIMIT_S
        while True:
            files = list(self.folder.glob("outputs/cellplan-edit-*.html"))
            if files and files[0].stat().st_size:
                return files[0]
            assert self.process.poll() is None, self.output
            assert time.monotonic() < deadline
            time.sleep(0.02)

    @property
    def output(self) -> str:
        return (self.folder / "output.txt").read_text(encoding="utf-8")

    def post(self, path: str, body: object, *, token: str | None = None) -> tuple[int, Any]:
        connection = HTTPConnection("127.0.0.1", int(self.port), timeout=LIMIT_S)
        headers = {
            "Origin": f"http://127.0.0.1:{self.port}",
            "Content-Type": "application/json",
            "X-Cellplan-Token": token or self.token,
        }
        connection.request("POST", path, json.dumps(body), headers)
        response = connection.getresponse()
        return response.status, json.loads(response.read())

    def moved(self) -> tuple[str, dict[str, Any]]:
        """The address of a base that may move, and the answer after it has moved by 5 mm."""
        status, record = self.post("/open", {})
        assert status == 200
        first = next(one for one in record["variables"] if one["kind"] == "base_x" and not one["is_locked"])
        status, answer = self.post("/change", {"number": 1, "values": {first["address"]: first["value"] + 5.0}})
        assert status == 200
        assert answer["values"][first["address"]] == first["value"] + 5.0
        return first["address"], answer

    def arguments_of_processes(self) -> str:
        """What ``ps`` would show of the program and of all processes that it has begun."""
        shown = [path.read_bytes() for path in Path("/proc").glob("[0-9]*/cmdline") if os.access(path, os.R_OK)]
        return b"\n".join(shown).decode("utf-8", "replace")

    def end(self) -> int:
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(timeout=LIMIT_S)


@pytest.fixture
def pair(cells: Path, tmp_path: Path) -> Path:
    """The planar pair, which is cheap."""
    text = (cells / "planar_pair.yaml").read_text(encoding="utf-8")
    path = tmp_path / "pair.yaml"
    path.write_text(text.replace("step_s: 0.001", "step_s: 0.01"), encoding="utf-8")
    return path


@pytest.fixture
def started() -> Iterator[Any]:
    """Starts programs, none of which outlives its test."""
    programs: list[Editing] = []

    def start(*arguments: Any, **named: Any) -> Editing:
        programs.append(Editing(*arguments, **named))
        return programs[-1]

    yield start
    for program in programs:
        program.process.kill()
        program.process.wait()


@pytest.mark.slow
def test_the_token_is_in_a_private_file_only_and_what_is_not_saved_is_said(pair: Path, started: Any) -> None:
    recorder = pair.parent / "recorder"
    recorder.write_text(RECORDER, encoding="utf-8")
    recorder.chmod(0o755)
    program, before = started(pair, BROWSER=str(recorder)), pair.read_bytes()

    mode, place = stat.S_IMODE(program.file.stat().st_mode), program.file.as_uri()
    address, answer = program.moved()
    shown = program.arguments_of_processes()

    assert (mode, program.end()) == (0o600, 130)
    assert "cellplan\0edit\0pair.yaml" in shown
    assert program.token not in shown
    assert program.token not in program.output
    assert (pair.parent / "browser.txt").read_text(encoding="utf-8").strip() == place
    assert not answer["is_saved"]
    assert program.output.splitlines()[-1] == " ".join(["editing ended; not saved:", *answer["history"]])
    assert f"--set {address}=" in program.output
    assert pair.read_bytes() == before
    assert not (pair.parent / "outputs").exists()


@pytest.mark.slow
def test_a_terminal_shows_the_address_where_no_browser_is_opened(pair: Path, started: Any) -> None:
    terminal, of_program = os.openpty()
    program = started(pair, "--no-browser", terminal=of_program)

    text = ""
    while "token=" not in text:
        text += os.read(terminal, 65_536).decode()
    status, _ = program.post("/do", {"action": "end"})

    assert f"http://127.0.0.1:{program.port}/#token={program.token}" in text
    assert (status, program.process.wait(timeout=LIMIT_S)) == (200, 0)
    assert program.output == "editing ended\n"


def until_removed(file: Path) -> None:
    """Wait until the file that led to the page is gone."""
    deadline = time.monotonic() + LIMIT_S
    while file.exists():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def as_nobody(*command: str) -> subprocess.CompletedProcess[str]:
    """Run a command as a user who is neither root nor this one."""
    drop = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups", "--"]
    return subprocess.run([*drop, *command], capture_output=True, text=True, timeout=LIMIT_S, check=False)


@pytest.mark.slow
@pytest.mark.skipif(os.getuid() != 0 or shutil.which("setpriv") is None, reason="only root can be another user")
def test_another_user_learns_nothing_of_the_session_and_reaches_nothing_of_it(started: Any, pair: Path) -> None:
    with tempfile.TemporaryDirectory() as name:  # unlike the folders of pytest, one that all users may enter
        folder = Path(name)
        folder.chmod(0o755)
        shutil.copy(pair, folder / "pair.yaml")
        program = started(folder / "pair.yaml", "--no-browser")
        address = f"http://127.0.0.1:{program.port}"

        assert as_nobody("cat", str(folder / "pair.yaml")).returncode == 0  # the test could fail
        refused = as_nobody("cat", str(program.file))
        assert (refused.stdout, "denied" in refused.stderr) == ("", True)
        processes = as_nobody("ps", "-eo", "args", "ww").stdout
        assert "cellplan edit pair.yaml" in processes
        assert program.token not in processes
        environment = as_nobody("cat", f"/proc/{program.process.pid}/environ")
        assert environment.returncode != 0
        assert program.token not in as_nobody("curl", "-s", address).stdout
        for token in ("", "x" * 43):
            headers = [f"Origin: {address}", "Content-Type: application/json", f"X-Cellplan-Token: {token}"]
            options = [part for header in headers for part in ("-H", header)]
            answer = as_nobody("curl", "-s", "-w", "%{http_code}", *options, "-d", "{}", f"{address}/open").stdout
            assert answer.endswith("403")
            assert "pair" not in answer
        assert program.file.exists()  # it is there until a page with the token has loaded
        assert program.post("/open", {})[0] == 200
        until_removed(program.file)


@pytest.mark.slow
def test_a_killed_program_leaves_the_file_as_it_was_and_a_dead_token(pair: Path, started: Any) -> None:
    first, before = started(pair, "--no-browser"), pair.read_bytes()
    first.moved()
    until_removed(first.file)
    first.process.kill()
    first.process.wait(timeout=LIMIT_S)

    second = started(pair, "--port", first.port)

    assert pair.read_bytes() == before
    assert second.port == first.port
    assert second.post("/open", {}, token=first.token)[0] == 403
    assert second.post("/open", {})[0] == 200


@pytest.mark.slow
def test_saving_writes_the_opened_file_with_its_comments(pair: Path, started: Any) -> None:
    program, before = started(pair, "--no-browser"), pair.read_text(encoding="utf-8")
    program.moved()
    status, _ = program.post("/do", {"action": "save"})

    comments = [line for line in before.splitlines() if line.lstrip().startswith("#")]
    after = pair.read_text(encoding="utf-8")
    assert status == 200
    assert after != before
    assert all(line in after for line in comments)
    assert program.end() == 130
    assert program.output.splitlines()[-1] == "editing ended"


def test_a_used_port_is_one_line(pair: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with loopback_listener(0) as listener:
        status = run(["edit", str(pair), "--port", str(listener.getsockname()[1])])

    assert status == 2
    assert capsys.readouterr().err.startswith("error: --port: ")


def test_a_broken_cell_is_a_located_line(pair: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pair.write_text("cellplan: 1\nname: [\n", encoding="utf-8")

    assert run(["edit", str(pair), "--no-browser"]) == 2
    assert re.match(r".*pair\.yaml:\d+: ", capsys.readouterr().err)
