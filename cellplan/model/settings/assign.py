"""Assignment: what a search chooses of who does which task, in which order, at which pose of the part."""

from typing import Annotated, Final, Literal

from pydantic import Field, Tag

from cellplan.model.settings.entry import Entry, by_kind, setting
from cellplan.model.settings.units import Deg, Mm, Within

STATION_LIMIT: Final = 40  # poses of the part in use
POSTURE_LIMIT: Final = 1000  # that are compared
WIDEST_CONFLICT_MM: Final = 1000.0
STATION_WORDS: Final = (
    "a list of configurations or a mapping of joints (tilt_deg, rail_mm) or angles of the part (yaw_deg) to "
    "[first, last, step]"
)

StationChoice = Annotated[
    Annotated[tuple[tuple[float, ...], ...], Field(min_length=1, max_length=POSTURE_LIMIT), Tag("<list>")]
    | Annotated[dict[str, tuple[float, float, float]], Field(min_length=1), Tag("<mapping>")],
    by_kind(STATION_WORDS, list=tuple, mapping=dict),
]
FreeWord = Literal["direction", "start", "spin", "station"]


class AssignEntry(Entry):
    """What ``cellplan assign`` chooses beside the robots of tasks that are open, and the order of all."""

    stations: StationChoice | None = setting(
        None,
        "Poses of the part that are compared, as configurations of its first holder: a list of them, one value per "
        "joint, or a grid of its joints, [first, last, step] for each key (tilt_deg, rail_mm); a joint without a key "
        "stays at its start. Instead of joints the grid may have the pose of the part in the world: roll_deg, "
        "pitch_deg and yaw_deg, zero without a key, and x_mm, y_mm and z_mm, those at the start of the holder without "
        "a key; the configuration nearest to the start is taken, poses out of reach are left out. When absent those "
        "that the tasks and the start of the holder give.",
    )
    free: tuple[FreeWord, ...] = setting(
        ("direction", "start", "spin", "station"),
        "What may be chosen anew for every task: the direction of an open polyline whose tool stands across it, or is "
        "mirrored across it for the way back, the start of a circle, rectangle or rhombus without start_at, and of a "
        "closed polyline without rounded corners, the turn of the tool about its axis, the pose of the part.",
    )
    spin_step_deg: Annotated[Deg, Within(ge=5.0, le=360.0)] = setting(
        Deg(60.0), "Step of the turns of the tool about its axis that are compared."
    )
    most_stations: Annotated[int, Field(ge=1, le=STATION_LIMIT)] = setting(
        8, "Number of poses of the part that are in use at most."
    )
    conflict_mm: Annotated[Mm, Within(ge=0.0, le=WIDEST_CONFLICT_MM)] = setting(
        Mm(50.0), "Robots that would come nearer to each other than that are not at work together."
    )
    groups: bool = setting(
        False,
        "Whether the part may move while tasks are done whose paths run round the axis of the last joint of its "
        "holder, equally fast: arcs and rings. Only with the mode semi_coordinated and times as written.",
    )
