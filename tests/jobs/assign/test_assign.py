"""Whole assignments: solved, within their bound, kept as they were written, and refused where nobody can do a task."""

from pathlib import Path

import numpy as np
import pytest
from builders.commands import run_command

from cellplan.errors import InputError, NoSolutionError
from cellplan.files.cell.load import load_cell, load_open_cell
from cellplan.jobs.assign.assign import Assignment, assign
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.jobs.assign.result import assign_lines, assign_record
from cellplan.jobs.assign.write import write_assignment
from cellplan.runs.solve import solve
from cellplan.runs.write_run import write_run
from cellplan.search.assign.schedules.schedule import refuse_impossible

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


def test_the_run_is_the_one_that_solving_the_written_cell_gives(assignment: Assignment, tmp_path: Path) -> None:
    record = write_assignment(assignment, OPEN, tmp_path / "out")

    best = tmp_path / "out" / "best.yaml"
    text, cell = best.read_text(), load_cell(best)
    write_run(solve(cell), tmp_path / "again")
    files = sorted(path.relative_to(tmp_path / "again") for path in (tmp_path / "again").rglob("*") if path.is_file())
    assert [
        it for it in files if (tmp_path / "again" / it).read_bytes() != (best.parent / "run" / it).read_bytes()
    ] == []
    assert len(files) > 10
    assert "# Eight seams on a plate" in text
    assert text.count("# was robot: any") == len(cell.tasks)
    tasks = [it["task"] for block in record["blocks"] for it in block["tasks"].values()]
    assert sorted(tasks) == sorted(task.name for task in assignment.draft.tasks)
    write_assignment(assignment, OPEN, tmp_path / "out")  # replaces the earlier one
    (best.parent / "mine.txt").touch()
    with pytest.raises(InputError, match=r"holds 'mine\.txt', which cellplan did not write"):
        write_assignment(assignment, OPEN, tmp_path / "out")


def test_every_robot_works_or_waits_for_another_in_every_block(assignment: Assignment) -> None:
    record = assign_record(assignment)

    for robot, use in record["robots"].items():
        waits = use["waits_s"]
        assert use["work_s"] + sum(waits.values()) == pytest.approx(record["binding"]["blocks_s"])
        assert robot not in waits
    lengths = [
        sum(block["end_s"] - block["begin_s"] for block in record["blocks"] if block["tasks"].keys() == {name})
        for name in record["robots"]
    ]
    assert record["binding"]["waiting_s"] >= sum(lengths) > 0.0


def test_alternatives_are_other_schedules_that_take_little_longer(assignment: Assignment) -> None:
    best = assignment.sequenced
    schedules = [best.schedule, *(it.schedule for it in assignment.alternatives)]

    for other in assignment.alternatives:
        refuse_impossible(assignment.instance, other.schedule)
        assert (assignment.bound or 0.0) <= other.steps * assignment.instance.step <= 1.05 * assignment.model_cycle
    chosen = {(frozenset(map(frozenset, it.blocks)), frozenset(it.chosen.items())) for it in schedules}
    assert len(chosen) == len(schedules) > 1
    lines = [it for it in assign_lines(assign_record(assignment)) if "nearly as good" in it]
    assert len(set(lines)) == len(lines) > 1


def test_what_a_task_states_is_kept(assignment: Assignment, tmp_path: Path) -> None:
    """One seam at its given pose of the part and spin, one of a given robot in its given start."""
    top, edge = (assignment.cell.task(name) for name in ("top_2", "edge_1"))
    assert top.holder_posture is not None
    assert edge.start_posture is not None
    holder, start = (np.degrees(q).round(3).tolist() for q in (top.holder_posture, edge.start_posture))
    text, turn = OPEN.read_text(), f"{np.degrees(edge.spin):.3f}"
    text = text.replace("  top_2:\n", f"  top_2:\n    holder_deg: {holder}\n    spin_deg: {np.degrees(top.spin):.3f}\n")
    text = text.replace(
        "  edge_1:\n    robot: any\n",
        f"  edge_1:\n    robot: {edge.robot}\n    start_deg: {start}\n    spin_deg: {turn}\n",
    )
    (tmp_path / "cell.yaml").write_text(text)

    result = assign(AssignmentDraft.load(tmp_path / "cell.yaml"), effort=1)

    written, drafted = result.cell.origin.source, load_open_cell(tmp_path / "cell.yaml")[0].origin.source
    assert written is not None
    assert drafted is not None
    for name, keys in (("top_2", ("holder_deg", "spin_deg")), ("edge_1", ("robot", "start_deg", "spin_deg"))):
        assert [written.written["tasks"][name][key] for key in keys] == [
            drafted.written["tasks"][name][key] for key in keys
        ]
    assert result.passed


