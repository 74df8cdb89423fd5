"""Runs that leave the reach are refused in a moment, whatever would be searched after."""

import re
from pathlib import Path

from builders.three_feeds import THREE_FEEDS

from cellplan import Cell, load_cell
from cellplan.errors import NoSolutionError
from cellplan.runs.plan.run_reach import refuse_far_runs

FAR = 900.0  # [mm] the tool would pass the base of its arm 30 mm beside it


def cell_of(folder: Path, process: str) -> Cell:
    file = folder / "cell.yaml"
    file.write_text(THREE_FEEDS.replace("{feed_mm_s: 60}", f"{{feed_mm_s: 60, {process}}}"), encoding="utf-8")
    return load_cell(file)


def refusal(cell: Cell) -> str:
    """What is said against the runs of a cell; empty where nothing is."""
    try:
        refuse_far_runs(cell)
    except NoSolutionError as error:
        return str(error)
    return ""


def test_a_run_out_past_the_base_is_refused_with_its_place_and_the_cure(tmp_path: Path) -> None:
    words = refusal(cell_of(tmp_path, f"run_in_mm: 20, run_out_mm: {FAR}"))

    assert re.fullmatch(
        r".*cell\.yaml:46: tasks\.ring\.process\.run_out_mm: expected a run-out within the reach of 'top', got one of "
        r"900 mm: 750 mm from the work its tool stays \S+ mm and \S+ deg away at best; make it shorter, or move the "
        "base of 'top' or the part",
        words,
    )


def test_runs_within_the_reach_pass(tmp_path: Path) -> None:
    assert not refusal(cell_of(tmp_path, "run_in_mm: 20, run_out_mm: 300"))


def test_a_run_longer_than_both_arms_over_a_held_part_is_refused(tmp_path: Path) -> None:
    text = Path("cells/two_robots.yaml").read_text(encoding="utf-8")
    file = tmp_path / "cell.yaml"
    file.write_text(text, encoding="utf-8")
    cell = load_cell(file)
    task = next(task for task in cell.tasks if task.robot not in cell.positioners)
    near, far = (
        cell.with_values(
            {
                f"tasks.{task.name}.duration_s": None,
                f"tasks.{task.name}.feed_mm_s": None,
                f"tasks.{task.name}.process": {"feed_mm_s": 100, "run_in_mm": length, "run_out_mm": 10},
            }
        )
        for length in (50, 8000)
    )

    assert not refusal(near)
    assert "process.run_in_mm: expected a run-in within the reach of" in refusal(far)
