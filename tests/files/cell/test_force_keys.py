"""Keys of a cell about forces: what they become, what is refused where, and mirror images."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cellplan.files.cell.load import load_cell
from cellplan.files.cell.write import render_cell
from cellplan.model.cell.cell import Cell
from cellplan.report.record.sections.forces import unstated_forces

Load = Callable[..., Cell]
Refuse = Callable[..., list[str]]
GRASP = "{robot: holder, at: {xyz_mm: [-250, 0, 0]}}"
GRIP = "grip: {force_n: 300, friction: 0.4, radius_mm: 15, normal: y}"
AXIS = "    tool_axis: normal\n"
DURATION = ("motion: {duration_s: 4}", "motion: {step_s: 0.01}")


def process(force: str) -> tuple[str, str]:
    return AXIS, f"{AXIS}    process: {{feed_mm_s: 50, force: {force}}}\n"


def holding(keys: str, axes: str = "") -> tuple[str, str]:
    """The grasp of the first holder, and of the worker as a second one with some keys."""
    second = f"{{robot: worker, at: {{xyz_mm: [250, 0, 0]}}{axes}{keys}}}"
    return GRASP, f"{GRASP}\n    - {second}"


def test_a_process_has_its_wrench_in_its_frame(load: Load) -> None:
    cell = load(process("{frame: part, newton: [1, 2, 3], newton_metre: [4, 5, 6]}"), DURATION)

    force = cell.tasks[0].process.force
    assert force.frame == "part"
    assert list(force.wrench) == [1, 2, 3, 4, 5, 6]


def test_stiffness_errors_and_grip_become_si(load: Load) -> None:
    keys = ", stiffness_n_mm: 200, stiffness_nm_deg: 250, closure_error_mm: 0.1, closure_error_deg: 0.02"
    cell = load(
        holding(keys), ("tasks:\n  ring:\n    robot: worker", "tasks:\n  ring:\n    robot: holder"), *in_world()
    )
    first, second = cell.part.held_by

    assert first.stiffness is None
    assert second.stiffness == pytest.approx((200e3, 250 * 180 / np.pi))
    assert second.closure_error == pytest.approx((1e-4, np.radians(0.02)))
    assert unstated_forces(cell) == ["forces not stated: stiffness of the grasp of holder (internal forces not known)"]


def in_world() -> list[tuple[str, str]]:
    """A path that the holder carries the part along."""
    return [
        (
            "    path: {circle: {radius_mm: 100, plane: xy}, project: +z}\n",
            "    path: {circle: {radius_mm: 100, plane: xy}}\n",
        ),
        (AXIS, "    tool_axis: -z\n    relative_to: world\n"),
    ]


def test_the_written_cell_reads_back_to_the_same(load: Load, tmp_path: Path) -> None:
    cell = load(
        (GRASP, GRASP[:-1] + f", stiffness_n_mm: 2, stiffness_nm_deg: 3, {GRIP}}}"),
        DURATION,
        process("{newton: [0, 0, -9]}"),
    )

    (tmp_path / "again.yaml").write_text(render_cell(cell), encoding="utf-8")
    again = load_cell(tmp_path / "again.yaml")

    assert again.part.held_by[0].grip == cell.part.held_by[0].grip
    assert again.part.held_by[0].stiffness == cell.part.held_by[0].stiffness
    assert again.tasks[0].process.force == cell.tasks[0].process.force


@pytest.mark.parametrize(
    ("change", "finding"),
    [
        (process("{frame: tool}"), "tasks.ring.process.force.newton: expected a force or a moment that is not zero"),
        (process("{frame: flange, newton: [0, 0, 1]}"), "tasks.ring.process.force.frame: expected"),
        (process("{newton: [0, 0, 1e6]}"), "tasks.ring.process.force.newton[2]: expected a number of at most 100000"),
        ((GRASP, GRASP[:-1] + ", stiffness_n_mm: 0, stiffness_nm_deg: 1}"), "part.held_by[0].stiffness_n_mm: expected"),
        (
            (GRASP, GRASP[:-1] + ", stiffness_n_mm: 3}"),
            "part.held_by[0].stiffness_nm_deg: missing, expected beside stiffness_n_mm, as the grasp keeps rx ry rz",
        ),
        (
            (GRASP, GRASP[:-1] + ", stiffness_nm_deg: 3}"),
            "part.held_by[0].stiffness_n_mm: missing, expected beside stiffness_nm_deg, as the grasp keeps x y z",
        ),
        (
            (GRASP, GRASP[:-1] + ", closure_error_mm: 1}"),
            "part.held_by[0].closure_error_mm: unexpected key, the first holder carries the part frame; errors are "
            "those of further holders",
        ),
        (
            (GRASP, GRASP[:-1] + ", grip: {force_n: 300, friction: 1.4, radius_mm: 15, normal: y}}"),
            "part.held_by[0].grip.friction: expected a number of at most 1",
        ),
        ((GRASP, GRASP[:-1] + ", grip: {force_n: 300}}"), "part.held_by[0].grip.friction: missing"),
    ],
)
def test_what_is_refused_is_located(refuse: Refuse, change: tuple[str, str], finding: str) -> None:
    lines = refuse(change, DURATION)

    assert any(line.startswith("c:") and f" {finding}" in line for line in lines), lines


def test_a_ball_joint_needs_no_stiffness_of_its_rotations(load: Load) -> None:
    change = holding(", stiffness_n_mm: 200", ", axes: [x, y, z]")

    assert load(change, ("    robot: worker", "    robot: holder"), *in_world()).part.held_by[1].stiffness == (
        2e5,
        np.inf,
    )


@pytest.mark.parametrize("frame", ["tool", "part", "world"])
def test_the_force_of_a_mirrored_task_is_mirrored_with_its_frame(load: Load, frame: str) -> None:
    """As two forces that make the moment, each mirrored as a vector at a mirrored point."""
    signs = {"tool": [1, -1, 1], "part": [1, -1, 1], "world": [1, 1, 1]}[frame]
    force, point = np.array([1.0, 2.0, 3.0]), np.array([0.3, 0.1, -0.2])
    moment = np.cross(point, force)
    entry = f"{{frame: {frame}, newton: {force.tolist()}, newton_metre: {moment.tolist()}}}"
    mirror = ("  held_by:\n", "  mirror: {plane: xz}\n  held_by:\n")

    wrench = load(process(entry), DURATION, mirror).tasks[0].process.force.wrench

    assert wrench == pytest.approx(np.concatenate([signs * force, np.cross(signs * point, signs * force)]))


def test_one_line_names_all_that_is_not_stated(load: Load) -> None:
    silent = load((AXIS, f"{AXIS}    process: {{feed_mm_s: 50}}\n"), DURATION, (GRASP, GRASP[:-1] + f", {GRIP}}}"))
    stated = silent.with_values(
        {
            "tasks.ring.process.force": {"newton": [0, 0, -5]},
            "robots.worker.tool.mass_kg": 1.0,
            "part.mass_kg": 2.0,
        }
    )

    assert unstated_forces(silent) == [
        "forces not stated: process.force of ring; mass of the part for the grip of holder (friction not judged)"
    ]
    assert unstated_forces(stated) == []
