"""Drafts: what an assignment refuses, and the poses of the part and turns of the tools that it compares."""

from pathlib import Path

import numpy as np
import pytest

from cellplan.errors import HomeNotFoundError, InputError
from cellplan.jobs.assign.draft import AssignmentDraft

OPEN = Path(__file__).resolve().parents[3] / "examples" / "open_tasks" / "open_frame.yaml"
HOME = "    home_deg: [0, -40, 60, 0, 60, 0]\n"
STATIONS = "{tilt_deg: [-90, 90, 30], turn_deg: [-180, 150, 30]}"


def draft(folder: Path, *changes: tuple[str, str]) -> AssignmentDraft:
    text = OPEN.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    (folder / "cell.yaml").write_text(text)
    return AssignmentDraft.load(folder / "cell.yaml")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("program: {}\n", "", "add program: {} for a program from home to home"),
        ("semi_coordinated", "simultaneous", "motion.mode: expected semi_coordinated or part_at_rest"),
        ("program: {}", "program: {detach: {at: {}}}", "program: expected no marks, attach or detach"),
        ("robot: any", "robot: any\n    holder_moves: true", "tasks.top_1.holder_moves: unexpected key, as an assign"),
        (
            "semi_coordinated, step_s: 0.02}\nprogram: {}\nassign:",
            "part_at_rest, step_s: 0.02}\nprogram: {}\nassign:\n  groups: true",
            "assign.groups: expected motion.mode: semi_coordinated, got part_at_rest",
        ),
        (
            "step_s: 0.02}\nprogram: {}\nassign:",
            "step_s: 0.02, timing: fastest}\nprogram: {}\nassign:\n  groups: true",
            "assign.groups: expected motion.timing: as_written, got fastest",
        ),
        (HOME, "", "robots.west: missing, expected home_deg"),
        (
            "robot: any",
            "robot: any\n    via: {before: [home, [0, -40, 60, 0, 60, 0]]}",
            "tasks.top_1.via: expected home at an open task",
        ),
        (
            "robot: any",
            "robot: west\n    via: {before: [home], after: [home, [-40, -60, 80, 0, 60, 0]]}",
            "cell.yaml:33: tasks.top_1.via.after[1]: 'west' comes too close there: 'west/bracket' touches",
        ),
        (
            HOME,
            HOME + "    service: {at: [-40, -60, 80, 0, 60, 0], takes_s: 8, every: {seams: 2}}\n",
            "robots.west.service.at: 'west' comes too close there",
        ),
        (HOME, HOME + "    order: [top_1, top_2, top_3, edge_1, edge_2, edge_3, side_1, side_2]\n", "west.order: unex"),
    ],
)
def test_cells_of_which_no_assignment_is_made(tmp_path: Path, old: str, new: str, words: str) -> None:
    with pytest.raises(InputError) as refused:
        draft(tmp_path, (old, new))

    assert words in str(refused.value)


def test_stations_of_a_part_that_no_robot_holds_are_refused(tmp_path: Path) -> None:
    changes = [
        ("  held_by:\n    - {robot: table, at: {xyz_mm: [0, 0, -60]}}", "  at: {xyz_mm: [0, 0, 510]}"),
        ("start_deg: [0, 0]", "start_deg: [0, 0]\n    home_deg: [0, 0]"),
        ("semi_coordinated", "simultaneous"),
    ]
    with pytest.raises(
        InputError, match=r"cell\.yaml:\d+: assign\.stations: unexpected key, no robot holds the part: rem"
    ):
        draft(tmp_path, *changes)


def test_values_of_the_command_line_come_before_tasks_are_read_as_open(tmp_path: Path) -> None:
    settings = ("tasks.top_1.robot=east", "tasks.top_2.robot=any", "robots.west.available=false")

    changed = AssignmentDraft.load(OPEN, settings=settings)

    assert changed.absent == ("west",)
    assert set(changed.robots.values()) == {("east",)}
    assert set(changed.robots) == {task.name for task in changed.cell.tasks} - {"top_1"}
    assert changed.with_robot("west").robots["top_2"] == ("west", "east")
    with pytest.raises(InputError, match=r"--set: expected KEY=VALUE"):
        AssignmentDraft.load(OPEN, settings=("x",))


def test_homes_at_which_robots_touch_are_refused_before_anything_is_searched(tmp_path: Path) -> None:
    with pytest.raises(HomeNotFoundError, match=r"robots\.west\.home_deg: the homes come too close: .* touches"):
        draft(tmp_path, (HOME, HOME.replace("0, -40, 60, 0, 60, 0", "0, -60, 90, 0, 60, 0")))


def test_the_grid_has_all_configurations_from_first_to_last(tmp_path: Path) -> None:
    stations = draft(tmp_path).stations()

    assert stations.holder == "table"
    assert np.unique(np.degrees(stations.q[:, 0]).round(9)).tolist() == [-90, -60, -30, 0, 30, 60, 90]
    assert len(stations.q) == 7 * 12
    assert np.abs(stations.X_WP[:, :3, :3] @ np.swapaxes(stations.X_WP[:, :3, :3], 1, 2) - np.eye(3)).max() < 1e-12


def test_a_joint_without_a_range_stays_at_its_start_and_lists_are_taken_as_they_are(tmp_path: Path) -> None:
    one_joint = draft(tmp_path, (STATIONS, "{tilt_deg: [0, 90, 45]}")).stations()
    listed = draft(tmp_path, (STATIONS, "[[0, 10], [45, -20]]")).stations()

    assert np.degrees(one_joint.q).round(9).tolist() == [[0, 0], [45, 0], [90, 0]]
    assert np.degrees(listed.q).round(9).tolist() == [[0, 10], [45, -20]]


def test_what_is_not_free_is_not_compared(tmp_path: Path) -> None:
    few = draft(tmp_path, ("assign:\n", "assign:\n  free: [direction]\n"))

    assert len(few.stations().q) == 1
    assert few.spins().tolist() == [0.0]
    assert len(draft(tmp_path).spins()) == 6


@pytest.mark.parametrize(
    ("stations", "words"),
    [
        ("{tilt: [0, 90, 45]}", "assign.stations.tilt: expected a joint of 'table': tilt_deg, turn_deg"),
        ("{tilt_deg: [90, 0, 45]}", "assign.stations.tilt_deg: expected [first, last, step] with a step above 0"),
        ("[[0, 10, 20]]", "assign.stations[0]: expected 2 values, one for each joint of 'table', got 3"),
        ("{tilt_deg: [-90, 90, 1], turn_deg: [-180, 150, 1]}", "expected at most 1000 configurations, got 59911"),
    ],
)
def test_stations_that_the_holder_cannot_take(tmp_path: Path, stations: str, words: str) -> None:
    with pytest.raises(InputError) as refused:
        draft(tmp_path, (STATIONS, stations))

    assert words in str(refused.value)
