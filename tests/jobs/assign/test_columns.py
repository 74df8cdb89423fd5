"""Moving blocks end to end: a drum that turns once for two rings, and cells in which nothing can turn."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from cellplan.errors import ImpossibleTasksError
from cellplan.files.cell.load import load_cell
from cellplan.jobs.assign.assign import Assignment, assign
from cellplan.jobs.assign.columns import verified_columns
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.jobs.assign.result import assign_record
from cellplan.jobs.assign.write import write_assignment
from cellplan.model.progress import silent
from cellplan.runs.solve import solve
from cellplan.runs.write_run import write_run
from cellplan.scene.scene import Scene
from cellplan.search.assign.problem.goals import task_goals
from cellplan.search.assign.schedules.schedule import refuse_impossible

EXAMPLES = Path(__file__).resolve().parents[3] / "examples" / "open_tasks"
AT_REST = 35.6  # [s] of the same rings in six arcs each, at six poses of the part
pytestmark = pytest.mark.slow


def changed(folder: Path, *changes: tuple[str, str], name: str = "drum.yaml") -> AssignmentDraft:
    shutil.copytree(EXAMPLES, folder, dirs_exist_ok=True)
    text = (folder / name).read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / name).write_text(text)
    return AssignmentDraft.load(folder / name)


@pytest.fixture(scope="module")
def drum() -> Assignment:
    return assign(AssignmentDraft.load(EXAMPLES / "drum.yaml"), effort=1)


def test_two_rings_are_done_in_one_turn_of_the_drum(drum: Assignment) -> None:
    """The turn takes as long as a ring at its feed; the bound says that no two blocks are shorter."""
    record = assign_record(drum)
    ring = 2.0 * np.pi * 150.0 / 50.0

    assert drum.passed
    refuse_impossible(drum.instance, drum.sequenced.schedule)
    assert len(drum.sequenced.schedule.blocks) == 1
    assert record["blocks"][0]["part_moves"] is True
    assert "of blocks in which the part moves" in record["bound_holds_for"]
    assert drum.bound is not None
    assert ring < drum.bound <= drum.model_cycle <= drum.cycle <= 1.005 * drum.model_cycle
    assert drum.cycle < 0.7 * AT_REST
    assert all(task.holder_moves for task in drum.cell.tasks)


def test_the_holder_ends_where_the_column_says(drum: Assignment) -> None:
    """The program's own motion, planned once more from what is written, against the station with two ends."""
    (station, _), stations = drum.sequenced.stops[0], drum.instance.stations
    assert station is not None
    work = next(run for run in drum.solution.runs if run.schedule.tasks)
    table = work.motion.q[:, drum.cell.columns("table")]

    assert np.abs(table[0] - stations.q[station]).max() < 1e-6
    assert np.abs(table[-1] - stations.left[station]).max() < 1e-5
    assert abs(table[-1, 1] - table[0, 1]) == pytest.approx(2.0 * np.pi, abs=0.02)
    for end in drum.sequenced.stops[0][1]:
        assert end is not None
        q = work.motion.q[:, drum.cell.columns(end.mode.robot)]
        assert max(np.abs(q[0] - end.begin).max(), np.abs(q[-1] - end.end).max()) < 1e-5


def test_the_written_program_solves_to_the_same_run(drum: Assignment, tmp_path: Path) -> None:
    write_assignment(drum, EXAMPLES / "drum.yaml", tmp_path / "out")
    write_run(solve(load_cell(tmp_path / "out" / "best.yaml")), tmp_path / "again")

    text = (tmp_path / "out" / "best.yaml").read_text()
    assert text.count("holder_moves: true") == 2
    assert "during them, but for blocks in which it carries" in (tmp_path / "again" / "report.html").read_text()
    for robot in ("table", "north", "south"):
        tables = [tmp_path / it / "tables" / f"{robot}.csv" for it in ("again", "out/run")]
        assert tables[0].read_bytes() == tables[1].read_bytes()


def test_a_drum_beside_the_axis_has_no_moving_blocks(tmp_path: Path) -> None:
    aside = changed(
        tmp_path, ("{robot: table, at: {xyz_mm: [0, 0, -270]}}", "{robot: table, at: {xyz_mm: [20, 0, -270]}}")
    )
    goals = task_goals(aside.cell, aside.robots)

    assert verified_columns(aside, goals, Scene.from_cell(aside.cell), silent) == []
    with pytest.raises(ImpossibleTasksError) as refused:
        assign(aside, effort=1)
    assert "tasks.near_rim: none of north, south can do it" in str(refused.value)
    assert "groups" not in str(refused.value)


def test_without_the_key_it_is_named_where_a_turn_would_help(tmp_path: Path) -> None:
    with pytest.raises(ImpossibleTasksError, match=r"write assign\.groups: true, so that the part tur"):
        assign(changed(tmp_path, ("  groups: true\n", "")), effort=1)


def test_where_nothing_can_turn_the_key_changes_no_program(tmp_path: Path) -> None:
    without = assign(changed(tmp_path / "a", name="open_frame.yaml"), effort=1)
    key = ("assign:\n", "assign:\n  groups: true\n")
    given = assign(changed(tmp_path / "b", key, name="open_frame.yaml"), effort=1)

    assert given.counts == {**without.counts, "moving_blocks": 0}
    assert given.bound == without.bound
    assert np.array_equal(given.solution.motion.q, without.solution.motion.q)
