"""The structure of cells that no file can describe: followers, robots beside the work, configurations of any kind."""

from dataclasses import replace

import numpy as np
import pytest
from builders.jacobian_cells import planners_jacobian
from builders.random_cells import make_task, random_cell

from cellplan.errors import InputError
from cellplan.jobs.explain.explain import explain
from cellplan.jobs.explain.result import structure_lines, structure_record
from cellplan.model.cell.cell import Mode


def with_starts(cell, q):
    robots = tuple(replace(robot, start=q[cell.columns(robot.name)]) for robot in cell.robots)
    return replace(cell, robots=robots)


@pytest.mark.parametrize("operators", range(1, 9))
def test_rank_and_redundancy_are_those_of_the_matrix(operators):
    cell = random_cell(operators, operators=operators, with_follower=True)
    q = np.random.default_rng(operators).uniform(-1.5, 1.5, cell.joint_count)

    (matrix,) = explain(with_starts(cell, q)).matrices

    J = planners_jacobian(cell, q).reshape(-1, cell.joint_count)
    assert matrix.rank == np.linalg.matrix_rank(J)
    assert matrix.redundancy == J.shape[1] - matrix.rank
    np.testing.assert_allclose(matrix.singular_values, np.linalg.svd(J, compute_uv=False), rtol=1e-9)


def test_followers_are_joints_of_the_graph_driven_by_their_leaders():
    structure = explain(random_cell(3, operators=1, with_follower=True))
    lever = next(joint for joint in structure.graph.joints if joint.name == "op0/lever")
    lines = structure_lines(structure_record(structure))

    assert (lever.drive, lever.ratio) == ("op0/j1", -0.7)
    assert "  lever       revolute   -0.7 times j1" in lines


def test_a_bystander_has_links_and_no_columns():
    cell = random_cell(4, operators=2, joints=6)
    cell = replace(cell, tasks=cell.tasks[:1])

    structure = explain(cell)

    assert structure.matrices[0].columns == (6, 6, 0)
    assert len(structure.circuits) == 1
    assert "op1/tool" in structure.graph.links
    assert structure.matrices[0].missing == ("holder", "op0")
    assert "robot op1  (random) idle" in structure_lines(structure_record(structure))


def test_two_tasks_of_one_operator_are_refused_in_one_phase_and_have_a_matrix_each_in_two():
    cell = random_cell(5, operators=1, joints=6)
    cell = replace(cell, tasks=(*cell.tasks, make_task("op0", name="again")))
    q = np.random.default_rng(5).uniform(-1.5, 1.5, cell.joint_count)
    started = with_starts(cell, q)

    with pytest.raises(InputError) as caught:
        explain(started)
    matrices = explain(replace(started, motion=replace(started.motion, mode=Mode.PAIRWISE))).matrices

    assert str(caught.value) == (
        "<cell>: tasks.again.robot: expected a robot without another task in the phase 'all tasks', got 'op0' "
        f"(work: {cell.tasks[0].name}): add program: {{}} for a sequence of tasks"
    )
    assert [(sum(matrix.rows), matrix.rank, matrix.redundancy) for matrix in matrices] == [(6, 6, 6), (6, 6, 6)]


def test_a_fixed_part_and_resting_robots_keep_their_places():
    cell = random_cell(6, operators=2, held=False, joints=6)
    cell = replace(cell, motion=replace(cell.motion, mode=Mode.PART_AT_REST))

    (matrix,) = explain(cell).matrices

    np.testing.assert_array_equal(matrix.signs, [[0, 1, 0], [0, 0, 1]])
    assert matrix.columns == (0, 6, 6)
