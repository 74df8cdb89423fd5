"""Figures that pages quote are those of the page, or of the function, that they come from."""

import re
from pathlib import Path

import numpy as np
import pytest

from cellplan.model.task.task import TimeLaw, TimeLawKind
from cellplan.model.task.time_law import advance, peak_rate

DOCS = Path(__file__).resolve().parent.parent.parent / "docs"
TAU = np.linspace(0.0, 1.0, 60_001)


def rows(page: str, heading: str) -> dict[str, list[str]]:
    """Cells of the first table below a heading, by the first cell of each row."""
    text = (DOCS / page).read_text(encoding="utf-8").partition(f"## {heading}\n")[2]
    table = re.search(r"(?:^\|.*\|\n)+", text, re.MULTILINE)
    assert table is not None
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in table[0].splitlines()[2:]]
    return {first: others for first, *others in cells}


def test_the_comparison_quotes_the_benchmarks() -> None:
    measured = rows("benchmarks.md", "The reference job, beside other libraries")
    quoted = rows("comparison.md", "What was measured")

    assert len(quoted) >= 6
    for engine, (cpu, error, drift) in quoted.items():
        figures = measured[engine]
        assert cpu == figures[0]
        assert drift == figures[7]
        if engine.startswith("cellplan"):
            assert error == f"{figures[4]} straight, {figures[5]} smooth"
        else:
            assert error == figures[4]


@pytest.mark.parametrize(
    ("law", "rate", "acceleration"),
    [
        (TimeLaw(kind=TimeLawKind.QUINTIC), 1.875, 10.0 / np.sqrt(3.0)),
        (TimeLaw(kind=TimeLawKind.TRAPEZOID, ramp=0.2), 1.25, 6.25),
        (TimeLaw(kind=TimeLawKind.TRAPEZOID, ramp=0.5), 2.0, 4.0),
    ],
)
def test_the_page_of_time_laws_states_their_peaks(law: TimeLaw, rate: float, acceleration: float) -> None:
    shares = advance(law, TAU)

    assert np.gradient(shares.share, TAU).max() == pytest.approx(rate, rel=1e-4)  # differences, not the formula
    assert np.abs(np.gradient(shares.rate, TAU)[2:-2]).max() == pytest.approx(acceleration, rel=1e-3)
    assert peak_rate(law) == pytest.approx(rate)


def test_every_source_of_the_comparison_is_numbered_and_used() -> None:
    text, _, sources = (DOCS / "comparison.md").read_text(encoding="utf-8").partition("## Sources\n")
    used = {int(number) for group in re.findall(r"\[(\d+(?:, \d+)*)\]", text) for number in group.split(", ")}
    numbered = [int(number) for number in re.findall(r"^(\d+)\. .+: <https://[^>]+>$", sources, re.MULTILINE)]

    assert numbered == list(range(1, len(numbered) + 1))
    assert used == set(numbered)
