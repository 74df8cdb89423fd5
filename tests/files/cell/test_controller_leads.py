"""Outputs of a controller that are switched ahead, and tasks whose tools rest for them."""

from pathlib import Path

import pytest

from cellplan.errors import InvalidFileError
from cellplan.files.cell.load import load_cell

ABB = "    weights: [1, 1, 1, 1, 1, 1]\n"
CLOCK = ("motion: {duration_s: 4}\n", "motion: {step_s: 0.01}\n")
PROCESS = "{on: 'SetDO doA,1', off: 'SetDO doA,0', on_lead_s: 0.1}"
FEED = "    tool_axis: normal\n"


@pytest.fixture
def cell_text(base_cell: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The small cell with the worker on a controller whose output leads."""
    monkeypatch.chdir(tmp_path)
    text = base_cell.replace(ABB, f"{ABB}    controller: {{id: c2}}\n").replace(*CLOCK)
    return text.replace("part:\n", f"controllers:\n  c2: {{kind: abb, process: {PROCESS}}}\npart:\n", 1)


def test_a_tool_does_not_rest_for_an_output_that_is_switched_ahead(cell_text: str) -> None:
    """At the end where the output leads; at the other end it may."""

    def load_with(delays: str) -> None:
        Path("c").write_text(cell_text.replace(FEED, f"{FEED}    process: {{feed_mm_s: 50, {delays}}}\n"), "utf-8")
        load_cell("c")

    with pytest.raises(InvalidFileError) as refusal:
        load_with("on_delay_s: 0.3, off_delay_s: 0.2")
    text = "expected 0, as controllers.c2.process.on_lead_s switches its output ahead, got 0.3; state one of both"
    assert f": tasks.ring.process.on_delay_s: {text}" in str(refusal.value)
    assert "off_delay_s" not in str(refusal.value)
    load_with("off_delay_s: 0.2")
