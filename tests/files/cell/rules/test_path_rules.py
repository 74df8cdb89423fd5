"""A given joint path: built as it is written, refused by line where it cannot be."""

from collections.abc import Callable

import numpy as np
import pytest

from cellplan.files.cell.write import render_cell
from cellplan.model.cell.cell import Cell

Load = Callable[..., Cell]
Refuse = Callable[..., list[str]]

START = "    start_deg: [0, -93, 108, 0, -15, 0]\n"
ROWS = "[[0, -93, 108, 0, -15, 0], [5, -90, 100, 0, -10, 0], [9, -90, 100, 0, -10, 20]]"
WEIGHTS = "    weights: [1, 1, 1, 1, 1, 1]\n"
MOTION = "motion: {duration_s: 4}"


def path(rows: str = ROWS, *, start: str = "", more: str = "") -> tuple[str, str]:
    """The change that gives the holder a path, in line 6."""
    return START, f"    path: {{coefficients_deg: {rows}{more}}}\n{start}"


def test_the_first_coefficient_is_the_start_posture(load: Load) -> None:
    holder = load(path(more=", degree: 3")).robots[0]

    assert holder.path is not None
    assert holder.path.degree == 3
    np.testing.assert_allclose(np.degrees(holder.path.coefficients[2]), [9, -90, 100, 0, -10, 20], rtol=1e-15)
    np.testing.assert_array_equal(holder.start, holder.path.coefficients[0])


def test_a_start_posture_that_agrees_may_stand_beside_it_as_in_the_resolved_cell(load: Load) -> None:
    cell = load(path(start=START))

    written = render_cell(cell)

    assert "coefficients_deg:" in written
    np.testing.assert_array_equal(load(path(start=START)).robots[0].start, cell.robots[0].start)


def test_sliding_joints_are_given_in_millimetres(load: Load) -> None:
    rail = "    mount: {rail: {axis: +x, lower_mm: -500, upper_mm: 500, velocity_mm_s: 1000}}\n"
    angles = "A2_deg: 0, B2_deg: -93, C2_deg: 108, D2_deg: 0, E2_deg: -15, F2_deg: 0"
    rows = f"[{{rail_mm: -100, {angles}}}, {{rail_mm: 250, {angles}}}]"

    spline = load((START, f"{rail}    path: {{coefficients: {rows}}}\n")).robots[0].path

    assert spline is not None
    np.testing.assert_allclose(spline.coefficients[:, 0], [-0.1, 0.25], rtol=1e-15)


LINES: dict[str, tuple[tuple[tuple[str, str], ...], str]] = {
    "a row too short": (
        (path("[[0, -93, 108, 0, -15, 0], [5, -90]]"),),
        "c:6: robots.holder.path.coefficients_deg[1]: expected 6 angles, one per joint (A2, B2, C2, D2, E2, F2), got 2",
    ),
    "one row": (
        (path("[[0, -93, 108, 0, -15, 0]]"),),
        "c:6: robots.holder.path.coefficients_deg: expected at least 2 entries, got 1",
    ),
    "both spellings": (
        (path(more=", coefficients: [{A2_deg: 0}, {A2_deg: 0}]"),),
        "c:6: robots.holder.path: expected either coefficients_deg or coefficients, got both",
    ),
    "another degree": ((path(more=", degree: 4"),), "c:6: robots.holder.path.degree: expected 3 or 5, got 4"),
    "a start that contradicts": (
        (path(start="    start_deg: [0, -93, 108, 0, -15, 1]\n"),),
        "c:7: robots.holder.start_deg: expected the first coefficient of robots.holder.path, 'F2' differs: remove the "
        "start posture",
    ),
    "an operator": (
        ((WEIGHTS, f"    path: {{coefficients_deg: {ROWS}}}\n"),),
        "c:11: robots.worker.path: expected the path of the first holder of the part, 'holder', got one of 'worker': "
        "remove it",
    ),
    "a part at rest": (
        (path(), (MOTION, "motion: {duration_s: 4, mode: part_at_rest}")),
        "c:21: motion.mode: expected simultaneous beside robots.holder.path, got 'part_at_rest': choose it, or remove "
        "the path",
    ),
    "a cyclic motion": (
        (path(), (MOTION, "motion: {duration_s: 4, cyclic: true}")),
        "c:21: motion.cyclic: expected false beside robots.holder.path, got true: remove it, or remove the path",
    ),
    "a joint of its own that fails": (
        (path(), (MOTION, "motion: {duration_s: 4, locked_joints: [{robot: holder, joint: A2}]}")),
        "c:21: motion.locked_joints[0]: expected a joint of another robot beside robots.holder.path, got 'holder/A2': "
        "remove it, or remove the path",
    ),
    "a program": (
        (path(), ("environment:", "program: {}\nenvironment:")),
        "c:22: program: unexpected key beside robots.holder.path, which covers one clock: remove it, or remove the "
        "path",
    ),
    "motion in the null space of a robot that has it": (
        (path(start=f"    null_space: {{coefficients_deg: {ROWS}}}\n"),),
        "c:7: robots.holder.null_space: unexpected key beside robots.holder.path: remove it, or remove the path",
    ),
    "motion in the null space with a program": (
        (
            (WEIGHTS, f"    null_space: {{coefficients_deg: {ROWS}}}\n"),
            ("environment:", "program: {}\nenvironment:"),
        ),
        "c:22: program: unexpected key beside robots.worker.null_space, which covers one clock: remove it, or remove "
        "the null_space",
    ),
    "Euler's steps": (
        (path(), ("environment:", "solver: {integrator: euler}\nenvironment:")),
        "c:22: solver.integrator: expected the accurate mode (weighted_pseudo_inverse without goals) beside "
        "robots.holder.path: change it",
    ),
    "another method": (
        (path(), ("environment:", "solver: {method: damped_least_squares}\nenvironment:")),
        "c:22: solver.method: expected the accurate mode (weighted_pseudo_inverse without goals) beside "
        "robots.holder.path: change it",
    ),
}


@pytest.mark.parametrize("case", LINES)
def test_what_contradicts_it_is_refused_by_line(refuse: Refuse, case: str) -> None:
    changes, line = LINES[case]

    assert refuse(*changes) == [line]
