"""Tools as written in a cell file: a tip and solids, or a rod given by a few lengths and angles."""

from typing import Annotated, Final, Self

from pydantic import Field, model_validator

from cellplan.files.schema.shapes import ToolBodyEntry, ToolShapeEntry
from cellplan.model.settings.entry import Coordinates, Entry, FrameAngle, PoseEntry, Size, rule, setting
from cellplan.model.settings.robot import HEAVIEST_KG
from cellplan.model.settings.units import Deg, Mm, Within

WIDEST_TILT_DEG: Final = 180.0
OF_ROD: Final = ("xyz_mm", "rpy_deg", "geometry")  # keys that a rod stands for

Mass = Annotated[float, Field(ge=0.0, le=HEAVIEST_KG)]


class RodHolderEntry(Entry):
    """A cylinder on the flange that holds the rod."""

    radius_mm: Size = Field(description="Radius.")
    length_mm: Size = Field(description="Length from the flange on.")


class RodEntry(Entry):
    """A round rod from the centre of the flange to the tool tip: the tip frame and the solids follow from it."""

    length_mm: Size = Field(description="Length from the centre of the flange to the tip.")
    tilt_deg: Annotated[Deg, Within(ge=-WIDEST_TILT_DEG, le=WIDEST_TILT_DEG)] = setting(
        Deg(0.0), "Angle between the rod and the flange's z axis, about the flange's y axis turned by roll_deg."
    )
    roll_deg: FrameAngle = setting(
        Deg(0.0), "Angle about the flange's z axis: the tip frame is turned by rpy_deg: [0, tilt, roll]."
    )
    radius_mm: Size = Field(description="Radius of the rod, which has round ends.")
    stick_out_mm: Annotated[Mm, Within(ge=0.0, le=1000.0)] = setting(
        Mm(0.0), "How far the tip lies beyond the end of the rod, as the wire of a torch does."
    )
    holder: RodHolderEntry | None = setting(
        None,
        "Cylinder on the flange that holds the rod, which then begins one radius above the middle of the cylinder; a "
        "rod without one begins at the flange.",
    )

    @property
    def shortest_mm(self) -> float:
        """Smallest length that leaves a rod between its round ends."""
        begin = 0.0 if self.holder is None else 0.5 * self.holder.length_mm + self.radius_mm
        return begin + 2.0 * self.radius_mm + self.stick_out_mm

    @model_validator(mode="after")
    def _is_long_enough(self) -> Self:
        """The round ends need room."""
        if not self.length_mm > self.shortest_mm:
            words = "two radii, stick_out_mm" + (", half the holder and one radius" if self.holder else "")
            raise rule(f"expected more than {self.shortest_mm:g} mm ({words}), got {self.length_mm:g}", "length_mm")
        return self


class ToolEntry(PoseEntry):
    """A tool: its tip in the flange frame, z out of the tool, and its solids; or a rod."""

    rod: RodEntry | None = setting(
        None, "Rod that ends at the tool tip, with its holder; excludes xyz_mm, rpy_deg, geometry."
    )
    geometry: ToolShapeEntry | None = setting(None, "Shape that ends at the tool tip; none when absent.")
    bodies: tuple[ToolBodyEntry, ...] = setting((), "Further solids, placed in the flange frame.")
    mass_kg: Mass | None = setting(
        None, "Mass, for the payload and for weights that grow with the load; absent: not stated."
    )
    centre_mm: Coordinates | None = setting(
        None, "Centre of mass in the flange frame, for the payload; the tool tip when absent."
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        """A centre of mass requires a mass; a rod says where the tip is."""
        if self.centre_mm is not None and self.mass_kg is None:
            raise rule("unexpected key, a centre of mass requires mass_kg", "centre_mm")
        for key in OF_ROD if self.rod is not None else ():
            if key in self.model_fields_set:
                raise rule("unexpected key, rod says where the tool tip is: leave out one of them", key)
        return self
