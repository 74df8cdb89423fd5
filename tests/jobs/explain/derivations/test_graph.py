"""Spanning tree, chords, circuits and circuit matrix of coupling graphs."""

import numpy as np
import pytest
from builders.random_cells import random_cell
from hypothesis import given
from hypothesis import strategies as st

from cellplan.jobs.explain.derivations.graph import (
    Coupling,
    CouplingGraph,
    circuit_matrix,
    circuits,
    coupling_graph,
    spanning_tree,
)
from cellplan.model.robot.robot import JointKind


def graph_of(links, edges):
    """A graph from pairs of link numbers."""
    joints = tuple(
        Coupling(
            name=f"j{i}", owner="x", tail=str(tail), head=str(head), kind=JointKind.REVOLUTE, drive=f"j{i}", ratio=1.0
        )
        for i, (tail, head) in enumerate(edges)
    )
    return CouplingGraph(links=tuple(str(link) for link in range(links)), joints=joints)


@st.composite
def graphs(draw):
    """Any graph, also with loops, double edges and loose pieces, and an order of its joints."""
    links = draw(st.integers(1, 8))
    end = st.integers(0, links - 1)
    edges = draw(st.lists(st.tuples(end, end), max_size=14))
    return graph_of(links, edges), draw(st.permutations(range(len(edges))))


@given(graphs())
def test_every_circuit_closes(cell):
    graph, order = cell
    B = circuit_matrix(graph, circuits(graph, spanning_tree(graph, order)))
    np.testing.assert_array_equal(B @ graph.incidence.T, 0)


@given(graphs())
def test_circuits_are_independent_and_as_many_as_euler_says(cell):
    graph, order = cell
    tree = spanning_tree(graph, order)
    B = circuit_matrix(graph, circuits(graph, tree))
    pieces = len(graph.links) - np.linalg.matrix_rank(graph.incidence) if graph.joints else len(graph.links)

    assert len(B) == len(graph.joints) - len(graph.links) + pieces
    chords = sorted(set(range(len(graph.joints))) - tree)
    np.testing.assert_array_equal(B[:, chords], np.eye(len(chords), dtype=int))  # each chord in its own circuit only


def test_a_bridge_is_in_no_circuit():
    graph = graph_of(4, [(0, 1), (1, 2), (2, 0), (2, 3)])
    B = circuit_matrix(graph, circuits(graph, spanning_tree(graph)))
    np.testing.assert_array_equal(B, [[1, 1, 1, 0]])


def test_a_joint_passed_against_its_direction_counts_minus():
    graph = graph_of(3, [(0, 1), (0, 2), (1, 2)])
    (circuit,) = circuits(graph, spanning_tree(graph))
    assert circuit.chord == 2
    assert circuit.passed == ((2, 1), (1, -1), (0, 1))


@pytest.mark.parametrize("operators", [1, 3, 8])
@pytest.mark.parametrize("held", [True, False], ids=["held", "fixed"])
def test_a_cell_has_one_circuit_per_task(operators, held):
    """The circuit matrix of the thesis (Eq. 4.26): virtual chain, operator against it, positioner when it holds."""
    cell = random_cell(operators, operators=operators, held=held, with_follower=True)
    graph = coupling_graph(cell)
    loops = circuits(graph, spanning_tree(graph))
    B = circuit_matrix(graph, loops)

    assert len(loops) == operators == len(graph.joints) - len(graph.links) + 1
    np.testing.assert_array_equal(B @ graph.incidence.T, 0)
    for row, task in zip(B, cell.tasks, strict=True):
        signs = {joint.owner: row[column] for column, joint in enumerate(graph.joints) if row[column]}
        assert signs == {task.name: 1, task.robot: -1, **({"holder": 1} if held else {})}


def test_axes_beside_the_way_to_the_flange_are_left_out():
    cell = random_cell(2, operators=1, with_follower=True)
    names = {joint.name for joint in coupling_graph(cell).joints}
    assert "op0/lever" in names
    assert "op0/side_lever" not in names
