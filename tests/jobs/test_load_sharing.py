"""Several robots hold the part: the loop stays closed over the whole motion, alone and with an operator at work."""

import json
from dataclasses import replace

import numpy as np
import pytest
from builders.records import phase_record

from cellplan import load_cell, solve, verify, write_run
from cellplan.geometry.transforms import inverse, pose
from cellplan.jobs.explain.explain import explain
from cellplan.jobs.explain.result import structure_lines, structure_record
from cellplan.report.page.render import report_page
from cellplan.report.record.common import Provenance
from cellplan.report.text.run import summary_lines
from cellplan.runs.overrides import with_overrides
from cellplan.runs.solve import render_program
from cellplan.scene.kinematics.screw_chain import ScrewChain

pytestmark = pytest.mark.usefixtures("stored_solutions")

ALLOWED_MM, ALLOWED_DEG = 0.003, 0.001


@pytest.fixture(scope="module")
def planar(cells):
    return solve(with_overrides(load_cell(cells / "load_sharing_planar.yaml"), duration=3.0))


def loop_gaps(cell, q):
    """Positions of further holders' grasps off the part in [mm] at every instant, from screws alone."""
    tools = {r.name: ScrewChain(r).tool_poses(q[r.name]) for r in cell.robots}
    first, *others = cell.part.held_by
    X_WP = tools[first.robot] @ inverse(first.X_PT)
    return [
        1e3 * np.linalg.norm((tools[grasp.robot] @ inverse(grasp.X_PT) - X_WP)[:, :3, 3], axis=1) for grasp in others
    ]


def test_the_loop_stays_closed_over_the_whole_motion(planar):
    run = planar.runs[0]
    (gaps,) = loop_gaps(planar.cell, run.report.q)
    (closure,) = run.report.closures

    assert planar.passed
    assert len(gaps) == 3001
    assert gaps.max() <= ALLOWED_MM
    assert 1e3 * np.linalg.norm(closure.position_error, axis=1).max() <= ALLOWED_MM
    assert np.degrees(np.linalg.norm(closure.orientation_error, axis=1)).max() <= ALLOWED_DEG


def test_the_part_goes_where_the_task_in_the_world_says(planar):
    cell, report = planar.cell, planar.runs[0].report
    tip = ScrewChain(cell.robot("left")).tool_poses(report.q["left"])[:, :2, 3]
    from_centre = np.linalg.norm(tip - [0.65, 0.0], axis=1)
    np.testing.assert_allclose(from_centre, 0.1, atol=3e-6)
    assert np.ptp(tip, axis=0) == pytest.approx([0.2, 0.2], abs=1e-5)  # once round


@pytest.mark.slow
def test_moving_the_whole_cell_changes_no_joint_table(cells):
    cell = with_overrides(load_cell(cells / "load_sharing_planar.yaml"), duration=3.0)
    cell = replace(
        cell, motion=replace(cell.motion, step=0.01), solver=cell.solver.changed(gain_per_s=50.0), obstacles=()
    )
    first = solve(cell)
    X = pose((0.0, 0.0, 0.3))  # the path is given in the world: along z all three components of it stay
    robots = tuple(replace(robot, X_WB=X @ robot.X_WB) for robot in first.cell.robots)

    again = solve(replace(first.cell, robots=robots))

    np.testing.assert_allclose(again.runs[0].motion.q, first.runs[0].motion.q, atol=1e-12)


def test_the_record_the_page_and_the_screen_tell_the_closure(planar, tmp_path):
    write_run(planar, tmp_path / "run")
    record = json.loads((tmp_path / "run" / "report.json").read_text(encoding="utf-8"))
    closure = record["closure"]["right"]
    report, none = planar.runs[0].report, Provenance(versions={}, digests={})
    page = report_page(phase_record(report, cell=planar.cell, provenance=none), cell=planar.cell, plots={})

    assert {"max_position_error_mm", "max_orientation_error_deg", "at_s"} <= set(closure)
    assert 0.0 < closure["max_position_error_mm"] <= ALLOWED_MM
    assert closure["allowed"] == {"position_mm": 0.003, "orientation_deg": 0.001}
    assert closure["axes"] == ["x", "y", "rz"]
    assert record["tasks"]["carry"]["relative_to"] == "world"
    assert {record["motion_share"][robot]["role"] for robot in ("left", "right")} == {"positioner"}
    assert (tmp_path / "run" / "plots" / "closure_right.svg").is_file()
    assert '<h2 id="closure">Load sharing</h2>' in page
    assert "Largest closure error" in page
    assert any(
        line.startswith("  largest closure error ") and line.endswith(f" grasp of right at {closure['at_s']:.3f} s")
        for line in summary_lines(record, tmp_path / "run")
    )


def test_written_tables_are_verified_with_their_closure_again(planar):
    again = verify(planar.cell, planar.runs[0].program.tables)
    assert again.passed
    np.testing.assert_array_equal(again.closures[0].position_error, planar.runs[0].report.closures[0].position_error)


def test_tables_that_let_the_part_go_are_rejected(planar):
    """The second holder turns its wrist by 0.1 deg too much: its tool leaves the part, and nothing else changes."""
    cell, motion = planar.cell, planar.runs[0].motion
    q = motion.q.copy()
    q[:, -1] += np.radians(0.1)

    report = verify(cell, render_program(cell, replace(motion, q=q)).tables)

    broken = {check.name: check for check in report.checks if not check.passed}
    assert set(broken) == {"closure_position_error", "closure_orientation_error"}
    assert broken["closure_orientation_error"].value == pytest.approx(0.1, abs=1e-6)
    assert broken["closure_position_error"].value == pytest.approx(200.0 * np.radians(0.1), rel=0.01)  # 200 mm of wrist


def test_explain_shows_the_closure_as_a_block_and_counts_the_freedom(planar):
    structure = explain(planar.cell)
    (matrix,) = structure.matrices
    lines = structure_lines(structure_record(structure))

    assert matrix.blocks == ("carry", "right@part")
    np.testing.assert_array_equal(matrix.signs, [[1, 0], [-1, 1]])
    assert (matrix.rank, matrix.redundancy) == (6, 0)
    assert "  right@part  3     - J    + J" in lines
    assert "grasps of co-holders, which close kinematic loops; left carries the part frame" in lines


def test_explain_states_the_real_circuit_up_one_holder_and_down_the_other(cells):
    lines = structure_lines(structure_record(explain(load_cell(cells / "load_sharing.yaml"))))
    place = lines.index("  1  right      +A2 +B2 +C2 +D2 +E2 +F2")
    assert lines[place + 1] == "     left       -F2 -E2 -D2 -C2 -B2 -A2"
    assert "  degree of redundancy: 18 - 12 = 6 where the rows are independent" in lines


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["simultaneous", "pairwise"])
def test_two_arms_share_a_beam_while_a_third_works_on_it(cells, mode):
    solution = solve(with_overrides(load_cell(cells / "load_sharing.yaml"), mode=mode))
    run = solution.runs[0]
    assert solution.passed
    assert max(gaps.max() for gaps in loop_gaps(solution.cell, run.report.q)) <= ALLOWED_MM
    assert all(np.ptp(q, axis=0).max() > 0.1 for q in run.report.q.values())  # all three robots move
