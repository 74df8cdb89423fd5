"""Stations in use: they cover what can be done, share the work out, and keep modes that are free of collisions."""

from pathlib import Path

import numpy as np
import pytest

from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.scene.scene import Scene
from cellplan.search.assign.problem.clearance import AssignmentClearance
from cellplan.search.assign.problem.goals import TaskGoal, task_goals
from cellplan.search.assign.problem.stations import choose_stations
from cellplan.search.assign.problem.table import ModeSearch, ModeTable

OPEN = Path(__file__).resolve().parents[4] / "examples" / "open_tasks" / "open_frame.yaml"


@pytest.fixture(scope="module")
def searched(tmp_path_factory: pytest.TempPathFactory) -> tuple[ModeTable, list[TaskGoal], AssignmentClearance]:
    file = tmp_path_factory.mktemp("draft") / "cell.yaml"
    text = OPEN.read_text()
    stations = "{tilt_deg: [-90, 90, 30], turn_deg: [-180, 150, 30]}"
    assert stations in text
    file.write_text(text.replace(stations, "{tilt_deg: [-60, 60, 60], turn_deg: [-180, 90, 90]}"))
    draft = AssignmentDraft.load(file)
    goals, stations_of = task_goals(draft.cell, draft.robots), draft.stations()
    scene = Scene.from_cell(draft.cell)
    clearance = AssignmentClearance(scene=scene, home=draft.home, stations=stations_of, conflict=0.05)
    table = ModeSearch(cell=draft.cell, goals=goals, stations=stations_of, spins=draft.spins()).table()
    return table, goals, clearance


def test_every_task_that_can_be_done_anywhere_is_covered(
    searched: tuple[ModeTable, list[TaskGoal], AssignmentClearance],
) -> None:
    table, goals, clearance = searched

    used, modes = choose_stations(table, goals, clearance, most=8)

    able = {
        task
        for (task, _, station), choices in table.modes.items()
        if clearance.is_open(station) and any(map(clearance.is_free, choices))
    }
    assert {task for task, _, _ in modes} == able
    assert {station for _, _, station in modes} == set(used)
    assert all(clearance.is_free(mode) for choices in modes.values() for mode in choices)


def test_the_first_station_lets_most_work_be_shared(
    searched: tuple[ModeTable, list[TaskGoal], AssignmentClearance],
) -> None:
    """The busiest robot at it has least to do of all stations at which as many tasks can be done."""
    table, goals, clearance = searched

    (first,), modes = choose_stations(table, goals, clearance, most=1)

    robots = {(task, robot) for task, robot, _ in modes}
    assert {robot for _, robot in robots} == {"west", "east"}
    done = {
        station: {key[0] for key in table.modes if key[2] == station} for station in {key[2] for key in table.modes}
    }
    assert len(done[first]) == max(len(tasks) for station, tasks in done.items() if clearance.is_open(station))


def test_whether_the_tool_fits_is_the_same_for_all_branches_and_poses_of_the_part(
    searched: tuple[ModeTable, list[TaskGoal], AssignmentClearance],
) -> None:
    table, _, clearance = searched
    by_spin: dict[tuple[str, str, float], list[bool]] = {}
    for choices in table.modes.values():
        for mode in choices[:1]:
            clearance._fitting.clear()
            by_spin.setdefault((mode.task, mode.robot, mode.spin), []).append(clearance.tool_fits(mode))

    assert all(len(set(verdicts)) == 1 for verdicts in by_spin.values())
    assert np.any([len(verdicts) > 1 for verdicts in by_spin.values()])
