"""What happens to a motion: joints that fail."""

from typing import Annotated

from pydantic import Field

from cellplan.model.settings.entry import Entry, Name, Text, setting
from cellplan.model.settings.task import LONGEST_S


class LockedJointEntry(Entry):
    """A joint that fails during the motion."""

    robot: Name = Field(description="Robot of the joint.")
    joint: Text = Field(description="Joint that is locked.")
    from_s: Annotated[float, Field(ge=0.0, le=LONGEST_S)] = setting(0.0, "Time from which on it is locked.")
