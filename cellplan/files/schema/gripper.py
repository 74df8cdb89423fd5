"""Gripper of a URDF as written in a cell file: how far it is open, and which bodies may work on the part."""

from typing import Annotated, Final, Self

from pydantic import model_validator

from cellplan.model.settings.entry import Entry, Text, require_unique, rule, setting
from cellplan.model.settings.units import Deg, Mm, Within

FINGER_LIMIT: Final = 2  # joints that open a gripper together
WIDEST_MM: Final = 10_000.0  # a wider opening is a wrong unit
LARGEST_ANGLE_DEG: Final = 720.0


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
