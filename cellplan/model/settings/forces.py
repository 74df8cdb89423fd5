"""Forces as a cell file states them: of processes on their tools, and of grips that hold the part by friction."""

from typing import Annotated, Final, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from cellplan.geometry.arrays import Array
from cellplan.model.settings.entry import AxisName, Entry, Size, rule, setting

LARGEST_N: Final = 100_000.0  # no robot bears more
MOST_PADS: Final = 20
TORSION_ARM: Final = 2.0 / 3.0  # [-] of the radius: lever of friction over a disc with even pressure

Component = Annotated[float, Field(ge=-LARGEST_N, le=LARGEST_N)]
Triple = tuple[Component, Component, Component]
NO_FORCE: Final = (0.0, 0.0, 0.0)


class ProcessForceEntry(Entry):
    """Force and moment that a process exerts on its tool, at the tip; the opposite ones act on the part."""

    frame: Literal["tool", "part", "world"] = setting(
        "tool",
        "Axes of force and moment: those of the tool tip, of the part (of the world for a task in the world), or of "
        "the world.",
    )
    newton: Triple = setting(
        NO_FORCE,
        "Force on the tool: [0, 0, -50] in the tool frame where the tool is pressed onto the part with 50 N.",
    )
    newton_metre: Triple = setting(NO_FORCE, "Moment on the tool about its tip.")

    @model_validator(mode="after")
    def _is_any(self) -> Self:
        """A force or a moment."""
        if not any((*self.newton, *self.newton_metre)):
            raise rule("expected a force or a moment that is not zero", "newton")
        return self

    @property
    def wrench(self) -> Array:
        """Force in [N] and moment in [N m] on the tool at its tip, in the stated axes, shape (6,)."""
        return np.array([*self.newton, *self.newton_metre])

    def mirrored(self, signs: Array) -> "ProcessForceEntry":
        """The mirror image, coordinates times signs of shape (3,); a moment is an axial vector."""
        force, moment = signs * self.newton, np.prod(signs) * signs * self.newton_metre
        return self.changed(newton=tuple(map(float, force)), newton_metre=tuple(map(float, moment)))


class GripEntry(Entry):
    """Pads that hold the part by friction; they press along one line through the tool tip."""

    force_n: Annotated[float, Field(gt=0.0, le=LARGEST_N)] = Field(description="Force with which each pad presses.")
    friction: Annotated[float, Field(gt=0.0, le=1.0)] = Field(
        description="Coefficient of friction between pad and part."
    )
    pads: Annotated[int, Field(ge=1, le=MOST_PADS)] = setting(
        2, "Number of pads: 2 for a pair of jaws, 1 for a suction cup or a magnet."
    )
    radius_mm: Size = Field(description="Radius of the disc with which a pad touches the part.")
    normal: AxisName = Field(description="Axis of the tool frame along which the pads press.")

    @property
    def axis(self) -> int:
        """Number of the axis along which the pads press."""
        return "xyz".index(self.normal)

    @property
    def pressure(self) -> float:
        """Forces of all pads added up in [N]."""
        return self.pads * self.force_n

    @property
    def lever(self) -> float:
        """Moment about the normal per tangential force that friction bears, in [m]."""
        return TORSION_ARM * self.radius_mm.si
