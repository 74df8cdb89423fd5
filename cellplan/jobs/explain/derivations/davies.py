"""Davies' method: joint twists sum to zero round every circuit, whichever joints are imposed, whichever are sought."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cellplan.errors import InputError, NotPlanarError, PrimaryChoiceError
from cellplan.geometry.transforms import Array, inverse, skew
from cellplan.jobs.explain.derivations.graph import (
    Circuit,
    CouplingGraph,
    Signs,
    circuit_matrix,
    circuits,
    components,
    coupling_graph,
    spanning_tree,
    virtual_joint,
)
from cellplan.jobs.explain.derivations.serial_chain import (
    axis_positions,
    chain_to_flange,
    checked_configuration,
    displacement,
    part_holder,
)
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.task.task import Frame, PlaneName

IN_PLANE_TOL = 1e-9  # [-] share of a unit screw that may point out of the plane: rounding of poses in files
RANK_TOL = 1e-10  # [-] singular values below this share of the largest one are zero: rounding of unit screws
CLOSURE_TOL = 1e-9  # [-] largest gap left in a circuit, as a share of the imposed twists: rounding of a solve


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Network:
    """Circuits of a cell at one configuration, and what unit speed of each joint adds to the sum round each of them."""

    graph: CouplingGraph  # links and joints
    circuits: tuple[Circuit, ...]  # one for each chord
    joints: tuple[str, ...]  # names of the driven joints of all robots in the stacked order, then of the virtual joints
    matrix: Array  # unit screws, linear part first, in P about its origin, shape (rows per circuit * circuits, joints)

    def columns(self, names: Collection[str]) -> list[int]:
        """Places of joints by name."""
        for name in names:
            if name not in self.joints:
                raise InputError(f"joint: expected one of {', '.join(self.joints)}, got '{name}'")
        return [self.joints.index(name) for name in names]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NetworkVelocities:
    """Velocities of all joints that keep every circuit closed."""

    velocities: Mapping[str, float]  # by joint name, in [rad/s] or [m/s]; the imposed ones as given
    freedom: int  # how many of the sought speeds could still be chosen; 0 when the imposed ones decide all


def network(
    cell: Cell,
    q: Array,
    *,
    plane: PlaneName | None = None,
    tree_order: Sequence[int] | None = None,
    measure_grasps: bool = False,
) -> Network:
    r"""Network matrix of a cell, ``N = sum_e B_e $_e`` ([Ribeiro2010]_ Eqs. 3.59, 4.27; App. E in the plane).

    The signed sum of joint twists round each circuit is zero, ``N qdot = 0``. A follower adds its ratio to the column
    of its leader. The circuits of further holders are among them, so speeds that fulfil it keep their grasps.

    Args:
        q: Stacked joint vector in [rad] or [m], shape (nq,).
        plane: Plane of P in which everything moves (PPR chains, three rows); None for space (PPPS, six rows).
        tree_order: Order in which joints are offered to the spanning tree; any order gives the same speeds.
        measure_grasps: Whether further holders are let go and measured, see `coupling_graph`.

    Raises:
        InputError: The configuration does not fit the cell, or a fixed part has no pose.
        NotPlanarError: A joint in a circuit moves out of the plane, or a task is given in the world.
    """
    q = checked_configuration(cell, q)
    _refuse_world_in_plane(cell, plane)
    graph = coupling_graph(cell, plane, measure_grasps=measure_grasps)
    fundamental_circuits = circuits(graph, spanning_tree(graph, tree_order))
    B = circuit_matrix(graph, fundamental_circuits)
    rows = list(components(plane))
    screws = _unit_screws(cell, q, graph)
    _check_planar(graph, screws, B=B, rows=rows)
    driven = [f"{robot.name}/{joint.name}" for robot in cell.robots for joint in robot.model.joints]
    joints = (*driven, *(joint.name for joint in graph.joints if joint.is_virtual))
    shares = np.zeros((len(graph.joints), len(joints)))
    for row, joint in enumerate(graph.joints):
        shares[row, joints.index(joint.drive)] = joint.ratio
    summed = (B[:, None, :] * screws[None, rows, :]).reshape(-1, len(graph.joints))
    return Network(graph=graph, circuits=fundamental_circuits, joints=joints, matrix=summed @ shares)


def partition(net: Network, primary: Collection[str]) -> tuple[Array, Array]:
    r"""Split the closure into ``N_s qdot_s = N_p qdot_p`` for any choice of primary joints.

    Args:
        primary: Names of the joints whose speeds are given. All others, in the order of ``net.joints``, are secondary.

    Returns:
        ``N_s`` and ``N_p``; the minus of the side that changed over is in ``N_p``.
    """
    given = net.columns(primary)
    sought = [column for column in range(len(net.joints)) if column not in set(given)]
    return net.matrix[:, sought], -net.matrix[:, given]


def davies_cooperation_jacobian(
    cell: Cell, q: Array, *, plane: PlaneName | None = None, tree_order: Sequence[int] | None = None
) -> Array:
    r"""Cooperation Jacobian ``N_p^{-1} N_s`` with the virtual joints primary ([Ribeiro2010]_ Eqs. 3.72, 4.33, App. E).

    Further holders are let go and measured like tools at work; their blocks follow those of the tasks. With their
    virtual joints locked, that is with the speeds of these blocks at zero, the loops are closed (4.5).

    Args:
        q: Stacked joint vector in [rad] or [m], shape (nq,).
        plane: Plane of P in which everything moves; None for space.
        tree_order: Order in which joints are offered to the spanning tree; the result does not depend on it.

    Returns:
        Twists of the tools relative to the part, linear part first, expressed in P, shape (tasks + further holders, 6,
        nq), or (..., 3, nq) in a plane: the two speeds in it and the turn about its normal. Of a task in the world,
        relative to and in W.

    Raises:
        InputError: The configuration does not fit the cell, or a fixed part has no pose.
        NotPlanarError: A joint in a circuit moves out of the plane, or a task is given in the world.
    """
    net = network(cell, q, plane=plane, tree_order=tree_order, measure_grasps=True)
    desired = components(plane)
    virtual = [virtual_joint(relation, component) for relation in cell.relations for component in desired]
    N_s, N_p = partition(net, virtual)
    J = np.linalg.solve(N_p, N_s).reshape(len(cell.relations), len(desired), cell.joint_count)
    return np.asarray(J, dtype=np.float64)


def solve_network(net: Network, imposed: Mapping[str, float], *, weights: Array | None = None) -> NetworkVelocities:
    """Speeds of all joints when some are imposed (0 locks a joint); a joint that is monitored is simply not imposed.

    Where the imposed speeds leave freedom, the sought speeds with the smallest weighted sum of squares are taken.

    Args:
        imposed: Speeds by joint name, in [rad/s] or [m/s].
        weights: Positive weights of all joints in the order of ``net.joints``; ones if None.
    """
    for name, speed in imposed.items():
        if not np.isfinite(speed):
            raise InputError(f"joint '{name}': expected a finite speed, got {speed}")
    weights = _checked_weights(net, weights)
    N_s, N_p = partition(net, imposed)
    sought = [name for name in net.joints if name not in imposed]
    root = np.sqrt(weights[net.columns(sought)])
    desired = N_p @ np.array(list(imposed.values()))
    y, _, rank, _ = np.linalg.lstsq(N_s / root, desired, rcond=RANK_TOL)
    velocities = y / root
    scale = np.abs(N_p) @ np.abs(np.array(list(imposed.values())))
    if np.abs(N_s @ velocities - desired).max(initial=0.0) > CLOSURE_TOL * scale.max(initial=0.0):
        raise PrimaryChoiceError(
            f"imposed speeds of {', '.join(imposed)}: no speeds of the other joints keep the circuits closed; "
            "impose fewer joints, or consistent speeds"
        )
    values = {**dict(zip(sought, velocities.tolist(), strict=True)), **imposed}
    return NetworkVelocities(velocities={name: values[name] for name in net.joints}, freedom=len(sought) - int(rank))


def _refuse_world_in_plane(cell: Cell, plane: PlaneName | None) -> None:
    """Refuse chains in a plane of the part for a task whose components are those of the world."""
    for task in cell.tasks:
        if plane is not None and task.relative_to is Frame.WORLD:
            raise NotPlanarError(
                f"task '{task.name}': expected a path on the part in a plane of the part, got one in the world; "
                "omit the plane and use the spatial chains"
            )


def _unit_screws(cell: Cell, q: Array, graph: CouplingGraph) -> Array:
    """Unit screws of all joints of the graph in its order, linear part first, in P about its origin, shape (6, e)."""
    placed = {robot.name: _robot_screws(robot, q[cell.columns(robot.name)]) for robot in cell.robots}
    holder = part_holder(cell)
    X_WP = cell.part.X_CP if holder is None else placed[holder[0].name][1] @ holder[1]
    X_PW = inverse(X_WP)
    to_P = np.zeros((6, 6))
    to_P[:3, :3] = to_P[3:, 3:] = X_PW[:3, :3]
    to_P[:3, 3:] = skew(X_PW[:3, 3]) @ X_PW[:3, :3]
    real = [to_P @ screws for screws, _ in placed.values()]
    virtual = []
    names = {joint.name for joint in graph.joints}
    for task in cell.relations:
        r = (X_PW @ placed[task.robot][1] @ cell.robot(task.robot).tool.X_FT)[:3, 3]
        chain = np.eye(6)  # [e; 0] for a slide, [r x e; e] for a turn at the tool tip (Eq. 3.64)
        if task.relative_to is Frame.WORLD:
            chain[:3, :3] = chain[3:, 3:] = X_PW[:3, :3]  # along the axes of W
        chain[:3, 3:] = skew(r) @ chain[3:, 3:]
        virtual.append(chain[:, [axis for axis in range(6) if virtual_joint(task, axis) in names]])
    return np.concatenate([*real, *virtual], axis=1)


def _robot_screws(robot: Robot, q: Array) -> tuple[Array, Array]:
    """Unit screws of a robot's axes in W about its origin, shape (6, axes), and its flange in W."""
    chain = chain_to_flange(robot.model)
    screws = np.zeros((6, len(chain)))
    D = robot.X_WB
    for column, ((axis, _), position) in enumerate(zip(chain, axis_positions(chain, q), strict=True)):
        s = D[:3, :3] @ axis.axis_B
        s0 = D[:3, :3] @ axis.point_B + D[:3, 3]
        screws[:, column] = np.concatenate([np.cross(s0, s), s] if axis.is_revolute else [s, np.zeros(3)])
        D = D @ displacement(axis.axis_B, axis.point_B, position, is_revolute=axis.is_revolute)
    return screws, D @ robot.model.X_BF


def _check_planar(graph: CouplingGraph, screws: Array, *, B: Signs, rows: list[int]) -> None:
    """Refuse joints in circuits that move anything out of the plane."""
    outside = [row for row in range(6) if row not in rows]
    across = np.abs(screws[outside]).max(axis=0, initial=0.0).tolist()
    allowed = (IN_PLANE_TOL * np.abs(screws).max(axis=0)).tolist()
    for joint, passes, off, limit in zip(graph.joints, np.abs(B).sum(axis=0).tolist(), across, allowed, strict=True):
        if passes and off > limit:
            raise NotPlanarError(
                f"joint '{joint.name}': expected motion in a plane of the part, got motion across it; "
                "omit the plane and use the spatial chains"
            )


def _checked_weights(net: Network, weights: Array | None) -> Array:
    """Weights of all joints, ones if none are given."""
    if weights is None:
        return np.ones(len(net.joints))
    weights = np.asarray(weights, dtype=float)
    if weights.shape != (len(net.joints),) or not np.all((weights > 0.0) & np.isfinite(weights)):
        raise InputError(f"weights: expected {len(net.joints)} positive numbers, one per joint of the network")
    return weights
