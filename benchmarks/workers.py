"""Workers: engines in processes of their own, as the one who measures sees them."""

import json
import os
import subprocess
from pathlib import Path
from typing import Any, Final

import numpy as np
from engines import Engine
from job import Array, Job, save
from peer_setup import is_installed, python_of
from reference_job import filled, thinned
from sections import ONE_THREAD

SCRIPT: Final = Path(__file__).with_name("engine_worker.py")


class Worker:
    """The process of one engine, and what is known of it so far.

    Attributes:
        engine: The engine.
        problem: Why it takes no part any more; empty while it does.
        version: Version of its package.
        cpu_s: Processor time of each run in [s].
        peak_bytes: Largest memory of the process so far.
    """

    def __init__(self, engine: Engine, job: Job, folder: Path) -> None:
        """Start the process on a job, handed over in a folder; it gets ready by itself, while others do."""
        self.engine, self.problem, self.version = engine, "", ""
        self.cpu_s: list[float] = []
        self.peak_bytes = 0.0
        self._process: subprocess.Popen[str] | None = None
        self._folder = folder
        file = folder / f"job-{engine.every}.npz"
        save(thinned(job, engine.every, engine.looks), file)
        command = [str(python_of(engine.group)), str(SCRIPT), engine.module, engine.package, str(file)]
        command.append(json.dumps(dict(engine.options)))
        if not is_installed(engine.group):
            self.problem = "not installed, see benchmarks/peer_setup.py"
            return
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, **ONE_THREAD},
        )

    def get_ready(self) -> None:
        """Wait until it can run."""
        self.version = str(self._answer().get("version", ""))

    def run(self, *, counts: bool) -> None:
        """Let it run the job once."""
        answer = self._ask("run")
        if answer and counts:
            self.cpu_s.append(float(answer["cpu_s"]))
            self.peak_bytes = float(answer["peak_bytes"])

    def joints(self) -> Array | None:
        """Joint positions of the last run at all samples, shape (N, nq); None when there are none."""
        file = self._folder / "joints.npy"
        if not self._ask(f"save {file}"):
            return None
        q: Array = np.load(file)
        if not np.all(np.isfinite(q)):
            self.problem = "its joints are not finite"
            return None
        if self.engine.every > 1:
            return filled(q[:: self.engine.looks], degree=3, parts=self.engine.every)
        return q

    def end(self) -> None:
        """Close its input, which ends it."""
        if self._process is not None:
            self._process.communicate()

    def _ask(self, question: str) -> dict[str, Any]:
        """Its answer to one question; nothing when it takes no part."""
        if self.problem or self._process is None or self._process.stdin is None:
            return {}
        try:
            self._process.stdin.write(f"{question}\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            self.problem = "it failed, see above"
            return {}
        return self._answer()

    def _answer(self) -> dict[str, Any]:
        """The next line that it writes; nothing when it takes no part."""
        if self.problem or self._process is None or self._process.stdout is None:
            return {}
        line = self._process.stdout.readline()
        answer: dict[str, Any] = json.loads(line) if line else {"missing": "it failed, see above"}
        self.problem = str(answer.get("missing", ""))
        return {} if self.problem else answer
