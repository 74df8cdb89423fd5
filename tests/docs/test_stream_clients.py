"""The clients on the page of streams send the rows of a stream, to stand-ins of what receives them."""

import re
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from builders.shown_jobs import streamed_arm

from cellplan.programs.dialects import DIALECTS

PAGE = Path(__file__).resolve().parent.parent.parent / "docs" / "guides" / "programs-stream.md"
RSI, RTDE = re.findall(r"^```python\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.M | re.S)
PORT = "49152"
LIMIT_S = 20.0  # [s] for a client to start on a busy machine
HELD = 50  # cycles for which the client of RSI holds the last row
RECORDER = """
class RTDEControlInterface:
    def __init__(self, host): print("host", host)
    def moveJ(self, q, speed, acceleration): print("moveJ", *q)
    def initPeriod(self): return 0
    def servoJ(self, q, speed, acceleration, time, lookahead, gain): print("servoJ", time, lookahead, *q)
    def waitPeriod(self, begin): pass
    def servoStop(self): print("servoStop")
    def stopScript(self): print("stopScript")
"""


@pytest.fixture
def rows(tmp_path: Path) -> np.ndarray:
    """Positions of a stream in [deg], shape (N, 6), whose file stands in the folder of the test."""
    text = DIALECTS["stream"].render(streamed_arm())["weld.csv"]
    (tmp_path / "weld.csv").write_text(text, encoding="ascii")
    return np.loadtxt(tmp_path / "weld.csv", delimiter=",", skiprows=1)[:, 2:8]


def free_port() -> int:
    """A port that nothing uses."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def exchange(port: int, packets: list[str], client: subprocess.Popen[str]) -> list[str]:
    """Answers of a client to packets of a robot; the first packet is repeated until the client has started."""
    answers: list[str] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as robot:
        robot.connect(("127.0.0.1", port))
        robot.settimeout(0.1)
        for _ in range(int(10 * LIMIT_S)):
            try:
                robot.send(packets[len(answers)].encode("ascii"))
                answers.append(robot.recv(4096).decode("ascii"))
            except (TimeoutError, ConnectionRefusedError):
                if client.poll() is not None:
                    break
                time.sleep(0.05)
            if len(answers) == len(packets):
                break
    return answers


def packet(start: np.ndarray, ipoc: int) -> str:
    """What a robot sends in a cycle."""
    axes = " ".join(f'A{i}="{value:.4f}"' for i, value in enumerate(start, start=1))
    return f'<Rob Type="KUKA"><AIPos {axes}/><IPOC>{ipoc}</IPOC></Rob>'


def rsi_client(folder: Path, port: int) -> subprocess.Popen[str]:
    """The client of RSI on another port."""
    (folder / "client.py").write_text(RSI.replace(PORT, str(port)), encoding="ascii")
    return subprocess.Popen([sys.executable, "client.py", "weld.csv"], cwd=folder, stderr=subprocess.PIPE, text=True)


def test_the_client_of_rsi_answers_each_packet_with_the_row_of_its_cycle(rows: np.ndarray, tmp_path: Path) -> None:
    port, cycles = free_port(), len(rows) + HELD
    client = rsi_client(tmp_path, port)

    answers = exchange(port, [packet(rows[0], 1000 + 4 * k) for k in range(cycles)], client)

    assert client.wait(LIMIT_S) == 0
    assert [int(re.search(r"<IPOC>(\d+)</IPOC>", answer)[1]) for answer in answers] == [
        1000 + 4 * k for k in range(cycles)
    ]
    sent = np.array([[float(value) for value in re.findall(r'A\d="([^"]+)"', answer)] for answer in answers])
    held = np.vstack([rows, np.repeat(rows[-1:], HELD, axis=0)])
    np.testing.assert_allclose(sent, held - rows[0], atol=2e-6)  # corrections from the start, six decimals


def test_the_client_of_rsi_refuses_a_robot_that_stands_elsewhere(rows: np.ndarray, tmp_path: Path) -> None:
    port = free_port()
    client = rsi_client(tmp_path, port)

    answers = exchange(port, [packet(rows[0] + 0.02, 1000)], client)

    assert answers == []
    assert client.wait(LIMIT_S) == 1
    assert client.stderr is not None
    assert "the robot stands at" in client.stderr.read()


def test_the_client_of_rtde_sends_each_row_in_radians(rows: np.ndarray, tmp_path: Path) -> None:
    (tmp_path / "rtde_control.py").write_text(RECORDER, encoding="ascii")
    (tmp_path / "client.py").write_text(RTDE, encoding="ascii")

    run = subprocess.run(
        [sys.executable, "client.py", "weld.csv", "robot", "0.02", "0.1"],
        cwd=tmp_path,
        check=True,
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
    )

    lines = run.stdout.splitlines()
    assert [lines[0], *lines[-2:]] == ["host robot", "servoStop", "stopScript"]
    sent = np.array([line.split()[3:] for line in lines if line.startswith("servoJ 0.02 0.1 ")], dtype=float)
    np.testing.assert_allclose(sent, np.deg2rad(rows), atol=1e-12)
    np.testing.assert_allclose(np.array(lines[1].split()[1:], dtype=float), np.deg2rad(rows[0]), atol=1e-12)
