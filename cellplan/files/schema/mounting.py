"""What robots stand on or hang from, and attachments of their links, as written in a cell file."""

from typing import ClassVar

from pydantic import Field

from cellplan.files.schema.shapes import SolidEntry
from cellplan.model.settings.entry import Coordinate, Entry, Name, OneOf, PoseEntry, Size, Text, setting


class PedestalColumnEntry(Entry):
    """A round column."""

    radius_mm: Size = Field(description="Radius.")


class PedestalBoxEntry(Entry):
    """A box seen from above."""

    size_mm: tuple[Size, Size] = Field(description="Edge lengths along the x and y of the base.")


class ColumnEntry(OneOf):
    """A column between a robot's base and what carries it: exactly one of cylinder and box."""

    alternatives: ClassVar[tuple[str, ...]] = ("cylinder", "box")

    cylinder: PedestalColumnEntry | None = setting(None, "Round column through the base's origin.")
    box: PedestalBoxEntry | None = setting(None, "Box round the base's origin, turned as it is.")


class PedestalEntry(ColumnEntry):
    """What a robot stands on, upright from the floor to the origin of its base; a tilted base cuts off its top."""

    floor_z_mm: Coordinate | None = setting(
        None,
        "Height of the floor that it stands on; when absent the highest plane of the environment that is not above "
        "the base.",
    )


class HangingEntry(ColumnEntry):
    """What a robot hangs from upside down, upright from the origin of its base to the ceiling."""

    ceiling_z_mm: Coordinate = Field(description="Height of the ceiling.")


class WallEntry(ColumnEntry):
    """What a robot is fixed to sideways, along the -z axis of its base."""

    length_mm: Size = Field(description="Length from the base to the wall.")


class RailBodyEntry(SolidEntry):
    """A solid of a rail: exactly one shape."""

    at: PoseEntry = setting(PoseEntry(), "Pose of the solid in the base frame while the rail reads zero.")


class _OnLink(Entry):
    """The first keys of an attachment."""

    link: Text = Field(description="Link that carries it: the word base or a joint of a robot table, a link of a URDF.")
    name: Name | None = setting(None, "Name in reports, as ROBOT/NAME; attachment, attachment_2, … when absent.")


class AttachmentEntry(SolidEntry, _OnLink):
    """A solid mounted on a link of a robot, such as a hose, a feeder or a valve block: exactly one shape."""

    at: PoseEntry = setting(
        PoseEntry(),
        "Pose of the solid while all joints read zero: in the base frame for a robot table, as the bodies of the "
        "table are given; in the frame of the link for a URDF.",
    )
