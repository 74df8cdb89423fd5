"""Accelerations in a cell file: stated limits only, an assumption for the other joints, or none with a reason."""

from typing import Annotated, ClassVar, Final, Literal

from pydantic import Field, Tag

from cellplan.model.settings.entry import OneOf, Reason, by_kind, setting
from cellplan.model.settings.units import Ms, Within

AXES: Final = 64  # joints of one robot
SECONDS_WORDS: Final = "a number of seconds or a list of them"
RULE_WORDS: Final = "stated, unlimited, {full_speed_in_s: …} or {unlimited: reason}"

SpeedUpTime = Annotated[float, Field(ge=0.001, le=1000.0)]  # [s]
CycleTime = Annotated[Ms, Within(ge=0.1, le=1000.0)]
SpeedUpTimes = Annotated[
    Annotated[SpeedUpTime, Tag("<number>")]
    | Annotated[tuple[SpeedUpTime, ...], Field(min_length=1, max_length=AXES), Tag("<list>")],
    by_kind(SECONDS_WORDS, number=(int, float), list=tuple),
]


class AccelerationRuleEntry(OneOf):
    """What is taken for the accelerations that joints reach."""

    alternatives: ClassVar[tuple[str, ...]] = ("full_speed_in_s", "unlimited")

    full_speed_in_s: SpeedUpTimes | None = setting(
        None,
        "Time in which a joint without a stated limit is taken to reach its top speed: one for all joints, or a list "
        "along the chain whose last entry counts for all further joints.",
    )
    unlimited: Reason | None = setting(None, "Accelerations and jerk are reported and not judged; the reason why.")


AccelerationChoice = Annotated[
    Annotated[Literal["stated", "unlimited"], Tag(f"<{RULE_WORDS}>")]
    | Annotated[AccelerationRuleEntry, Tag("<mapping>")],
    by_kind(RULE_WORDS, mapping=dict),
]
