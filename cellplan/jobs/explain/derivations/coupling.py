"""The coupling graph of a cell: links, joints, and a virtual Assur chain from the part to every tool."""

from cellplan.jobs.explain.derivations.graph import Coupling, CouplingGraph
from cellplan.jobs.explain.derivations.serial_chain import chain_to_flange, part_holder
from cellplan.model.cell.cell import Cell, Grasp, Relation, Robot
from cellplan.model.robot.robot import JointKind
from cellplan.model.task.task import Frame, PlaneName

WORLD, PART = "world", "part"
SPACE = (0, 1, 2, 3, 4, 5)  # PPPS: three slides along the axes of P, then a ball joint as three turns about them
PLANE = {PlaneName.XY: (0, 1, 5), PlaneName.YZ: (1, 2, 3), PlaneName.XZ: (0, 2, 4)}  # PPR: two slides and a turn
VIRTUAL_JOINTS = ("px", "py", "pz", "rx", "ry", "rz")  # in the order of a twist, linear part first


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
            joints += _virtual_chain(relation, desired, tail=_reference_link(cell, relation), head=tool)
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


def _reference_link(cell: Cell, relation: Relation) -> str:
    """The link that a tool's motion is relative to."""
    return part_link(cell) if relation.relative_to is Frame.PART else WORLD


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
            drive=f"{robot.name}/{robot.model.joints[axis.leader].name}",
            ratio=axis.ratio,
        )
        for place, axis in enumerate(chain)
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
