"""Coupling graph: links are vertices, joints are edges; its spanning tree, chords and circuits."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cellplan.jobs.explain.derivations.serial_chain import chain_to_flange, part_holder
from cellplan.model.cell.cell import Cell, Grasp, Relation, Robot
from cellplan.model.robot.robot import JointKind
from cellplan.model.task.task import Frame, PlaneName

Signs = NDArray[np.int_]
WORLD, PART = "world", "part"
SPACE = (0, 1, 2, 3, 4, 5)  # PPPS: three slides along the axes of P, then a ball joint as three turns about them
PLANE = {PlaneName.XY: (0, 1, 5), PlaneName.YZ: (1, 2, 3), PlaneName.XZ: (0, 2, 4)}  # PPR: two slides and a turn
VIRTUAL_JOINTS = ("px", "py", "pz", "rx", "ry", "rz")  # in the order of a twist, linear part first


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
    """A closed way round, in the direction of its chord."""

    chord: int  # index of the joint that closes it
    passed: tuple[tuple[int, int], ...]  # joints in order, each +1 where it is passed from tail to head, else -1


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


def components(plane: PlaneName | None) -> tuple[int, ...]:
    """Components of a twist that count: all six in space, three in a plane of P."""
    return SPACE if plane is None else PLANE[plane]


def virtual_joint(task: Relation, component: int) -> str:
    """Name of the virtual joint that measures one component of a tool's twist on the part."""
    return f"{task.name}:{VIRTUAL_JOINTS[component]}"


def coupling_graph(cell: Cell, plane: PlaneName | None = None, *, measure_grasps: bool = False) -> CouplingGraph:
    """Links and joints of all robots, each from base to flange, and one virtual chain per task from part to tool.

    Things fixed to each other are one link: the world with all bases (and with a part on a fixture), the last link of
    the positioner with the part, the last link of an operator with its tool. The chains are PPPS in space and PPR in
    a plane ([Ribeiro2010]_ C.1); they add no constraint, they only measure. Followers are joints of their own, driven
    by their leaders; axes beside the way to a flange carry no tool and are left out.

    Where several robots hold the part (4.5), the last links of all of them are one link with it: each further holder
    closes a real circuit over the part and the world, without a virtual chain. What its grasp leaves open is a virtual
    joint that is not measured. A task in the world has its chain from the world to the tool.

    Args:
        plane: Plane of P in which everything moves; None for space.
        measure_grasps: Whether each further holder is let go and given a whole virtual chain to the part instead, so
            that it is measured how it would stray from its grasp.
    """
    joints = [
        coupling
        for robot in cell.robots
        for coupling in _robot_joints(robot, tool_link(cell, robot, plane, measure_grasps=measure_grasps))
    ]
    for relation in cell.relations:
        desired = components(plane)
        if isinstance(relation, Grasp) and not measure_grasps:
            desired = tuple(component for component in desired if component not in relation.axes)
        if desired:
            tool = tool_link(cell, cell.robot(relation.robot), plane, measure_grasps=measure_grasps)
            tail = part_link(cell) if relation.relative_to is Frame.PART else WORLD
            joints += _virtual_chain(relation, desired, tail=tail, head=tool)
    links = dict.fromkeys([WORLD, part_link(cell)] + [end for joint in joints for end in (joint.tail, joint.head)])
    return CouplingGraph(links=tuple(links), joints=tuple(joints))


def part_link(cell: Cell) -> str:
    """The link that the part belongs to: the world when it is fixed."""
    holder = part_holder(cell)
    return PART if holder is not None and chain_to_flange(holder[0].model) else WORLD


def tool_link(cell: Cell, robot: Robot, plane: PlaneName | None = None, *, measure_grasps: bool = False) -> str:
    """The link that a robot's tool belongs to; that of a holder whose grasp leaves nothing open is the part's."""
    if not chain_to_flange(robot.model):
        return WORLD
    holder = part_holder(cell)
    if holder is not None and holder[0].name == robot.name:
        return PART
    rigid = [grasp.robot for grasp in cell.closures if set(components(plane)) <= set(grasp.axes)]
    return part_link(cell) if robot.name in rigid and not measure_grasps else f"{robot.name}/tool"


def _robot_joints(robot: Robot, tool: str) -> list[Coupling]:
    """The joints of one robot from base to flange, each pointing away from the base."""
    chain = chain_to_flange(robot.model)
    links = [WORLD, *(f"{robot.name}/{number}" for number in range(1, len(chain))), tool]
    return [
        Coupling(
            name=f"{robot.name}/{axis.name}",
            owner=robot.name,
            tail=links[place],
            head=links[place + 1],
            kind=axis.kind,
            drive=f"{robot.name}/{robot.model.joints[drive.joint].name}",
            ratio=drive.ratio,
        )
        for place, (axis, drive) in enumerate(chain)
    ]


def _virtual_chain(task: Relation, desired: tuple[int, ...], *, tail: str, head: str) -> list[Coupling]:
    """The virtual joints of one task or grasp, pointing from the part, or the world, to the tool."""
    inner = [f"{task.name}:{number}" for number in range(1, len(desired))]
    links = [tail, *inner, head]
    names = [virtual_joint(task, component) for component in desired]
    return [
        Coupling(
            name=name,
            owner=task.name,
            tail=links[place],
            head=links[place + 1],
            kind=JointKind.PRISMATIC if desired[place] < 3 else JointKind.REVOLUTE,
            drive=name,
            is_virtual=True,
        )
        for place, name in enumerate(names)
    ]
