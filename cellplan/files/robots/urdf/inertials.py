"""Masses and inertias that a URDF states, and the efforts of its joints: only for cells that ask for them."""

from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.files.robots.urdf.document.document import UrdfDocument, UrdfJoint
from cellplan.files.robots.urdf.document.xml import Element, origin_of
from cellplan.files.robots.urdf.tree import UrdfTree, ZeroConfiguration, links_in_order
from cellplan.geometry.transforms import Array
from cellplan.model.robot.inertia import LinkInertia, inertia_matrix, merged

PARTS: Final = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
DYNAMIC: Final = ("<inertial>", "effort of <limit>")  # names of what is read here


def urdf_inertias(tree: UrdfTree, configuration: ZeroConfiguration) -> tuple[LinkInertia, ...]:
    """The masses of all links with ``<inertial>``, those that move together as one; ``InputError`` with file:line."""
    masses = []
    for link in links_in_order(tree):
        element = link.element.one("inertial", f"link '{link.name}'")
        if element is not None:
            X_BL, carrier = configuration.X_BL[link.name], configuration.carrier[link.name]
            masses.append(_inertia(element, f"link '{link.name}'", carrier, X_BL))
    return merged(masses)


def with_efforts(document: UrdfDocument) -> UrdfDocument:
    """The document with its efforts as largest torques and forces; zero stands for none."""
    return replace(document, joints={name: _with_effort(joint) for name, joint in document.joints.items()})


def _with_effort(joint: UrdfJoint) -> UrdfJoint:
    limit = joint.element.one("limit", f"joint '{joint.name}'")
    if limit is None:
        return joint
    effort = limit.number("effort", f"joint '{joint.name}'", default=0.0)
    return replace(joint, limit=replace(joint.limit, torque=effort)) if effort > 0.0 else joint


def _inertia(element: Element, owner: str, carrier: int, X_BL: Array) -> LinkInertia:
    """One ``<inertial>`` in the base frame; whether it is sound is judged with all others."""
    X_BC = X_BL @ origin_of(element, owner)
    mass, inertia = element.one("mass", owner), element.one("inertia", owner)
    if mass is None or inertia is None:
        raise element.error(f"{owner}: expected <inertial> with <mass> and <inertia>")
    six = [inertia.number(part, owner, default=0.0 if part in ("ixy", "ixz", "iyz") else None) for part in PARTS]
    R = X_BC[:3, :3]
    return LinkInertia(
        link=carrier,
        mass=mass.number("value", owner),
        centre_B=X_BC[:3, 3].copy(),
        inertia_B=np.asarray(R @ inertia_matrix(six) @ R.T),
    )
