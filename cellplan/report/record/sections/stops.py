"""What happens when one robot stops, in printed units."""

from typing import Annotated, Final, TypedDict

from cellplan.model.report.report import Report
from cellplan.model.report.stops import StopInstant, StopReport
from cellplan.model.units import MM
from cellplan.report.record.common import Number, number

MS: Final = 1e3  # [ms/s]
FARTHEST: Final = 1e3  # [m] a distance that was not measured is beyond it


class StopInstantRecord(TypedDict):
    """When a figure of a stop is reached."""

    stopped: Annotated[str, "robot that stops"]
    going: Annotated[str, "robot that goes on"]
    at_s: Annotated[Number, "instant of the stop"]
    goes_on_ms: Annotated[Number, "time of its program that the other one has covered since"]


class StopDepthRecord(TypedDict):
    """Depth of a tool in the part."""

    depth_mm: Annotated[Number, "largest depth found"]
    worst: Annotated[StopInstantRecord | None, "when; null where the tool never enters the part"]


class StopDistanceRecord(TypedDict):
    """Distance of two robots, and of the part that one of them carries; tools at work on the part left out."""

    robots: Annotated[list[str], "the two"]
    distance_mm: Annotated[Number, "smallest distance measured; 0 where they touch; null where none was measured"]
    proved_mm: Annotated[Number, "distance that is proved to be kept; null without bodies that must keep one"]
    bodies: Annotated[list[str] | None, "nearest bodies; null where none were measured"]
    worst: Annotated[StopInstantRecord | None, "when; null likewise"]


class StopGripRecord(TypedDict):
    """Distance of a further holder's tool from its grasp."""

    distance_mm: Annotated[Number, "largest distance found: the part, or a robot, must give way by as much"]
    worst: Annotated[StopInstantRecord | None, "when; null where it never leaves its grasp"]


class StopsRecord(TypedDict):
    """What happens at worst when any one robot stops at once, at any instant, and the others go on and brake."""

    goes_on_ms: Annotated[dict[str, Number], "time of its program that each robot covers after another one stopped"]
    depths: Annotated[dict[str, StopDepthRecord], "by task on a part that another robot carries"]
    distances: Annotated[list[StopDistanceRecord], "by pair of robots"]
    grips: Annotated[dict[str, StopGripRecord], "by further holder"]


class StopsKey(TypedDict, total=False):
    """Only of a cell whose controllers state how their robots go on."""

    stops: Annotated[StopsRecord, "what happens when one robot stops; only if a controller states reaction or braking"]


def stops_record(report: Report) -> StopsKey:
    """The stops of a run, under their key; nothing where they were not evaluated."""
    return {} if report.stops is None else {"stops": _record(report.stops)}


def _record(stops: StopReport) -> StopsRecord:
    return {
        "goes_on_ms": {robot: number(MS * time) for robot, time in stops.runs_on.items()},
        "depths": {
            depth.task: {"depth_mm": number(MM * depth.depth), "worst": _instant(depth.worst)} for depth in stops.depths
        },
        "distances": [
            {
                "robots": list(distance.robots),
                "distance_mm": _distance(distance.distance),
                "proved_mm": _distance(distance.proved),
                "bodies": None if distance.bodies is None else list(distance.bodies),
                "worst": _instant(distance.worst),
            }
            for distance in stops.distances
        ],
        "grips": {
            grip.robot: {"distance_mm": number(MM * grip.distance), "worst": _instant(grip.worst)}
            for grip in stops.grips
        },
    }


def _distance(distance: float) -> Number:
    return number(MM * distance) if distance < FARTHEST else None


def _instant(instant: StopInstant | None) -> StopInstantRecord | None:
    if instant is None:
        return None
    return {
        "stopped": instant.stopped,
        "going": instant.going,
        "at_s": number(instant.at_s),
        "goes_on_ms": number(MS * (instant.path_s - instant.at_s)),
    }
