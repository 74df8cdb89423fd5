"""Closed shapes that a path can run round: they have no order of their own, so a cell says where and which way."""

from typing import Annotated, Final, Literal, Self

from pydantic import Field, Tag, model_validator

from cellplan.model.settings.entry import (
    Angle,
    Component,
    Entry,
    PlaneCoordinates,
    SignedAxis,
    Size,
    by_kind,
    rule,
    setting,
)
from cellplan.model.settings.units import Deg, Mm

PlaneWord = Literal["xy", "yz", "xz"]
PlaneDirection = tuple[Component, Component]
SHORTEST_START: Final = 1e-6  # [-] a shorter vector has no direction

START_WORDS: Final = "+x, -x, +y, -y, +z, -z or a direction [u, v] on the plane's axes"

StartChoice = Annotated[
    Annotated[SignedAxis, Tag(f"<{START_WORDS}>")] | Annotated[PlaneDirection, Tag("<list>")],
    by_kind(START_WORDS, list=tuple),
]


class ClosedShapeEntry(Entry):
    """What all closed shapes share: a plane, a centre, and the way round."""

    plane: PlaneWord = Field(description="Plane of the part frame; its first letter is the first axis.")
    center_mm: PlaneCoordinates = setting((Mm(0.0), Mm(0.0)), "Centre on the plane's two axes.")
    direction: Literal["counterclockwise", "clockwise"] = setting(
        "counterclockwise",
        "Way round, seen from outside the surface: from the side that the path is projected from; for a path that is "
        "used as drawn against the tool axis, or against the plane's normal axis when the tool axis lies in the plane.",
    )


class CircleEntry(ClosedShapeEntry):
    """A circle."""

    radius_mm: Size = Field(description="Radius.")
    start_at: StartChoice = setting(
        (1.0, 0.0), "Direction from the centre to the start: an axis of the plane, or [u, v] on the plane's axes."
    )

    @model_validator(mode="after")
    def _starts_somewhere(self) -> Self:
        start_direction(self.start_at, self.plane)
        return self


class RectangleEntry(ClosedShapeEntry):
    """A rectangle."""

    sides_mm: tuple[Size, Size] = Field(description="Length along the plane's first and second axis.")
    angle_deg: Angle = setting(Deg(0.0), "Turn in the plane, from the first axis towards the second.")
    start_at: PlaneDirection = setting(
        (1.0, 1.0),
        "Corner of the start by the signs of its place before the rectangle is turned: [1, 1], [-1, 1], [-1, -1] or "
        "[1, -1].",
    )

    @model_validator(mode="after")
    def _starts_at_a_corner(self) -> Self:
        if not all(abs(part) == 1.0 for part in self.start_at):
            corner = f"[{self.start_at[0]:g}, {self.start_at[1]:g}]"
            raise rule(f"expected a corner: [1, 1], [-1, 1], [-1, -1] or [1, -1], got {corner}", "start_at")
        return self


class RhombusEntry(ClosedShapeEntry):
    """A rhombus."""

    diagonals_mm: tuple[Size, Size] = Field(description="Length along the plane's first and second axis.")
    angle_deg: Angle = setting(Deg(0.0), "Turn in the plane, from the first axis towards the second.")
    start_at: StartChoice = setting(
        (1.0, 0.0),
        "Corner of the start before the rhombus is turned: an axis of the plane, or [u, v] along one of the plane's "
        "axes.",
    )

    @model_validator(mode="after")
    def _starts_at_a_corner(self) -> Self:
        u, v = start_direction(self.start_at, self.plane)
        if u and v:
            raise rule(f"expected a corner: [1, 0], [0, 1], [-1, 0] or [0, -1], got [{u:g}, {v:g}]", "start_at")
        return self


def start_direction(written: str | PlaneDirection, plane: str) -> PlaneDirection:
    """Components on the plane's axes of a start that is written as an axis or as a direction."""
    if not isinstance(written, str):
        if max(abs(written[0]), abs(written[1])) < SHORTEST_START:
            raise rule("expected a direction that is not zero, got a vector of no length", "start_at")
        return written
    if written[1] not in plane:
        allowed = ", ".join(f"{sign}{axis}" for axis in plane for sign in "+-")
        raise rule(f"expected an axis of the plane {plane}: {allowed}, got {written}", "start_at")
    size = -1.0 if written[0] == "-" else 1.0
    return (size, 0.0) if written[1] == plane[0] else (0.0, size)
