"""Bounds without a program, and what a robot more would bring."""

import json
from pathlib import Path

import pytest
from builders.commands import run_command

from cellplan.files.cell.load import load_open_cell
from cellplan.jobs.assign.assign import assign
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.jobs.assign.search import AssignmentSearch
from cellplan.model.progress import silent

OPEN = Path(__file__).resolve().parents[3] / "examples" / "open_tasks" / "open_frame.yaml"


def with_third_arm(folder: Path, *, available: bool, task: str = "any") -> Path:
    """The frame with an arm at its long side that may be out of order."""
    text = OPEN.read_text()
    east = text[text.index("  east:\n") : text.index("part:\n")]
    north = east.replace("east:", "north:").replace(
        "[1350, 0, 500], rpy_deg: [0, 0, 180]", "[0, 1350, 500], rpy_deg: [0, 0, -90]"
    )
    north = north.replace("    start_deg: auto\n", f"    start_deg: auto\n    available: {str(available).lower()}\n")
    text = text.replace("part:\n", f"{north}part:\n", 1).replace(
        "  top_1:\n    robot: any", f"  top_1:\n    robot: {task}"
    )
    file = folder / f"{'with' if available else 'without'}.yaml"
    file.write_text(text)
    return file


def test_a_robot_that_comes_back_has_its_tasks_and_may_do_the_open_ones(tmp_path: Path) -> None:
    """The same robots as where the file says that it is available."""
    absent = AssignmentDraft.load(with_third_arm(tmp_path, available=False, task="north"))
    _, robots = load_open_cell(with_third_arm(tmp_path, available=True, task="north"))

    more = absent.with_robot("north")

    assert (absent.absent, absent.operators) == (("north",), ("west", "east"))
    assert absent.robots["top_1"] == ("west", "east")
    assert (more.absent, more.operators) == ((), ("west", "east", "north"))
    assert more.robots == {**robots, "top_1": ("north",)}


@pytest.mark.slow
def test_what_a_robot_more_brings_is_the_cycle_of_the_model_with_it(tmp_path: Path) -> None:
    assignment = assign(AssignmentDraft.load(with_third_arm(tmp_path, available=False)), effort=1)
    search = AssignmentSearch(AssignmentDraft.load(with_third_arm(tmp_path, available=True)), 1)

    instance = search.instance(silent)
    blocks = search.little(instance)
    assert blocks is not None
    assert assignment.with_more == {"north": blocks.steps * instance.step}
    assert assignment.with_more["north"] < assignment.cycle
    assert set(assignment.without) == {"west", "east"}


@pytest.mark.slow
def test_a_bound_without_a_program_is_that_of_the_block_model(tmp_path: Path) -> None:
    status, out, _ = run_command(f"cellplan assign {OPEN} -o bound --only-bound --effort 1 --quiet", tmp_path)
    record = json.loads((tmp_path / "bound" / "assign.json").read_text())

    assert status == 0
    assert f"lower bound {record['bound_s']:g} s" in out
    assert sorted(it.name for it in (tmp_path / "bound").iterdir()) == ["assign.json", "study.jsonl"]
    assignment = assign(AssignmentDraft.load(OPEN), effort=1)
    assert assignment.bound is not None
    assert assignment.bound <= record["bound_s"] <= assignment.cycle  # finer modes may have shorter transfers
    assert sorted(task for block in record["blocks"] for task in block) == sorted(
        task.name for task in assignment.cell.tasks
    )


@pytest.mark.slow
def test_fewer_poses_of_the_part_are_used_where_the_command_says_so(tmp_path: Path) -> None:
    draft = AssignmentDraft.load(OPEN)
    used = {most: len(AssignmentSearch(draft, 1, most_stations=most).instance(silent).used) for most in (None, 5)}

    assert used[5] <= 5 < used[None]
