"""Kernels of OpenBLAS, which multiply matrices and solve equations, and the features of the processor that NumPy takes.

Both decide the last digits of a figure. A test that holds under one of them only is about digits, not about a motion.
"""

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from typing import Any, Final

KERNELS: Final = ("Prescott", "Sandybridge", "Haswell", "SkylakeX")  # from SSE3 over AVX and AVX2 to AVX-512
BASELINE: Final = "baseline"  # NumPy without any feature of the processor that it was not built for
NAMES: Final = {"Katmai": "Prescott"}  # OpenBLAS has one kernel under both names and reports the older one
EXPECTED: Final = "CELLPLAN_TEST_KERNEL"  # variable with the kernel that a process of the tests must run
LIMIT_S: Final = 120.0  # [s] for a process that multiplies two small matrices, on a busy machine
PROBE: Final = """
import json
import numpy as np
from builders.kernels import features, kernels
rng = np.random.default_rng(0)
A = rng.normal(size=(60, 60))
assert np.abs(A @ np.linalg.solve(A, A) - A).max() < 1e-9
print(json.dumps([kernels(), features()]))
"""


def kernels() -> list[str]:
    """The kernels that the copies of OpenBLAS in this process run; none where NumPy has another library."""
    import numpy as np  # loads its OpenBLAS
    import threadpoolctl

    assert np.__version__
    copies: list[dict[str, Any]] = threadpoolctl.threadpool_info()
    reported = {copy["architecture"] for copy in copies if copy["internal_api"] == "openblas"}
    return sorted(NAMES.get(name, name) for name in reported)


def features() -> list[str]:
    """The features of the processor that NumPy takes beyond those it was built for."""
    from numpy._core import _multiarray_umath as core  # type: ignore[attr-defined]

    return [name for name in core.__cpu_dispatch__ if core.__cpu_features__[name]]


def environment(kernel: str | None) -> dict[str, str]:
    """Variables of a process that runs a kernel, ``BASELINE``, or with None what suits the processor."""
    given = {"OPENBLAS_CORETYPE", "NPY_DISABLE_CPU_FEATURES", EXPECTED}
    bare = {name: value for name, value in os.environ.items() if name not in given}
    if kernel is None:
        return bare
    if kernel == BASELINE:
        return {**bare, "NPY_DISABLE_CPU_FEATURES": " ".join(probed(bare)[1]), EXPECTED: BASELINE}
    return {**bare, "OPENBLAS_CORETYPE": kernel, EXPECTED: kernel}


def probed(variables: Mapping[str, str]) -> tuple[list[str], list[str]]:
    """Kernels and features of a process with such variables, which has used them.

    Raises:
        subprocess.CalledProcessError: The processor cannot run them.
    """
    path = os.pathsep.join(entry for entry in sys.path if entry)
    done = subprocess.run(
        [sys.executable, "-c", PROBE],
        env={**variables, "PYTHONPATH": path},
        check=True,
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
    )
    kernel, taken = json.loads(done.stdout)
    return kernel, taken


def hindrance(kernel: str) -> str | None:
    """Why this machine cannot run a kernel, or ``BASELINE``; None where it can.

    Raises:
        RuntimeError: The process that was to tell has failed for another reason.
    """
    try:
        result, taken = probed(environment(kernel))
    except subprocess.CalledProcessError as error:
        if error.returncode > 0:  # no signal of the processor: the environment lacks something
            raise RuntimeError(f"cannot ask for the kernel {kernel}: {error.stderr.strip().splitlines()[-1]}") from None
        return f"the processor cannot: signal {-error.returncode}"
    if kernel == BASELINE:
        return f"NumPy still takes {', '.join(taken)}" if taken else None
    return (
        None if result == [kernel] else f"OpenBLAS reports {', '.join(result) or 'nothing: NumPy has another library'}"
    )


def require_expected() -> None:
    """Refuse to test under another kernel than the one that was asked for.

    Raises:
        RuntimeError: OpenBLAS, or NumPy, reports another one.
    """
    expected = os.environ.get(EXPECTED) or None
    if expected == BASELINE and features():
        raise RuntimeError(f"expected NumPy without features of the processor, got {', '.join(features())}")
    if expected not in (None, BASELINE) and kernels() != [expected]:
        raise RuntimeError(f"expected the kernel {expected} of OpenBLAS, got {', '.join(kernels()) or 'none'}")
