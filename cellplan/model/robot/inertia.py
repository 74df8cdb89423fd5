"""Masses and inertias of links and of what a flange carries."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from cellplan.geometry.transforms import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinkInertia:
    """The mass of one link at the reference configuration, where all joints read zero, in the robot's base frame B."""

    link: int  # index of the joint that carries it, followers counted after joints; ``BASE`` for the foot of the robot
    mass: float  # in [kg]
    centre_B: Array  # its centre in [m], shape (3,)
    inertia_B: Array  # about its centre in [kg m^2], shape (3, 3)

    def displaced(self, D: Array) -> "LinkInertia":
        """The same mass after a displacement, shape (4, 4)."""
        R = D[:3, :3]
        return replace(self, centre_B=R @ self.centre_B + D[:3, 3], inertia_B=R @ self.inertia_B @ R.T)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CarriedMass:
    """A mass on a flange, in the frame F of the flange."""

    mass: float  # in [kg]
    centre_F: Array  # its centre in [m], shape (3,)
    inertia_F: Array  # about its centre in [kg m^2], shape (3, 3)

    def on_link(self, link: int, X_BF: Array) -> LinkInertia:
        """The same mass as one of the link that carries the flange, which is at ``X_BF`` at the reference."""
        R = X_BF[:3, :3]
        centre_B, inertia_B = R @ self.centre_F + X_BF[:3, 3], R @ self.inertia_F @ R.T
        return LinkInertia(link=link, mass=self.mass, centre_B=centre_B, inertia_B=inertia_B)


def inertia_matrix(six: Iterable[float]) -> Array:
    """The symmetric matrix of xx, xy, xz, yy, yz, zz, shape (3, 3)."""
    xx, xy, xz, yy, yz, zz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def merged(masses: Iterable[LinkInertia]) -> tuple[LinkInertia, ...]:
    """One mass for each link that has some, in the order of the links (the theorem of parallel axes)."""
    by_link: dict[int, list[LinkInertia]] = {}
    for mass in masses:
        by_link.setdefault(mass.link, []).append(mass)
    return tuple(_sum(by_link[link]) for link in sorted(by_link))


def _sum(masses: list[LinkInertia]) -> LinkInertia:
    """All masses of one link as one."""
    if len(masses) == 1:
        return masses[0]
    total = sum(it.mass for it in masses)
    moments = np.sum([it.mass * it.centre_B for it in masses], axis=0)
    centre_B = moments / total if total else np.mean([it.centre_B for it in masses], axis=0)
    inertia_B = np.zeros((3, 3))
    for it in masses:
        arm = it.centre_B - centre_B
        inertia_B += it.inertia_B + it.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return LinkInertia(link=masses[0].link, mass=total, centre_B=centre_B, inertia_B=inertia_B)
