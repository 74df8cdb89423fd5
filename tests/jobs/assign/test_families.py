"""Generated cells whose part is brought by a table, an arm or a rail, or is fixed: from open tasks to a program."""

import importlib.util
import json
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import yaml
from builders.commands import run_command

from cellplan.errors import ImpossibleTasksError, InputError
from cellplan.files.cell.load import load_cell
from cellplan.geometry.transforms import pose
from cellplan.jobs.assign.assign import assign
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.jobs.assign.written import mirrored_goals
from cellplan.runs.solve import solve
from cellplan.search.assign.problem.goals import task_goals
from cellplan.search.assign.problem.table import BranchFollower
from cellplan.search.assign.schedules.schedule import refuse_impossible

SCRIPT = Path(__file__).resolve().parents[3] / "benchmarks" / "assign.py"
ROUNDING = 1e-6  # [m, rad] errors that configurations are searched down to


@pytest.fixture(scope="module")
def cells() -> ModuleType:
    spec = importlib.util.spec_from_file_location("assigned_cells", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def draft(folder: Path, values: dict[str, Any]) -> AssignmentDraft:
    (folder / "cell.yaml").write_text(yaml.safe_dump(values, sort_keys=False))
    return AssignmentDraft.load(folder / "cell.yaml")


def test_an_arm_brings_the_part_to_the_poses_of_the_grid(tmp_path: Path, cells: ModuleType) -> None:
    values = cells.generated_cell(8, 2, 0, "arm")
    values["assign"]["stations"] |= {"roll_deg": [-30, 30, 30], "pitch_deg": [0, 0, 1], "yaw_deg": [0, 0, 1]}

    stations = draft(tmp_path, values).stations()

    grid = [pose([0.0, 0.0, 1.2], np.radians([roll, 0, 0])) for roll in (-30, 0, 30)]
    nearest = [np.abs(X_WP - np.array(grid)).max(axis=(1, 2)) for X_WP in stations.X_WP]
    assert len(stations.q) == len(grid)
    assert np.max(np.min(nearest, axis=1)) < ROUNDING
    assert sorted(np.argmin(nearest, axis=1).tolist()) == list(range(len(grid)))


def test_a_place_without_a_key_is_the_one_at_the_start_of_the_holder(tmp_path: Path, cells: ModuleType) -> None:
    values = cells.generated_cell(8, 2, 0, "arm")
    values["assign"]["stations"] = {"x_mm": [0, 0, 1], "pitch_deg": [60, 90, 30]}

    stations = draft(tmp_path, values).stations()

    values["assign"]["stations"] = [list(values["robots"]["arm"]["start_deg"])]
    at_start = draft(tmp_path, values).stations()
    assert len(stations.q) == 2
    assert np.abs(stations.X_WP[:, 1:3, 3] - at_start.X_WP[:, 1:3, 3]).max() < ROUNDING
    assert np.abs(stations.X_WP[:, 0, 3]).max() < ROUNDING


def test_without_coordinates_the_part_comes_where_the_others_reach_it(tmp_path: Path, cells: ModuleType) -> None:
    """From a start that is turned away from them; the orientations are those of the grid."""
    values = cells.generated_cell(8, 2, 0, "arm")
    values["assign"]["stations"] = {"roll_deg": [-30, 30, 30]}
    values["robots"]["arm"] |= {key: [150, -90, 90, 0, 0, 0] for key in ("start_deg", "home_deg")}
    given = draft(tmp_path, values)

    stations = given.stations()

    goals = task_goals(given.cell, given.robots)
    grid = np.array([pose(np.zeros(3), np.radians([roll, 0, 0])) for roll in (-30, 0, 30)])
    assert np.abs(np.sort(stations.X_WP[:, 2, 1]) - np.sort(grid[:, 2, 1])).max() < ROUNDING
    follower = [BranchFollower.of(given.cell.robot(name)) for name in given.operators]
    for X_WP in stations.X_WP:
        tools = np.array([X_WP @ goal.X_PT[len(goal.X_PT) // 2] for goal in goals])
        assert all(it.follow(tools[:, None]).reaches.mean() > 0.5 for it in follower)


@pytest.mark.parametrize(
    ("stations", "words"),
    [
        ({"x_mm": [9000, 9000, 1]}, "assign.stations: expected a pose of the part to which 'arm' can bring it"),
        (
            {"yaw_deg": [0, 90, 45], "A1_deg": [0, 1, 1]},
            "stations.A1_deg: expected a coordinate or an angle of the part",
        ),
        ({"yaw_deg": [90, 0, 45]}, "stations.yaw_deg: expected [first, last, step] with a step above 0"),
        ({"yaw_deg": [-180, 180, 1], "roll_deg": [0, 90, 1]}, "expected at most 1000 configurations, got 32851"),
    ],
)
def test_poses_that_an_arm_cannot_take(
    tmp_path: Path, cells: ModuleType, stations: dict[str, list[float]], words: str
) -> None:
    values = cells.generated_cell(8, 2, 0, "arm")
    values["assign"]["stations"] = stations

    with pytest.raises(InputError) as refused:
        draft(tmp_path, values)

    assert words in str(refused.value)


def test_sixty_cells_are_generated_by_kind_and_seed(cells: ModuleType) -> None:
    texts = {json.dumps(_cell(cells, it), sort_keys=True) for it in cells.ALL}

    assert len(texts) == 60
    assert json.dumps(_cell(cells, cells.ALL[-1]), sort_keys=True) in texts


@pytest.mark.slow
@pytest.mark.parametrize(
    "text", ["8:2:0:table", "8:2:0:arm", "8:2:0:rail", "8:2:0:fixed", "12:3:1:table", "12:2:1:rail"]
)
def test_a_generated_cell_becomes_a_program_that_passes(tmp_path: Path, cells: ModuleType, text: str) -> None:
    result = assign(draft(tmp_path, _cell(cells, text)), effort=1)

    refuse_impossible(result.instance, result.sequenced.schedule)
    assert result.passed
    assert (result.bound or 0.0) <= result.cycle <= 1.03 * result.model_cycle


def pushing(cells: ModuleType) -> dict[str, Any]:
    """A cell in which the tool pushes along every seam."""
    values = cells.generated_cell(8, 2, 0, "table")
    for task in values["tasks"].values():
        first, last = np.array(task["path"]["polyline"]["points_mm"])
        task["tool_axis"] = (task["tool_axis"] - 0.15 * (last - first) / np.linalg.norm(last - first)).tolist()
    return dict(values)


def test_on_the_way_back_the_tool_is_mirrored_across_the_path(tmp_path: Path, cells: ModuleType) -> None:
    """The points are the same, and so is the axis but for its part along the path, which has the other sign."""
    given = draft(tmp_path, pushing(cells))
    goals = {goal.name: goal for goal in task_goals(given.cell, given.robots)}

    mirrored = mirrored_goals(given, list(goals.values()))

    assert {goal.name for goal in mirrored} == set(goals)
    for back in mirrored:
        there, here = goals[back.name].X_PT[1:-1], back.X_PT[1:-1]
        travel = there[-1, :3, 3] - there[0, :3, 3]
        travel /= np.linalg.norm(travel)
        assert np.abs(there[:, :3, 3] - here[:, :3, 3]).max() < ROUNDING
        assert np.max(there[:, :3, 2] @ travel) < -0.05
        across = np.eye(3) - 2.0 * np.outer(travel, travel)
        assert np.abs(here[:, :3, 2] - there[:, :3, 2] @ across).max() < ROUNDING
    assert mirrored_goals(draft(tmp_path, cells.generated_cell(8, 2, 0, "table")), list(goals.values())) == []


@pytest.mark.slow
def test_a_tool_that_pushes_does_so_in_both_directions(tmp_path: Path, cells: ModuleType) -> None:
    result = assign(draft(tmp_path, pushing(cells)), effort=1)

    goals = task_goals(result.cell, {})
    assert result.passed
    assert any(end is not None and end.is_reversed for _, ends in result.sequenced.stops for end in ends)
    for goal in goals:
        travel = goal.X_PT[-2, :3, 3] - goal.X_PT[1, :3, 3]
        assert goal.X_PT[1, :3, 2] @ travel < -0.05 * np.linalg.norm(travel)


@pytest.mark.slow
def test_what_only_a_missing_robot_can_do_is_left_out_and_said(tmp_path: Path, cells: ModuleType) -> None:
    """With a robot out of order; the same cell is refused where all robots are there."""
    values = cells.generated_cell(8, 2, 0, "table")
    values["tasks"]["s01"]["path"]["polyline"]["points_mm"] = [[0, 0, 9000], [100, 0, 9000]]
    values["tasks"]["s02"]["after"] = ["s01"]
    with pytest.raises(ImpossibleTasksError, match=r"tasks\.s01: none of west, east can do it"):
        assign(draft(tmp_path, values), effort=1)
    values["robots"]["east"]["available"] = False
    draft(tmp_path, values)

    status, out, _ = run_command("cellplan assign cell.yaml -o out --effort 1 --quiet", tmp_path)

    assert status == 1
    assert "partial" in out
    assert "LEFT OUT" in out
    assert "tasks.s01: none of west can do it" in out
    best = load_cell(tmp_path / "out" / "best.yaml")
    assert {task.robot for task in best.tasks} == {"west"}
    assert {task.name for task in best.tasks}.isdisjoint({"s01", "s02"})
    assert solve(best).passed


def _cell(cells: ModuleType, text: str) -> dict[str, Any]:
    seams, arms, seed, kind = text.split(":")
    values: dict[str, Any] = cells.generated_cell(int(seams), int(arms), int(seed), kind)
    return values
