"""Tools as written in a cell file: a tip and solids, or a rod given by lengths and angles; grippers of URDFs."""

from typing import Annotated, Final, Self

from pydantic import Field, model_validator

from cellplan.files.schema.shapes import ToolBodyEntry, ToolShapeEntry
from cellplan.model.settings.entry import (
    Coordinates,
    Entry,
    FrameAngle,
    PoseEntry,
    Size,
    Text,
    require_unique,
    rule,
    setting,
)
from cellplan.model.settings.robot import HEAVIEST_KG
from cellplan.model.settings.units import Deg, Mm, Within

FINGER_LIMIT: Final = 2  # joints that open a gripper together
WIDEST_MM: Final = 10_000.0  # a wider opening is a wrong unit
LARGEST_ANGLE_DEG: Final = 720.0
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


class GripperEntry(Entry):
    """A gripper that a URDF brings along: its joints are held still, and its bodies may work on the part."""

    joints: tuple[Text, ...] = setting(
        (),
        "Joints that open it; mimic joints follow by themselves. When absent the only movable joint beyond the flange.",
        max_length=FINGER_LIMIT,
    )
    opening_mm: Annotated[Mm, Within(ge=0.0, le=WIDEST_MM)] | None = setting(
        None,
        "How far its sliding fingers have opened from their closed ends, all fingers together: for two fingers that "
        "meet where they are closed, the distance between them.",
    )
    angle_deg: Annotated[Deg, Within(ge=-LARGEST_ANGLE_DEG, le=LARGEST_ANGLE_DEG)] | None = setting(
        None, "Position of the joint of a gripper whose fingers turn; excludes opening_mm."
    )
    bodies: tuple[Text, ...] | None = setting(
        None,
        "Links, or bodies as reports name them, that may touch the part near the tool tip while the robot works on "
        "it, as those of a tool may; when absent all link bodies that are rigid with the flange.",
        min_length=1,
    )

    @model_validator(mode="after")
    def _opens_once(self) -> Self:
        """One of opening and angle, and joints only with one of them."""
        if self.opening_mm is not None and self.angle_deg is not None:
            raise rule("expected either opening_mm or angle_deg, got both", "angle_deg")
        if self.joints and self.opening_mm is None and self.angle_deg is None:
            raise rule("unexpected key, joints requires opening_mm or angle_deg", "joints")
        require_unique(self.joints, "joints")
        return self
