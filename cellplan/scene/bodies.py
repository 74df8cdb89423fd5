"""Everything solid in a cell: links, tools, the part and the surroundings, each with what moves it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.shapes import HalfSpace, Shape
from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell.cell import Cell, Grasp, Part, Robot, RobotRows
from cellplan.model.cell.name_order import NameOrder
from cellplan.model.cell.rod import tool_body_name
from cellplan.model.robot.robot import BASE, Body
from cellplan.scene.collision.bodies import BodyPoses, require_rigid
from cellplan.scene.kinematics.screw_chain import Chains


class Kind(StrEnum):
    """What a body belongs to."""

    LINK = "link"
    TOOL = "tool"
    PART = "part"
    OBSTACLE = "obstacle"
    ATTACHMENT = "attachment"
    PEDESTAL = "pedestal"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SceneBody:
    """One solid of the cell."""

    # ``<robot>/<body>``, ``<robot>/tool``, ``<robot>/pedestal``, ``<robot>/mount`` or ``<robot>/<attachment>``,
    # ``part`` or the name of a thing in the surroundings
    name: str
    kind: Kind  # what it belongs to
    shape: Shape  # the solid, in its own frame S
    robot: str | None  # the robot that moves it; None when it is fixed in the world
    link: int  # the link of that robot it is fixed to
    X_BS: Array  # its pose at the reference configuration in the robot's base frame, or in the world
    # how far the real thing may stick out of it in [m]; None when it is not stated. What the user draws (tools,
    # attachments, pedestals, surroundings) is taken as exact; of a part from a STEP file it is the deviation of the
    # mesh.
    accuracy: float | None = 0.0

    @property
    def is_at_rest(self) -> bool:
        """Whether it never moves: the surroundings, a fixed part, the foot of a robot."""
        return self.robot is None or self.link == BASE


def scene_bodies(cell: Cell) -> tuple[SceneBody, ...]:
    """All solids of a cell: by robot its links, tools, attachments and pedestal, then the part and the surroundings.

    Robots and surroundings stand in the order of their names.

    ``InputError`` where two bodies have the same name.
    """
    named = NameOrder.of(cell).cell  # the order of a file does not decide which pairs come first
    bodies = [body for robot in named.robots for body in _robot_bodies(robot)]
    bodies.append(part_body(cell, cell.part, *cell.part.held_by[:1]))
    bodies += [_fixed(thing.name, Kind.OBSTACLE, shape=thing.shape, X_WS=thing.X_WS) for thing in named.obstacles]
    names: set[str] = set()
    for body in bodies:
        if body.name in names:
            raise InputError(f"{cell.origin.file}: two bodies are named '{body.name}': rename one of them")
        names.add(body.name)
    return tuple(bodies)


def body_poses(bodies: Sequence[SceneBody], chains: Chains, q: RobotRows) -> BodyPoses:
    """Poses of all bodies in the world, from joint positions in [rad] or [m] by robot, shape (N, n) each."""
    return carried_poses(bodies, {name: chains[name].link_displacements(positions) for name, positions in q.items()})


def link_displacements(cell: Cell, chains: Chains, q: Array) -> dict[str, Array]:
    """Displacements of all links by robot, see ``ScrewChain``, at stacked joint positions of shape (N, nq)."""
    columns = {robot.name: cell.columns(robot.name) for robot in cell.robots}
    return {name: chains[name].link_displacements(q[:, indices]) for name, indices in columns.items()}


def solid_poses(bodies: Sequence[SceneBody], cut_from: Sequence[int], D: Mapping[str, Array]) -> BodyPoses:
    """Poses of all bodies that are no half-spaces, then of what is cut from some of them; see ``carried_poses``."""
    solids = [body for body in bodies if not is_ground(body)]
    return carried_poses([*solids, *(solids[index] for index in cut_from)], D)


def carried_poses(bodies: Sequence[SceneBody], D: Mapping[str, Array]) -> BodyPoses:
    """Poses of all bodies in the world, from the displacements of the links by robot, shape (N, links + 1, 4, 4).

    Links are far fewer than bodies: what is checked are their displacements and where on them the bodies are.

    ``CellplanError`` where one is not finite or not rigid.
    """
    count, X_BS = len(next(iter(D.values()))) if D else 1, np.array([body.X_BS for body in bodies]).reshape(-1, 4, 4)
    for X in (*D.values(), X_BS[None]):
        require_rigid(X[..., :3, :3], X[..., :3, 3])
    R, p = np.empty((len(bodies), count, 3, 3)), np.empty((len(bodies), count, 3))
    links: dict[tuple[str, int], tuple[Array, Array]] = {}
    for index, body in enumerate(bodies):
        if body.robot is None:
            R[index], p[index] = body.X_BS[:3, :3], body.X_BS[:3, 3]
            continue
        key = (body.robot, body.link)
        if key not in links:
            X = D[body.robot][:, body.link + 1]
            links[key] = np.ascontiguousarray(X[:, :3, :3]).reshape(-1, 3), X[:, :3, 3]
        rows, p_WL = links[key]  # the rows of all rotations: one product for all samples
        np.matmul(rows, body.X_BS[:3, :3], out=R[index].reshape(-1, 3))
        np.matmul(rows, body.X_BS[:3, 3], out=p[index].reshape(-1))
        p[index] += p_WL
    return BodyPoses(R, p)


def is_ground(body: SceneBody) -> bool:
    """Whether a body is a half-space, which is no body of the engine."""
    return isinstance(body.shape, HalfSpace)


def _robot_bodies(robot: Robot) -> list[SceneBody]:
    """Links and tools of one robot, what is mounted on its links, and what it stands on."""
    model, flange = robot.model, robot.model.flange_link
    bodies = [_carried(robot, Kind.LINK, body, accuracy=model.accuracy_of(body)) for body in model.bodies]
    for number, body in enumerate(robot.tool.bodies, start=1):
        mounted = replace(body, name=tool_body_name(number), link=flange, X_BS=model.X_BF @ body.X_BS)
        bodies.append(_carried(robot, Kind.TOOL, mounted))
    bodies += [_carried(robot, Kind.ATTACHMENT, body) for body in robot.attachments]
    below = None if robot.pedestal is None else robot.pedestal.solid(robot.X_WB)
    if robot.pedestal is not None and below is not None:
        foot = Body(name=robot.pedestal.name, link=BASE, shape=below[0], X_BS=below[1])
        bodies.append(_carried(robot, Kind.PEDESTAL, foot))
    return bodies


def _carried(robot: Robot, kind: Kind, body: Body, *, accuracy: float | None = 0.0) -> SceneBody:
    """A body on a link of a robot."""
    return SceneBody(
        name=f"{robot.name}/{body.name}",
        kind=kind,
        shape=body.shape,
        robot=robot.name,
        link=body.link,
        X_BS=body.X_BS,
        accuracy=accuracy,
    )


def part_body(cell: Cell, part: Part, grasp: Grasp | None = None) -> SceneBody:
    """The part, carried by one of its holders or fixed in the world."""
    if grasp is None:
        fixed = _fixed("part", Kind.PART, shape=part.shape, X_WS=part.X_CP @ part.X_PS)
        return replace(fixed, accuracy=part.accuracy)
    holder = cell.robot(grasp.robot)
    return SceneBody(
        name="part",
        kind=Kind.PART,
        shape=part.shape,
        robot=holder.name,
        link=holder.model.flange_link,
        X_BS=holder.model.X_BF @ holder.tool.X_FT @ inverse(grasp.X_PT) @ part.X_PS,
        accuracy=part.accuracy,
    )


def _fixed(name: str, kind: Kind, *, shape: Shape, X_WS: Array) -> SceneBody:
    """A body fixed in the world."""
    return SceneBody(name=name, kind=kind, shape=shape, robot=None, link=BASE, X_BS=X_WS)
