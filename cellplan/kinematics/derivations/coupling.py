"""The coupling graph of a cell: links, joints, and a virtual Assur chain from the part to every tool."""

from cellplan.kinematics.derivations.graph import Coupling, CouplingGraph
from cellplan.kinematics.derivations.serial_chain import chain_to_flange, part_holder
from cellplan.model.cell import Cell, Robot
from cellplan.model.robot import JointKind
from cellplan.model.task import PlaneName, Task

WORLD, PART = "world", "part"
SPACE = (0, 1, 2, 3, 4, 5)  # PPPS: three slides along the axes of P, then a ball joint as three turns about them
PLANE = {PlaneName.XY: (0, 1, 5), PlaneName.YZ: (1, 2, 3), PlaneName.XZ: (0, 2, 4)}  # PPR: two slides and a turn
VIRTUAL_JOINTS = ("px", "py", "pz", "rx", "ry", "rz")  # in the order of a twist, linear part first


def components(plane: PlaneName | None) -> tuple[int, ...]:
    """Components of a twist that count: all six in space, three in a plane of P."""
    return SPACE if plane is None else PLANE[plane]


def virtual_joint(task: Task, component: int) -> str:
    """Name of the virtual joint that measures one component of a tool's twist on the part."""
    return f"{task.name}:{VIRTUAL_JOINTS[component]}"


def coupling_graph(cell: Cell, plane: PlaneName | None = None) -> CouplingGraph:
    """Links and joints of all robots, each from base to flange, and one virtual chain per task from part to tool.

    Things fixed to each other are one link: the world with all bases (and with a part on a fixture), the last link of
    the positioner with the part, the last link of an operator with its tool. The chains are PPPS in space and PPR in
    a plane ([Ribeiro2010]_ C.1); they add no constraint, they only measure. Followers are joints of their own, driven
    by their leaders; axes beside the way to a flange carry no tool and are left out.

    Args:
        cell: The cell.
        plane: Plane of P in which everything moves; None for space.
    """
    joints = [coupling for robot in cell.robots for coupling in _robot_joints(cell, robot)]
    joints += [coupling for task in cell.tasks for coupling in _virtual_chain(cell, task, components(plane))]
    links = dict.fromkeys([WORLD, part_link(cell)] + [end for joint in joints for end in (joint.tail, joint.head)])
    return CouplingGraph(links=tuple(links), joints=tuple(joints))


def part_link(cell: Cell) -> str:
    """The link that the part belongs to: the world when it is fixed."""
    holder = part_holder(cell)
    return PART if holder is not None and chain_to_flange(holder[0].model) else WORLD


def tool_link(cell: Cell, robot: Robot) -> str:
    """The link that a robot's tool belongs to."""
    if not chain_to_flange(robot.model):
        return WORLD
    holder = part_holder(cell)
    return PART if holder is not None and holder[0].name == robot.name else f"{robot.name}/tool"


def _robot_joints(cell: Cell, robot: Robot) -> list[Coupling]:
    """The joints of one robot from base to flange, each pointing away from the base."""
    chain = chain_to_flange(robot.model)
    links = [WORLD, *(f"{robot.name}/{number}" for number in range(1, len(chain))), tool_link(cell, robot)]
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


def _virtual_chain(cell: Cell, task: Task, wanted: tuple[int, ...]) -> list[Coupling]:
    """The virtual joints of one task, pointing from the part to the tool."""
    inner = [f"{task.name}:{number}" for number in range(1, len(wanted))]
    links = [part_link(cell), *inner, tool_link(cell, cell.robot(task.robot))]
    names = [virtual_joint(task, component) for component in wanted]
    return [
        Coupling(
            name=name,
            owner=task.name,
            tail=links[place],
            head=links[place + 1],
            kind=JointKind.PRISMATIC if wanted[place] < 3 else JointKind.REVOLUTE,
            drive=name,
            is_virtual=True,
        )
        for place, name in enumerate(names)
    ]
