"""Whether stated masses can be those of a real robot: torques that follow from others would mean nothing."""

from collections.abc import Iterator
from itertools import product
from typing import Final

import numpy as np

from cellplan.geometry.inertia import volume
from cellplan.geometry.shapes import bounding_box
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.robot.inertia import LinkInertia
from cellplan.model.robot.robot import BASE, Body, RobotModel
from cellplan.model.units import MM
from cellplan.scene.dynamics.loads import part_share, tool_mass

TRIANGLE_TOL: Final = 1e-3  # [-] of the largest principal inertia: rounding of stated figures, and bodies that are thin
LIGHTEST: Final = 300.0  # [kg/m^3] of all moving links in their bodies: arms with motors have 600 to 1,500
HEAVIEST: Final = 9_000.0  # [kg/m^3] steel has 7,900
OUTSIDE: Final = 0.05  # [m] by which a centre may lie outside the box round the bodies of its link
ALIKE: Final = 3  # [-] links that weigh the same are a coincidence up to two


def missing_masses(cell: Cell, robot: Robot) -> tuple[str, ...]:
    """Why the torques of a robot are not known; empty where the masses of its links, tool and part are stated."""
    return unsound(robot.model)[:1] or unstated_loads(cell, robot)


def unstated_loads(cell: Cell, robot: Robot) -> tuple[str, ...]:
    """Which of tool and part the robot carries without a stated mass."""
    findings: tuple[str, ...] = ()
    if tool_mass(robot) is None:
        findings += ("mass of the tool not stated",)
    if part_share(cell, robot) is None:
        findings += ("mass of the part not stated",)
    return findings


def unsound(model: RobotModel) -> tuple[str, ...]:
    """What is wrong with the masses of a robot, the worst first; nothing where they are sound."""
    masses = {mass.link: mass for mass in model.inertias or ()}
    missing = [axis.name for link, axis in enumerate(model.axes) if link not in masses]
    if not masses:
        return ("masses of links not stated",)
    if missing:
        return (f"{model.name}: no mass stated for {', '.join(missing)}",)
    findings = [*_placeholders(masses), *_displaced(model, masses), *_together(model, masses)]
    return (*impossible(model), *(f"{model.name}: {finding}" for finding in findings))


def impossible(model: RobotModel) -> tuple[str, ...]:
    """Masses and inertias of its links that no rigid body can have."""
    return tuple(f"{model.name}: {finding}" for finding in _impossible(model))


def _placeholders(masses: dict[int, LinkInertia]) -> Iterator[str]:
    """Links that all weigh the same, or have the same inertia."""
    moving = [mass for link, mass in masses.items() if link != BASE]
    if len(moving) < ALIKE:
        return
    if np.ptp([mass.mass for mass in moving]) == 0.0:
        yield f"all links {moving[0].mass:g} kg, which are placeholders"
    elif np.ptp([np.linalg.eigvalsh(mass.inertia_B) for mass in moving], axis=0).max() < 1e-12:
        yield "all links with the same inertia, which is a placeholder"


def _impossible(model: RobotModel) -> Iterator[str]:
    """What no rigid body can have, link by link."""
    for mass in model.inertias or ():
        name, moments = _name(model, mass.link), np.linalg.eigvalsh(mass.inertia_B)
        if mass.mass <= 0.0:
            yield f"{name}: a mass of {mass.mass:g} kg"
        elif moments[0] < 0.0:
            yield f"{name}: an inertia that is not positive definite (least {moments[0]:.3g} kg m²)"
        elif moments[0] + moments[1] < (1.0 - TRIANGLE_TOL) * moments[2]:
            text = ", ".join(f"{moment:.4g}" for moment in moments)
            yield f"{name}: principal inertias {text} kg m², of which the largest exceeds the sum of the others"


def _displaced(model: RobotModel, masses: dict[int, LinkInertia]) -> Iterator[str]:
    """Centres outside the bodies of their link."""
    for link, mass in masses.items():
        bodies = [body for body in model.bodies if body.link == link]
        if bodies and (far := _outside(bodies, mass.centre_B)) > OUTSIDE:
            yield f"{_name(model, link)}: centre of mass {MM * far:.0f} mm outside its bodies"


def _name(model: RobotModel, link: int) -> str:
    """A link by the joint that carries it."""
    return "foot" if link == BASE else model.axes[link].name


def _together(model: RobotModel, masses: dict[int, LinkInertia]) -> Iterator[str]:
    """The mass of all moving links against what they carry, and against the size of their bodies."""
    total = sum(mass.mass for link, mass in masses.items() if link != BASE)
    if model.payload is not None and total < model.payload.mass_kg:
        yield f"its links weigh {total:.3g} kg, less than the {model.payload.mass_kg:g} kg that it carries"
    bodies = [body for body in model.bodies if body.link != BASE]
    if bodies and all(any(body.link == link for body in bodies) for link in range(len(model.joints) - 1)):
        size = sum(volume(body.shape) for body in bodies)
        density = total / size
        if not LIGHTEST <= density <= HEAVIEST:
            expected = f"{LIGHTEST:g} to {HEAVIEST:g}"
            yield f"its links weigh {total:.3g} kg, {density:.0f} kg/m³ of their bodies, expected {expected}"


def _outside(bodies: list[Body], point: Array) -> float:
    """How far a point lies outside the box along the base axes round some bodies, in [m]."""
    corners = []
    for body in bodies:
        middle, half = bounding_box(body.shape)
        box = middle + half * np.array(list(product((-1, 1), repeat=3)))
        corners.append(box @ body.X_BS[:3, :3].T + body.X_BS[:3, 3])
    every = np.concatenate(corners)
    return float(np.linalg.norm(np.maximum(0.0, np.maximum(every.min(axis=0) - point, point - every.max(axis=0)))))
