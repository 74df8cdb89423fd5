"""One engine in a process of its own: ``python benchmarks/engine_worker.py MODULE PACKAGE JOB OPTIONS``.

It says on standard output that it is ready, or why not; then it runs the job whenever it reads ``run`` and writes the
joints of the last run into a file when it reads ``save FILE``. Each answer is one line of JSON. Everything that a
library prints goes to the error stream.
"""

import importlib
import importlib.metadata
import json
import os
import resource
import sys
import time
from pathlib import Path
from typing import Any

import job
import numpy as np

MAXRSS_UNIT = 1 if sys.platform == "darwin" else 1024  # [bytes] ru_maxrss is in kilobytes but on a Mac


def main() -> None:
    """Prepare, then answer until the other side has no more questions."""
    module, package, path, options = sys.argv[1:]
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())

    def answer(**figures: Any) -> None:
        print(json.dumps(figures), file=answers, flush=True)

    try:
        run = importlib.import_module(f"engines.{module}").prepare(job.load(Path(path)), **json.loads(options))
    except ImportError as error:
        answer(missing=str(error))
        return
    answer(version=importlib.metadata.version(package))
    q = np.empty((0, 0))
    for line in sys.stdin:
        question, _, file = line.strip().partition(" ")
        if question == "run":
            begin = time.process_time()
            q = run()
            answer(cpu_s=time.process_time() - begin, peak_bytes=peak())
        else:
            np.save(file, q)
            answer(saved=file)


def peak() -> int:
    """Largest memory of this process so far in [bytes].

    Linux tells it twice. The figure for children includes what the parent held when it started this process, so the
    other one is taken where there is one.
    """
    try:
        lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * MAXRSS_UNIT
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith("VmHWM:"))


if __name__ == "__main__":
    main()
