"""Closed paths that begin elsewhere: the same path on the part, from another of its points on."""

from pathlib import Path

import numpy as np
import pytest

from cellplan.geometry.transforms import inverse
from cellplan.jobs.assign.assign import assign
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.jobs.assign.written import backwards_values, goals_with_other_starts
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.search.assign.problem.goals import Stations, TaskGoal, task_goals

OPEN = Path(__file__).resolve().parents[3] / "examples" / "open_tasks" / "open_frame.yaml"
LINE = "path: {polyline: {points_mm: [[-300, -150, 40], [-160, -150, 40]]}}"
CENTRE = np.array([0.1, -0.05, 0.04])  # [m]
CIRCLE = "path: {circle: {plane: xy, center_mm: [100, -50], radius_mm: 60}, offset_mm: 40}"


def draft(folder: Path, path: str, *changes: tuple[str, str]) -> AssignmentDraft:
    text = OPEN.read_text()
    for old, new in ((LINE, path), *changes):
        assert old in text
        text = text.replace(old, new, 1)
    (folder / "cell.yaml").write_text(text)
    return AssignmentDraft.load(folder / "cell.yaml")


def starts(given: AssignmentDraft) -> list[TaskGoal]:
    goals = task_goals(given.cell, given.robots)
    others = goals_with_other_starts(given, goals)
    assert all(goal.name == "top_1" for goal in others)
    return [goals[0], *others] if others else []


def test_a_circle_begins_at_eight_points_and_stays_the_same(tmp_path: Path) -> None:
    every = starts(draft(tmp_path, CIRCLE))

    first = np.array([goal.X_PT[1, :3, 3] - CENTRE for goal in every])
    angles = np.degrees(np.arctan2(first[:, 1], first[:, 0])) % 360.0
    assert np.abs(np.exp(1j * np.radians(angles)) - np.exp(1j * np.radians(np.arange(0, 360, 45)))).max() < 1e-6
    for goal in every:
        points = goal.X_PT[1:-1, :3, 3] - CENTRE
        assert np.abs(np.linalg.norm(points, axis=1) - 0.06).max() < 1e-6
        assert np.abs(points[-1] - points[0]).max() < 1e-9
        turns = np.cross(points[:-1], points[1:])[:, 2]
        assert np.all(turns > 0.0)
        assert goal.steps == every[0].steps


def test_a_rectangle_begins_at_its_corners(tmp_path: Path) -> None:
    shape = CIRCLE.replace("circle", "rectangle").replace("radius_mm: 60", "sides_mm: [120, 80]")
    every = starts(draft(tmp_path, shape))

    corners = {tuple(np.round(goal.X_PT[1, :3, 3] - CENTRE, 9) + 0.0) for goal in every}
    assert corners == {(x, y, 0.0) for x in (-0.06, 0.06) for y in (-0.04, 0.04)}


def test_a_closed_polyline_begins_at_its_corners_and_stays_the_same(tmp_path: Path) -> None:
    shape = "path: {polyline: {closed: true, points_mm: [[-300, -150, 40], [-160, -150, 40], [-200, -60, 40]]}}"
    every = starts(draft(tmp_path, shape))

    corners = {tuple(np.round(1e3 * goal.X_PT[1, :3, 3], 6) + 0.0) for goal in every}
    assert corners == {(-300.0, -150.0, 40.0), (-160.0, -150.0, 40.0), (-200.0, -60.0, 40.0)}
    for goal in every:
        points = goal.X_PT[1:-1, :3, 3]
        assert np.abs(points[-1] - points[0]).max() < 1e-9
        assert np.all(np.cross(np.diff(points, axis=0)[:-1], np.diff(points, axis=0)[1:])[:, 2] > -1e-12)
        assert goal.steps == every[0].steps
    rounded = shape + "\n    corners: {blend_mm: 5}"
    assert starts(draft(tmp_path, rounded)) == []


