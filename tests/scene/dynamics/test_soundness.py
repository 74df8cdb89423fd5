"""Masses that no robot has are found, by link and by figure; those of bundled robots are sound."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import arm_model

from cellplan.files.robots.joint_table import bundled_names, load_bundled
from cellplan.geometry.inertia import centre_and_inertia, volume
from cellplan.model.robot.inertia import LinkInertia, merged
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.robot import PayloadEntry
from cellplan.scene.dynamics.soundness import unsound

SOUND = ("franka_panda", "kuka_lbr_iiwa_14_r820", "kuka_lbr_iiwa_7_r800", "ur5e")
DENSITY = 1000.0  # [kg/m^3]


def heavy_arm(density: float = DENSITY) -> RobotModel:
    """The elbow arm of bodies of uniform density."""
    model = arm_model()
    masses = []
    for body in model.bodies:
        mass, R = density * volume(body.shape), body.X_BS[:3, :3]
        centre, inertia = centre_and_inertia(body.shape)
        centre_B = R @ centre + body.X_BS[:3, 3]
        masses.append(LinkInertia(link=body.link, mass=mass, centre_B=centre_B, inertia_B=mass * R @ inertia @ R.T))
    return replace(model, inertias=merged(masses), payload=PayloadEntry(mass_kg=3.0))


def changed(link: int, change: Callable[[LinkInertia], LinkInertia]) -> RobotModel:
    model = heavy_arm()
    return replace(model, inertias=tuple(change(it) if it.link == link else it for it in model.inertias or ()))


def with_mass(mass: float) -> Callable[[LinkInertia], LinkInertia]:
    return lambda it: replace(it, mass=mass)


def with_moments(*moments: float) -> Callable[[LinkInertia], LinkInertia]:
    return lambda it: replace(it, inertia_B=np.diag(moments))


def test_bodies_of_uniform_density_are_sound() -> None:
    assert unsound(heavy_arm()) == ()


@pytest.mark.parametrize("name", bundled_names())
def test_bundled_robots_have_sound_masses_or_none(name: str) -> None:
    findings = unsound(load_bundled(name))
    assert findings == (() if name in SOUND else ("masses of links not stated",))


@pytest.mark.parametrize(
    ("model", "finding"),
    [
        (arm_model(), "masses of links not stated"),
        (replace(heavy_arm(), inertias=(heavy_arm().inertias or ())[:-1]), "elbow: no mass stated for a6"),
        (changed(2, with_mass(-1.0)), "elbow: a3: a mass of -1 kg"),
        (changed(-1, with_moments(1.0, 1.0, 2.1)), "elbow: foot: principal inertias 1, 1, 2.1 kg m², of which the"),
        (changed(1, with_moments(-0.1, 1.0, 1.0)), "elbow: a2: an inertia that is not positive definite (least -0.1 "),
        (
            changed(4, lambda it: replace(it, centre_B=it.centre_B + np.array([0.0, 0.145, 0.0]))),
            "elbow: a5: centre of mass 100 mm outside its bodies",
        ),
        (
            replace(heavy_arm(), inertias=tuple(replace(it, mass=2.0) for it in heavy_arm().inertias or ())),
            "elbow: all links 2 kg, which are placeholders",
        ),
        (heavy_arm(100.0), "elbow: its links weigh 1.5 kg, less than the 3 kg that it carries"),
    ],
)
def test_masses_that_no_robot_has_are_named(model: RobotModel, finding: str) -> None:
    assert any(line.startswith(finding) for line in unsound(model)), unsound(model)


def test_links_far_lighter_than_their_bodies_are_named() -> None:
    light = replace(heavy_arm(100.0), payload=None)
    assert unsound(light) == ("elbow: its links weigh 1.5 kg, 100 kg/m³ of their bodies, expected 300 to 9000",)
