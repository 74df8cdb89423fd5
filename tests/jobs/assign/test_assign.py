"""Whole assignments: solved, within their bound, kept as they were written, and refused where nobody can do a task."""

from pathlib import Path

import pytest
from builders.commands import run_command

from cellplan.errors import NoSolutionError
from cellplan.files.cell.load import load_cell
from cellplan.jobs.assign.assign import Assignment, assign
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.jobs.assign.result import assign_record, write_assignment
from cellplan.runs.solve import solve
from cellplan.search.assign.schedule import refuse_impossible

OPEN = Path(__file__).resolve().parents[3] / "examples" / "open_tasks" / "open_frame.yaml"
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def assignment() -> Assignment:
    return assign(AssignmentDraft.load(OPEN), effort=1)


def test_the_program_passes_within_its_bound(assignment: Assignment) -> None:
    assert assignment.passed
    refuse_impossible(assignment.instance, assignment.sequenced.schedule)
    assert assignment.bound is not None
    assert assignment.bound <= assignment.model_cycle <= assignment.cycle <= 1.005 * assignment.model_cycle
    assert assignment.cycle < assignment.greedy


def test_the_written_cell_keeps_its_words_and_gives_the_program_again(assignment: Assignment, tmp_path: Path) -> None:
    record = write_assignment(assignment, OPEN, tmp_path / "out")

    text = (tmp_path / "out" / "best.yaml").read_text()
    again = solve(load_cell(tmp_path / "out" / "best.yaml"))
    assert "# Eight seams on a plate" in text
    assert "robot: any  #" not in text.replace("# was robot: any", "")
    assert again.passed
    assert sum(run.report.cycle_time for run in again.runs) == pytest.approx(record["cycle_time_s"])
    assert {name for block in record["blocks"] for name in block["tasks"]} <= {"west", "east"}
    tasks = [it["task"] for block in record["blocks"] for it in block["tasks"].values()]
    assert sorted(tasks) == sorted(task.name for task in assignment.draft.tasks)


def test_a_robot_less_is_never_faster(assignment: Assignment) -> None:
    instance = assignment.instance

    for robot, cycle in assignment.without.items():
        alone = {task for task in instance.tasks if {by for by, _ in instance.options[task]} == {robot}}
        assert (cycle is None) == bool(alone)
        assert cycle is None or cycle >= (assignment.bound or 0.0)


def test_a_robot_that_is_not_available_stands_at_its_home(tmp_path: Path) -> None:
    text = OPEN.read_text().replace("  west:\n", "  west:\n    available: false\n", 1)
    text = text.replace("tilt_deg: [-90, 90, 30]", "tilt_deg: [-90, 90, 15]")
    (tmp_path / "cell.yaml").write_text(text)

    alone = assign(AssignmentDraft.load(tmp_path / "cell.yaml"), effort=1)

    assert alone.passed
    assert {task.robot for task in alone.cell.tasks} == {"east"}


def test_the_same_cell_gives_the_same_record(assignment: Assignment) -> None:
    assert assign_record(assign(AssignmentDraft.load(OPEN), effort=1)) == assign_record(assignment)


def test_without_the_solver_there_is_a_program_and_no_bound(
    assignment: Assignment, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cellplan.jobs.assign.assign.is_installed", lambda: False)

    alone = assign(AssignmentDraft.load(OPEN))

    assert alone.passed
    assert alone.bound is None
    assert assignment.cycle <= alone.cycle <= alone.greedy + 1.0
    assert "pip install 'cellplan[assign]'" in assign_record(alone)["bound_holds_for"]


def test_a_task_that_nobody_can_do_is_named_with_its_filter(tmp_path: Path) -> None:
    text = OPEN.read_text().replace("[[-300, -150, 40], [-160, -150, 40]]", "[[-300, -150, 2040], [-160, -150, 2040]]")
    text = text.replace("within_deg: 50", "within_deg: 5")
    (tmp_path / "cell.yaml").write_text(text)

    with pytest.raises(NoSolutionError) as refused:
        assign(AssignmentDraft.load(tmp_path / "cell.yaml"))

    lines = str(refused.value).splitlines()
    assert any("tasks.top_1: none of west, east can do it at any pose" in line for line in lines)
    assert any("'torch and weld position'" in line for line in lines)


def test_the_command_writes_the_folder_and_solve_refuses_the_draft(tmp_path: Path) -> None:
    status, out, err = run_command(f"cellplan assign {OPEN} -o done --effort 1 --quiet", tmp_path)

    assert status == 0, err
    assert "open_frame: passed" in out
    assert {"assign.json", "assign.html", "best.yaml", "run"} <= {path.name for path in (tmp_path / "done").iterdir()}
    status, _, err = run_command(f"cellplan solve {OPEN}", tmp_path)
    assert status == 2
    assert "cellplan assign chooses who does an open task" in err
