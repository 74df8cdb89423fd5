"""No cell takes more work than it used to: counts, which are the same on a slow day."""

import json
from pathlib import Path

import counts
import pytest


@pytest.mark.parametrize(
    "case",
    [pytest.param(case, marks=pytest.mark.slow if case.name == "four_robots" else ()) for case in counts.CASES],
    ids=lambda case: case.name,
)
def test_solving_a_cell_takes_no_more_work_than_it_used_to(case: counts.Case) -> None:
    assert counts.grown(case, counts.counted(case)) == []


def test_a_count_that_grew_is_named_with_the_cure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stored = tmp_path / "counts.json"
    stored.write_text(json.dumps({"arm": {"distance queries": 100, "contact queries": 100, "gone": 7}}))
    monkeypatch.setattr(counts, "STORED", stored)

    reported = counts.grown(
        counts.Case(name="arm", step_s=0.01), {"distance queries": 115, "contact queries": 116, "sweeps": 6}
    )

    cure = "find out why, or keep the new count by: python benchmarks/counts.py --write"
    assert reported == [
        f"arm: contact queries grew from 100 to 116, at most 115 expected; {cure}",
        f"arm: sweeps grew from 0 to 6, at most 5 expected; {cure}",
    ]
