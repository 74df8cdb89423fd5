"""Rod: a tool given by a few lengths and angles, so that its tip and its solids change together."""

from dataclasses import dataclass

from cellplan.geometry.shapes import Capsule, Cylinder
from cellplan.geometry.transforms import Array, pose
from cellplan.model.robot.robot import BASE, Body


@dataclass(frozen=True, slots=True, kw_only=True)
class Holder:
    """A cylinder on the flange that holds a rod: its radius and its length in [m]."""

    radius: float
    length: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Rod:
    """A round rod from the centre of the flange to the tool tip.

    The tip frame is the flange's, turned by ``roll`` about its z axis, then by ``tilt`` about the new y axis; the tip
    lies ``length`` along the z axis of this frame.
    """

    length: float  # from the centre of the flange to the tip in [m]
    tilt: float  # angle in [rad] between the rod and the flange's z axis
    roll: float  # angle in [rad] about the flange's z axis
    radius: float  # radius of the rod in [m]
    stick_out: float = 0.0  # length in [m] by which the tip lies beyond the end of the rod
    holder: Holder | None = None  # what holds it on the flange; None for a rod that begins at the flange

    @property
    def X_FT(self) -> Array:
        """The tool tip in the flange frame."""
        X_FT = pose(rpy=(0.0, self.tilt, self.roll))
        X_FT[:3, 3] = self.length * X_FT[:3, 2]
        return X_FT

    @property
    def span(self) -> tuple[float, float]:
        """Where the segment of the rod's capsule begins and ends, in [m] from the centre of the flange along the rod.

        With a holder the rod begins one radius above the middle of it, without one at the flange.
        """
        begin = 0.0 if self.holder is None else 0.5 * self.holder.length + self.radius
        return begin + self.radius, self.length - self.stick_out - self.radius

    @property
    def shortest(self) -> float:
        """Smallest length in [m] that leaves a rod between its round ends."""
        begin, end = self.span
        return self.length - (end - begin)

    def bodies(self) -> tuple[Body, ...]:
        """Its solids in the flange frame: the holder, if there is one, and the rod."""
        begin, end = self.span
        if end <= begin:
            raise ValueError(f"rod: expected a length above {self.shortest:g} m, got {self.length:g} m")
        X_FR = self.X_FT
        X_FR[:3, 3] = 0.5 * (begin + end) * X_FR[:3, 2]
        shapes: list[tuple[Cylinder | Capsule, Array]] = []
        if self.holder is not None:
            shapes.append((Cylinder(self.holder.radius, self.holder.length), pose((0, 0, 0.5 * self.holder.length))))
        shapes.append((Capsule(self.radius, end - begin), X_FR))
        return tuple(
            Body(name=tool_body_name(number), link=BASE, shape=shape, X_BS=X_FS)
            for number, (shape, X_FS) in enumerate(shapes, start=1)
        )


def tool_body_name(number: int) -> str:
    """Name of a solid of a tool, counted from 1: ``tool``, ``tool_2``, …."""
    return "tool" if number == 1 else f"tool_{number}"