def test_via_points_are_passed_as_the_model_has_them_and_services_are_chosen_again(tmp_path: Path) -> None:
    """The written cell, assigned once more without its orders, is the same."""
    service = "    service: {at: [-60, -60, 60, 0, 60, 0], takes_s: 8, every: {seams: 3}}\n"
    text = OPEN.read_text().replace("    home_deg", f"{service}    home_deg")
    for name, via in (
        ("top_1", "robot: any\n    via: {before: [home], after: [home]}"),
        (
            "edge_2",
            "robot: west\n    via: {before: [home, [-40, -50, 60, 0, 60, 0]], after: [[10, -50, 60, 0, 60, 0]]}",
        ),
    ):
        text = text.replace(f"  {name}:\n    robot: any", f"  {name}:\n    {via}")
    (tmp_path / "cell.yaml").write_text(text)

    result = assign(AssignmentDraft.load(tmp_path / "cell.yaml"), effort=1)

    write_assignment(result, tmp_path / "cell.yaml", tmp_path / "out")
    written = (tmp_path / "out" / "best.yaml").read_text()
    (tmp_path / "again.yaml").write_text("".join(it for it in written.splitlines(True) if "    order:" not in it))
    again = assign(AssignmentDraft.load(tmp_path / "again.yaml"), effort=1)
    via = {task.name: (len(task.via_before), len(task.via_after)) for task in result.cell.tasks}
    assert result.passed
    assert result.bound is not None
    assert result.bound <= result.model_cycle <= result.cycle <= 1.005 * result.model_cycle
    assert result.sequenced.schedule.cleaned(result.instance).count(frozenset()) < len(result.sequenced.schedule.blocks)
    assert via["top_1"] in {(1, 1), (2, 1)}
    assert via["edge_2"] in {(2, 1), (3, 1)}
    assert again.cycle == result.cycle
    assert {task.name: (len(task.via_before), len(task.via_after)) for task in again.cell.tasks} == via


def test_a_robot_less_is_never_faster(assignment: Assignment) -> None:
    instance = assignment.instance

    for robot, cycle in assignment.without.items():
        alone = {task for task in instance.tasks if {by for by, _ in instance.options[task]} == {robot}}
        assert (cycle is None) == bool(alone)
        assert cycle is None or cycle >= assignment.model_cycle - 1e-9


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
    monkeypatch.setattr("cellplan.jobs.assign.search.is_installed", lambda: False)

    alone = assign(AssignmentDraft.load(OPEN))

    assert alone.passed
    assert alone.bound is None
    assert assignment.cycle <= alone.cycle <= alone.greedy + 1.0
    assert "pip install 'cellplan[assign]'" in assign_record(alone)["bound_holds_for"]


def test_rests_in_a_retimed_program_have_no_bound(tmp_path: Path) -> None:
    text = OPEN.read_text().replace("program: {}", "program: {rest_s: 5, apart_mm: 100}")
    (tmp_path / "cell.yaml").write_text(text.replace("motion: {", "motion: {timing: fastest, "))

    result = assign(AssignmentDraft.load(tmp_path / "cell.yaml"), effort=1)

    assert result.passed
    assert result.bound is None
    assert "the part cools between tasks" in assign_record(result)["bound_holds_for"]


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
