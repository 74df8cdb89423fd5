"""Payload: the load of each robot, at rest and in the written motion, against its rated load."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.measures.accelerations import point_accelerations
from cellplan.model.cell.cell import Cell, Robot, RobotRows
from cellplan.model.report.report import Check
from cellplan.model.robot.inertia import CarriedMass
from cellplan.model.robot.payload import AxisUse, LoadUse
from cellplan.model.robot.robot import BASE, FollowerJoint, Joint
from cellplan.model.settings.robot import AxisLimitEntry, PayloadEntry
from cellplan.model.units import MM
from cellplan.scene.dynamics.loads import GRAVITY, carried_masses, part_share, tool_mass
from cellplan.scene.kinematics.screw_chain import Chains, ScrewChain

UP: Final = np.array([0.0, 0.0, 1.0])
WRIST_AXIS_COUNT: Final = 3  # [-] revolute axes before the flange that are judged


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _CarriedLoad:
    """A mass on its way."""

    mass: float  # in [kg]
    points: Array  # its centre in the world in [m], shape (N, 3)
    force: Array  # what holds and moves it, expressed in the world in [N], shape (N, 3)
    inertia: Array  # about its centre, expressed in the world in [kg m^2], shape (N, 3, 3)


def load_uses(cell: Cell, chains: Chains, times: Array, q: RobotRows) -> tuple[LoadUse, ...]:
    """What every robot carries over a run.

    The part is shared equally by all that hold it; where the masses weigh says ``carried_masses``.

    Args:
        times: Times of the rows in [s], shape (N,).
    """
    return tuple(_load_use(cell, robot, chains[robot.name], times=times, q=q[robot.name]) for robot in cell.robots)


def check_payload(uses: tuple[LoadUse, ...]) -> list[Check]:
    """Whether the loads are within the rated loads, where both are stated."""
    return [check for use in uses for check in _checks(use)]


def check_payload_at_rest(cell: Cell, chains: Chains, start: Array) -> list[Check]:
    """What the robots carry while they stand at one stacked configuration of shape (nq,) in [rad] or [m]."""
    still = {robot.name: np.tile(start[cell.columns(robot.name)], (2, 1)) for robot in cell.robots}
    return check_payload(load_uses(cell, chains, np.array([0.0, 1.0]), still))


def _load_use(cell: Cell, robot: Robot, chain: ScrewChain, *, times: Array, q: Array) -> LoadUse:
    use = LoadUse(
        robot=robot.name,
        tool_mass=tool_mass(robot),
        part_mass=part_share(cell, robot),
        holders=len(cell.positioners),
        limits=robot.model.payload,
    )
    if not use.is_known or use.known_mass == 0.0:
        return use
    masses = carried_masses(cell, robot)
    D = chain.link_displacements(q)
    X_WF = D[:, robot.model.flange_link + 1] @ robot.model.X_BF
    carried = [_carried(mass, X_WF, times) for mass in masses]
    felt = np.linalg.norm(np.sum([load.force for load in carried], axis=0), axis=1) / GRAVITY
    return replace(
        use,
        centre_F=np.sum([mass.mass * mass.centre_F for mass in masses], axis=0) / use.known_mass,
        felt=float(felt.max()),
        felt_at_s=float(times[np.argmax(felt)]),
        axes=tuple(_axis_use(joint, D[:, joint.parent + 1], carried, times) for joint in _wrist(robot)),
    )


def _carried(mass: CarriedMass, X_WF: Array, times: Array) -> _CarriedLoad:
    """A mass that moves with a flange of poses of shape (N, 4, 4)."""
    R = X_WF[:, :3, :3]
    points = R @ mass.centre_F + X_WF[:, :3, 3]
    force = mass.mass * (point_accelerations(times, points) + GRAVITY * UP)
    return _CarriedLoad(mass=mass.mass, points=points, force=force, inertia=R @ mass.inertia_F @ R.transpose(0, 2, 1))


def _wrist(robot: Robot) -> list[Joint]:
    """The last turning axes on the way to the flange, in the order of the joints."""
    axes: tuple[Joint | FollowerJoint, ...] = (*robot.model.joints, *robot.model.followers)
    link, joints = robot.model.flange_link, list[Joint]()
    while link != BASE and len(joints) < WRIST_AXIS_COUNT:
        axis = axes[link]
        if isinstance(axis, Joint) and axis.is_revolute:
            joints.append(axis)
        link = axis.parent
    return joints[::-1]


def _axis_use(joint: Joint, D: Array, carried: Sequence[_CarriedLoad], times: Array) -> AxisUse:
    r"""What the load does to one axis: moments ``s . ((p - s0) x f)`` with ``f = m (a - g)``, and its inertia.

    Args:
        D: Displacements of the link that carries it, shape (N, 4, 4).
        times: Times in [s], shape (N,).
    """
    s = D[:, :3, :3] @ joint.axis_B
    s0 = D[:, :3, :3] @ joint.point_B + D[:, :3, 3]
    static, moving, inertia = np.zeros((3, len(times)))
    for load in carried:
        arm = load.points - s0
        static += np.sum(s * np.cross(arm, load.mass * GRAVITY * UP), axis=1)
        moving += np.sum(s * np.cross(arm, load.force), axis=1)
        inertia += load.mass * np.sum(np.cross(s, arm) ** 2, axis=1) + np.einsum("ni,nij,nj->n", s, load.inertia, s)
    static, moving = np.abs(static), np.abs(moving)
    return AxisUse(
        joint=joint.name,
        static_moment=float(static.max()),
        static_at_s=float(times[np.argmax(static)]),
        moment=float(moving.max()),
        moment_at_s=float(times[np.argmax(moving)]),
        inertia=float(inertia.max()),
        inertia_at_s=float(times[np.argmax(inertia)]),
    )


def _checks(use: LoadUse) -> list[Check]:
    """The checks of one robot: its mass where that is known or too large already, the rest where all is known."""
    limits = use.limits
    if limits is None or (not use.is_known and use.known_mass <= limits.mass_kg):
        return []
    checks = [_mass_check(use, limits)]
    if use.centre_F is not None:
        checks += _centre_checks(use, limits)
        for axis in (axis for axis in use.axes if axis.joint in limits.axes):
            checks += _axis_checks(use, axis, limits.axes[axis.joint])
    return checks


def _mass_check(use: LoadUse, limits: PayloadEntry) -> Check:
    masses = []
    if use.tool_mass is None or use.tool_mass > 0.0:
        masses.append(f"tool {use.tool_mass:.4g} kg" if use.tool_mass is not None else "tool mass not stated")
    if use.part_mass is None or use.part_mass > 0.0:
        share = "" if use.holders < 2 else f" as its share among {use.holders} holders"
        masses.append(f"part {use.part_mass:.4g} kg{share}" if use.part_mass is not None else "part mass not stated")
    carried = f"carries {use.known_mass:.4g} kg" + (f" ({', '.join(masses)})" if masses else "")
    mass, limit = use.known_mass, limits.mass_kg
    message = f"payload {use.robot}: {carried}, allowed {limit:g} kg"
    return Check("payload", use.robot, mass <= limit, message, value=mass, limit=limit, unit="kg", at_s=None)


def _centre_checks(use: LoadUse, limits: PayloadEntry) -> list[Check]:
    """The centre of mass of the load against the published distances."""
    checks = []
    for where, origin, value, limit in (
        ("along", "from the flange plane", use.along, limits.along_mm),
        ("across", "from the flange axis", use.across, limits.across_mm),
    ):
        if limit is not None:
            subject, distance, passed = f"{use.robot} {where}", MM * value, value <= limit.si
            text = f"payload {use.robot}: centre of mass {distance:.1f} mm {origin}, allowed {limit:g} mm"
            checks.append(
                Check("payload_centre", subject, passed, text, value=distance, limit=limit, unit="mm", at_s=None)
            )
    return checks


def _axis_checks(use: LoadUse, axis: AxisUse, limit: AxisLimitEntry) -> list[Check]:
    """Moment and inertia about one axis against what is published."""
    subject, checks = f"{use.robot}/{axis.joint}", []
    if limit.moment_nm is not None:
        worst, at_s = max((axis.moment, axis.moment_at_s), (axis.static_moment, axis.static_at_s))
        most, passed = limit.moment_nm, worst <= limit.moment_nm
        text = (
            f"payload {subject}: moment of the load {worst:.2f} Nm at {at_s:.3f} s "
            f"({axis.static_moment:.2f} Nm at rest), allowed {most:g} Nm"
        )
        checks.append(Check("payload_moment", subject, passed, text, value=worst, limit=most, unit="Nm", at_s=at_s))
    if limit.inertia_kg_m2 is not None:
        worst, at_s, most, unit = axis.inertia, axis.inertia_at_s, limit.inertia_kg_m2, "kg m²"
        text = f"payload {subject}: inertia of the load {worst:.4f} {unit} at {at_s:.3f} s, allowed {most:g} {unit}"
        passed = worst <= most
        checks.append(Check("payload_inertia", subject, passed, text, value=worst, limit=most, unit=unit, at_s=at_s))
    return checks
