"""Run the numerical tests under several kernels of OpenBLAS, and once without what NumPy takes of the processor.

    python tests/kernels.py                            what `make test-kernels` runs
    python tests/kernels.py Haswell baseline -- -x     some kernels, and options for pytest

A kernel that the processor cannot run is named, and is no failure. Every process of the tests
asserts the kernel that OpenBLAS reports: a name that it does not know leaves it with its own choice in silence.
"""

import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = ("certify", "checks", "geometry", "measures", "planning", "scene", "search")
QUICK = ("-q", "-m", "not slow", "--assert=plain", "-p", "no:cacheprovider")
LIMIT_S = 7200.0  # [s] for all tests under one kernel


def tested(kernel: str, options: list[str]) -> str:
    """What became of the tests under a kernel."""
    begun = time.monotonic()
    folders = [str(ROOT / "tests" / folder) for folder in FOLDERS]
    same_bytes = str(ROOT / "tests" / "jobs" / "test_determinism.py")
    command = [sys.executable, "-m", "pytest", *QUICK, *options, *folders, same_bytes]
    run = subprocess.run(command, cwd=ROOT, env=environment(kernel), check=False, timeout=LIMIT_S)
    result = "passed" if run.returncode == 0 else f"FAILED (exit status {run.returncode})"
    return f"{result} in {time.monotonic() - begun:.0f} s"


def main(arguments: list[str]) -> int:
    """Exit status: 0 when all that can be run passed."""
    cut = arguments.index("--") if "--" in arguments else len(arguments)
    names, options = arguments[:cut] or [*KERNELS, BASELINE], arguments[cut + 1 :]
    if unknown := [name for name in names if name not in (*KERNELS, BASELINE)]:
        sys.stderr.write(f"kernels: expected {', '.join((*KERNELS, BASELINE))}, got {', '.join(unknown)}\n")
        return 2
    results = {}
    for name in names:
        reason = hindrance(name)
        sys.stderr.write(f"kernel {name}: {reason or 'testing'}\n")
        results[name] = tested(name, options) if reason is None else f"not run: {reason}"
    sys.stdout.write("".join(f"{name:12} {result}\n" for name, result in results.items()))
    return int(any(result.startswith("FAILED") for result in results.values()))


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT / "tests"))
    from builders.kernels import BASELINE, KERNELS, environment, hindrance

    sys.exit(main(sys.argv[1:]))