def test_a_start_that_is_given_or_not_free_stays(tmp_path: Path) -> None:
    given = CIRCLE.replace("radius_mm: 60", "radius_mm: 60, start_at: +y")

    assert starts(draft(tmp_path, given)) == []
    assert starts(draft(tmp_path, CIRCLE, ("assign:\n", "assign:\n  free: [spin]\n"))) == []
    assert starts(draft(tmp_path, CIRCLE, ("program: {}", "program: {arcs_apart_mm: 200}"))) == []


@pytest.mark.slow
def test_a_program_with_a_ring_passes_and_has_its_start(tmp_path: Path) -> None:
    given = draft(tmp_path, CIRCLE)

    assignment = assign(given, effort=1)

    assert assignment.passed
    modes = {end.mode.task: end.mode for _, ends in assignment.sequenced.stops for end in ends if end is not None}
    chosen = dict(modes["top_1"].path_values)
    at = np.array(chosen.get("tasks.top_1.path.circle.start_at", (1.0, 0.0)), dtype=float)
    work = next(run for run in assignment.solution.runs if "top_1" in [it.task.name for it in run.schedule.tasks])
    begin = next(it for it in work.schedule.tasks if it.task.name == "top_1").begin
    row = int(np.argmin(np.abs(work.schedule.times - begin)))
    cell = assignment.cell
    tool = ScrewChain(cell.robot(modes["top_1"].robot)).tool_poses(
        work.motion.q[row : row + 1, cell.columns(modes["top_1"].robot)]
    )
    part = Stations.of(cell, work.motion.q[row : row + 1, cell.columns("table")]).X_WP
    assert np.abs((inverse(part) @ tool)[0, :2, 3] - CENTRE[:2] - 0.06 * at).max() < 1e-3


@pytest.mark.parametrize(
    ("keys", "is_mirrored"),
    [
        ("walls: {web: -y, floor: +z}, from: floor, work_deg: 45", False),
        ("walls: {web: -y, floor: +z}, from: floor, work_deg: 45, drag_deg: 10, from_mm: 20, to_mm: 90", True),
        ("walls: {floor: +z}, work_deg: 20, push_deg: 10, side_mm: 3", True),
    ],
)
def test_a_seam_that_is_done_backwards_has_its_axes_and_its_travel_angle(
    tmp_path: Path, keys: str, is_mirrored: bool
) -> None:
    line = LINE.replace("}}", f"}}, {keys}}}")
    cell = draft(tmp_path, line, ("    tool_axis: [0, 0, -1]\n", "")).cell
    values = backwards_values(cell, "top_1")
    assert values is not None
    there, back = (task_goals(it, {})[0].X_PT[1:-1] for it in (cell, cell.with_values(values)))

    assert np.abs(back[::-1, :3, 3] - there[:, :3, 3]).max() < 1e-9
    along = there[-1, :3, 3] - there[0, :3, 3]
    along /= np.linalg.norm(along)
    mirrored = there[:, :3, 2] - 2.0 * (there[:, :3, 2] @ along)[:, None] * along
    assert np.abs(back[::-1, :3, 2] - mirrored).max() < 1e-9
    assert bool(np.abs(mirrored - there[:, :3, 2]).max() > 1e-3) is is_mirrored


@pytest.mark.slow
def test_passes_of_an_open_seam_are_done_by_one_robot_in_their_order(tmp_path: Path) -> None:
    passes = "    passes: [{work_deg: 0}, {side_mm: 3, out_mm: 2}, {side_mm: -3, out_mm: 2, reverse: true}]\n"
    seam = LINE.replace("}}", "}, walls: {plate: +z}}")
    rule = ("program: {}", "program: {same_robot: [top_1, top_2]}")
    given = draft(tmp_path, seam, ("    tool_axis: [0, 0, -1]\n", passes), rule)

    assignment = assign(given, effort=1)

    assert assignment.passed
    tasks = [assignment.cell.task(f"top_1_{k}") for k in (1, 2, 3)]
    assert len({task.robot for task in tasks}) == 1
    assert [task.after[0] for task in tasks[1:]] == ["top_1_1", "top_1_2"]
