"""Plots are painted whatever display the environment names."""

import os
import subprocess
import sys

import pytest

PROGRAM = """
import os, sys
before = os.environ.get("MPLBACKEND")
from cellplan.report.plots.canvas import paint
from cellplan.report.plots.figure import Figure, PlotAxis, PlotPanel
x = PlotAxis(low=0.0, high=1.0)
paint(Figure(title="0", x=x, panels=[PlotPanel(title="0", y=x, items=[])]), "png")
import matplotlib
assert os.environ.get("MPLBACKEND") == before
print(matplotlib.rcParams._get("backend"))
"""


@pytest.mark.parametrize(
    ("desired", "left"),
    [
        ("module://matplotlib_inline.backend_inline", None),
        pytest.param("nonsense", None, marks=pytest.mark.slow),
        pytest.param("", None, marks=pytest.mark.slow),
        pytest.param("svg", "svg", marks=pytest.mark.slow),
    ],
)
def test_plots_are_painted_whatever_display_is_desired(desired: str, left: str | None) -> None:
    environment = {**os.environ, "MPLBACKEND": desired}

    run = subprocess.run([sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, check=False)

    assert run.returncode == 0, run.stderr
    if left is not None:
        assert run.stdout.strip() == left
