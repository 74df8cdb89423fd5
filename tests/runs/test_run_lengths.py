"""Runs of auto are as long as the limits of the joints need: a little shorter ones do not hold."""

import re
from pathlib import Path

import pytest

from cellplan import Cell, Solution, load_cell
from cellplan.errors import CellplanError, InputError
from cellplan.jobs.fastest.shortest import fastest
from cellplan.jobs.present.result_tables import NOWHERE
from cellplan.model.progress import silent
from cellplan.report.record.run import run_record
from cellplan.report.text.run import run_rows
from cellplan.runs.run_lengths import refuse_open_runs
from cellplan.runs.solve import solve_motion

FEED, ACCELERATION = 0.3, 1.5  # [m/s], [m/s2]
NEEDED = 0.75 * FEED**2 / ACCELERATION  # [m] of a ramp whose acceleration is just that


def slide(folder: Path, process: str, **values: object) -> Cell:
    """An axis that slides along x with a tool: its acceleration is that of the tool."""
    (folder / "slide.yaml").write_text(
        """\
robot: slide
source: made for a test
joints:
  x: {type: prismatic, axis: [1, 0, 0], lower_mm: -400, upper_mm: 400, velocity_mm_s: 2000, acceleration_mm_s2: 1500}
flange: {xyz_mm: [0, 0, 200]}
bodies: {accuracy_mm: 1, source: made for a test, solids: []}
""",
        encoding="utf-8",
    )
    file = folder / "cell.yaml"
    file.write_text(
        f"""\
cellplan: 1
name: slide
robots:
  axis: {{model: slide.yaml, tool: {{xyz_mm: [0, 0, 0], rpy_deg: [180, 0, 0]}}, start: auto}}
part:
  geometry: {{box: {{size_mm: [300, 100, 10]}}}}
  at: {{xyz_mm: [0, 0, 195]}}
tasks:
  bead:
    robot: axis
    path: {{polyline: {{points_mm: [[-100, 0], [100, 0]], plane: xy}}, offset_mm: 5}}
    tool_axis: -z
    axes: [x]
    process: {{feed_mm_s: 300, {process}}}
motion: {{step_s: 0.002, jerk_build_up_s: unlimited}}
""",
        encoding="utf-8",
    )
    return load_cell(file).with_values(values)


def planned(cell: Cell) -> Solution:
    return solve_motion(cell, task=None, progress=silent)[1]


def lengths(solution: Solution) -> tuple[float, float]:
    process = solution.cell.tasks[0].process
    assert process is not None
    return process.runs


def failed(solution: Solution) -> set[str]:
    return {check.name for run in solution.runs for check in run.report.checks if not check.passed}


def test_a_run_is_as_long_as_the_acceleration_needs(tmp_path: Path) -> None:
    solution = planned(slide(tmp_path, "run_in_mm: auto, run_out_mm: auto"))

    for length in lengths(solution):
        assert NEEDED * 0.999 < length < NEEDED / 0.95**2 + 1e-4
    assert not failed(solution)
    shorter = planned(slide(tmp_path, f"run_in_mm: {990 * NEEDED}, run_out_mm: {990 * NEEDED}"))
    assert "joint_acceleration" in failed(shorter)


def test_the_solved_cell_states_the_lengths_and_gives_the_same_tables(tmp_path: Path) -> None:
    solution = planned(slide(tmp_path, "run_in_mm: auto, run_out_mm: auto"))
    run_in, run_out = (1e3 * length for length in lengths(solution))

    again = planned(slide(tmp_path, f"run_in_mm: {run_in:.6g}, run_out_mm: {run_out:.6g}"))

    assert again.program.tables == solution.program.tables
    record = run_record(solution.runs[0], provenance=NOWHERE)
    assert [row[1] for row in run_rows(record["tasks"])] == [f"{run_in:.3g} mm and {run_out:.3g} mm"]


@pytest.mark.slow
def test_the_greatest_feed_has_runs_of_its_length(tmp_path: Path) -> None:
    """Not above the range: the run grows with the square of the feed."""
    cell = slide(tmp_path, "run_in_mm: auto, ramp_mm: 90", **{"tasks.bead.process.feed_mm_s": [100, 350]})

    solution = planned(cell)

    process = solution.cell.tasks[0].process
    assert process is not None
    assert process.feed == pytest.approx(0.35, rel=1e-5)
    assert NEEDED < process.runs[0] * (FEED / process.feed) ** 2 < NEEDED / 0.95**2 + 1e-4


def test_a_run_that_leaves_the_reach_is_refused_with_its_length(tmp_path: Path) -> None:
    cell = slide(tmp_path, "run_in_mm: auto", **{"tasks.bead.process.feed_mm_s": 900})

    with pytest.raises(CellplanError, match=r"cell\.yaml:14: tasks\.bead\.process\.run_in_mm: auto tried \d") as caught:
        planned(cell)

    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_fastest_takes_the_lengths_at_the_feed_of_the_cell(tmp_path: Path) -> None:
    cycles = fastest(slide(tmp_path, "run_in_mm: auto, run_out_mm: auto"), points=0)

    assert lengths(cycles.by_common_speed.solution)[0] == pytest.approx(NEEDED, rel=0.12)


def test_a_search_of_layouts_needs_lengths(tmp_path: Path) -> None:
    cell = slide(tmp_path, "run_in_mm: auto")

    with pytest.raises(InputError, match=re.escape("run_in_mm: expected a length in mm for a layout search, got auto")):
        refuse_open_runs(cell, "a layout search")
