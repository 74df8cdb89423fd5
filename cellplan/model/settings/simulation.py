"""Simulated arms of an errors file: friction, drives and joint controllers."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Final, Literal

import numpy as np
from pydantic import Field, Tag

from cellplan.geometry.arrays import Array
from cellplan.model.settings.entry import Entry, Name, by_kind, setting
from cellplan.model.settings.units import Deg, Mm, Ms, Within

LARGEST: Final = 1e9  # [N m/rad] and the like: more is a wrong unit
LONGEST_SAMPLE_MS: Final = 1_000.0
WIDEST_PLAY_MM: Final = 100.0
WIDEST_PLAY_DEG: Final = 45.0
FIGURE_WORDS: Final = "a number for all joints, or {JOINT: NUMBER}"

SampleTime = Annotated[Ms, Within(gt=0.0, le=LONGEST_SAMPLE_MS)]
Figure = Annotated[float, Field(ge=0.0, le=LARGEST)]
PlayAngle = Annotated[Deg, Within(ge=0.0, le=WIDEST_PLAY_DEG)]
PlayLength = Annotated[Mm, Within(ge=0.0, le=WIDEST_PLAY_MM)]
Feedforward = Literal["none", "gravity", "dynamics"]
JointFigures = Annotated[
    Annotated[Figure, Tag("<number>")] | Annotated[dict[str, Figure], Tag("<mapping>")],
    by_kind(FIGURE_WORDS, number=(int, float), mapping=dict),
]
PlayFigures = Annotated[
    Annotated[PlayAngle, Tag("<number>")] | Annotated[dict[str, PlayAngle], Tag("<mapping>")],
    by_kind(FIGURE_WORDS, number=(int, float), mapping=dict),
]


class SimulatedRobotEntry(Entry):
    """A robot whose joints are moved by controllers; joints that a key does not name have its default."""

    kp: JointFigures = Field(description="Control signal per error, in [N m/rad] or [N/m].")
    ki: JointFigures = setting(0.0, "Control signal per integrated error, in [N m/(rad s)] or [N/(m s)].")
    kd: JointFigures = setting(0.0, "Control signal per rate of the error, in [N m s/rad] or [N s/m].")
    control_ms: SampleTime = setting(Ms(1.0), "Time from one sample of the controllers to the next.")
    saturation: JointFigures | None = setting(
        None, "Largest control signal, in [N m] or [N]; when absent, the torque limit of the joint where it has one."
    )
    dead_zone: JointFigures = setting(
        0.0, "Control signal that moves nothing, in [N m] or [N]; beyond it, what exceeds it acts on the joint."
    )
    backlash_deg: PlayFigures = setting(Deg(0.0), "Width of the play between drive and link of turning joints.")
    backlash_mm: PlayLength = setting(Mm(0.0), "The same of sliding joints.")
    encoder: Literal["drive", "link"] = setting(
        "drive", "Where joint positions are measured: before the play, at the drive, or behind it, at the link."
    )
    friction: JointFigures = setting(0.0, "Viscous friction, in [N m s/rad] or [N s/m].")
    rotor_inertia: JointFigures = setting(
        0.0, "Inertia of motor and gear seen from the joint, the gear ratio squared included, in [kg m²] or [kg]."
    )
    feedforward: Feedforward = setting(
        "none",
        "Torque that the controllers add: none; gravity at the reference; or dynamics, which the reference "
        "motion needs with these masses and this friction.",
    )


class SimulationEntry(Entry):
    """Arms with masses and joint controllers, which execute the program."""

    step_ms: SampleTime = setting(Ms(1.0), "Longest step of the integration, by Runge and Kutta.")
    robots: dict[Name, SimulatedRobotEntry] = Field(
        description="Simulated robots by name; the others reach exactly what they are commanded."
    )


def of_joints(figure: float | Mapping[str, float], names: Sequence[str], *, others: Sequence[float] = ()) -> Array:
    """A figure of each joint as the file has it, shape (n,); joints that it does not name have 0, or those others."""
    if not isinstance(figure, Mapping):
        return np.full(len(names), float(figure))
    absent = others or [0.0] * len(names)
    return np.array([figure.get(name, value) for name, value in zip(names, absent, strict=True)], dtype=float)
