"""Coupling graph: links are vertices, joints are edges; its spanning tree, chords and circuits."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cellplan.model.robot.robot import JointKind

Signs = NDArray[np.int_]


@dataclass(frozen=True, slots=True, kw_only=True)
class Coupling:
    """One joint as an edge that points from the link that carries it to the link it moves."""

    name: str  # ``robot/joint``, or ``task:px`` for a virtual joint
    owner: str  # name of the robot or task
    tail: str  # link that carries the joint
    head: str  # link that the joint moves
    kind: JointKind  # revolute or prismatic
    drive: str  # name of the joint whose speed moves it: its own, or that of a follower's leader
    ratio: float = 1.0  # its speed per speed of the drive
    is_virtual: bool = False  # whether it belongs to a virtual Assur chain


@dataclass(frozen=True, slots=True, kw_only=True)
class CouplingGraph:
    """Links and the joints between them."""

    links: tuple[str, ...]
    joints: tuple[Coupling, ...]

    @property
    def incidence(self) -> Signs:
        """Incidence matrix ``A``, shape (links, joints): -1 where a joint begins, +1 where it ends."""
        A = np.zeros((len(self.links), len(self.joints)), dtype=np.int_)
        place = {link: row for row, link in enumerate(self.links)}
        for column, joint in enumerate(self.joints):
            A[place[joint.tail], column] -= 1
            A[place[joint.head], column] += 1
        return A


@dataclass(frozen=True, slots=True, kw_only=True)
class Circuit:
    """A closed way round, in the direction of its chord.

    Attributes:
        passed: Joints in the order of the way, each with +1 where it is passed from tail to head, else -1.
    """

    chord: int  # index of the joint that closes it
    passed: tuple[tuple[int, int], ...]


def spanning_tree(graph: CouplingGraph, order: Sequence[int] | None = None) -> frozenset[int]:
    """Joints that tie all links together without a circuit ([Ribeiro2010]_ App. C.2).

    Args:
        order: All joints by index, in the order in which they are offered to the tree; the order of the graph if None.
            Joints offered late become chords.
    """
    group = {link: link for link in graph.links}

    def root(link: str) -> str:
        while group[link] != link:
            link = group[link]
        return link

    tree = set()
    for index in range(len(graph.joints)) if order is None else order:
        tail, head = root(graph.joints[index].tail), root(graph.joints[index].head)
        if tail != head:
            group[head] = tail
            tree.add(index)
    return frozenset(tree)


def circuits(graph: CouplingGraph, tree: Iterable[int]) -> tuple[Circuit, ...]:
    """One circuit for each chord: the chord, then back through the tree from its head to its tail."""
    tree_edges = frozenset(tree)
    neighbours: dict[str, list[tuple[int, int, str]]] = {link: [] for link in graph.links}
    for index in sorted(tree_edges):
        joint = graph.joints[index]
        neighbours[joint.tail].append((index, 1, joint.head))
        neighbours[joint.head].append((index, -1, joint.tail))
    fundamental_circuits = []
    for chord, joint in enumerate(graph.joints):
        if chord not in tree_edges:
            back = _tree_path(neighbours, joint.head, joint.tail)
            fundamental_circuits.append(Circuit(chord=chord, passed=((chord, 1), *back)))
    return tuple(fundamental_circuits)


def circuit_matrix(graph: CouplingGraph, fundamental_circuits: Sequence[Circuit]) -> Signs:
    """Circuit matrix ``B``, shape (circuits, joints), entries 0, +1, -1 ([Ribeiro2010]_ Eqs. 3.58, 4.26)."""
    B = np.zeros((len(fundamental_circuits), len(graph.joints)), dtype=np.int_)
    for row, circuit in enumerate(fundamental_circuits):
        for joint, sign in circuit.passed:
            B[row, joint] = sign
    return B


def _tree_path(neighbours: dict[str, list[tuple[int, int, str]]], start: str, goal: str) -> list[tuple[int, int]]:
    """The only way through a tree from one link to another, as joints with signs."""
    came: dict[str, tuple[int, int, str]] = {}
    open_links, visited = [start], {start}
    while goal not in visited:
        here = open_links.pop()
        for joint, sign, there in neighbours[here]:
            if there not in visited:
                visited.add(there)
                came[there] = (joint, sign, here)
                open_links.append(there)
    path: list[tuple[int, int]] = []
    while goal != start:
        joint, sign, goal = came[goal]
        path.append((joint, sign))
    return path[::-1]
