"""Kinds of checks: what each is called, how grave its failure is, and what helps against it; the list of all."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, auto
from types import MappingProxyType
from typing import Final


class Excess(Enum):
    """How far a failed check is from passing: what a check is compared by with others of its kind."""

    SHARE = auto()  # value by limit
    DISTANCE = auto()  # from the value to the limit
    VALUE = auto()  # the value itself


class Concern(Enum):
    """What a check is about, for whoever searches a remedy."""

    JOINT_LIMIT = auto()
    DISTANCE = auto()  # what is too near
    TOOL_ERROR = auto()
    OTHER = auto()


@dataclass(frozen=True, slots=True)
class CheckKind:
    """What a check is."""

    name: str  # in records
    holds: str  # title where it passes
    fails: str  # title where it fails
    group: str = ""  # heading of its failures on the terminal, where it is not the words of the name
    excess: Excess = Excess.SHARE  # what the worst of several is found by
    concern: Concern = Concern.OTHER  # what it is about
    # a motion ``share ** time_exponent`` times as long passes, for a value ``share`` times the limit; None where a
    # slower motion does not help
    time_exponent: float | None = None
    shrinks_with_step: bool = False  # whether its value shrinks with the square of the time between rows

    @property
    def heading(self) -> str:
        """Heading of its failures on the terminal."""
        return self.group or self.name.replace("_", " ")

    def severity(self, value: float, limit: float) -> float:
        """Grows with the excess of a failed check over others of its kind."""
        match self.excess:
            case Excess.VALUE:
                return value
            case Excess.DISTANCE:
                return abs(value - limit)
            case Excess.SHARE:
                return abs(value / limit) if limit else abs(value)

    def more_time(self, value: float, limit: float) -> float:
        """How many times as long a motion must last to pass; 1 where that does not help, or nothing may move."""
        return (value / limit) ** self.time_exponent if self.time_exponent is not None and limit else 1.0


LIMIT: Final = Concern.JOINT_LIMIT
NEAR: Final = Concern.DISTANCE
TOOL: Final = Concern.TOOL_ERROR
VALUE, DISTANCE = Excess.VALUE, Excess.DISTANCE
# fmt: off
_LISTED: Final = (  # the gravest first
    CheckKind("start_collision", "no collision at the start", "Collision at the start", group="collisions at the start"),
    CheckKind("start_trial", "motion from the chosen start without fault on trial", "Motion from the chosen start", group="trials of the start"),
    CheckKind("begin", "tables begin where the cell has stopped", "Tables begin elsewhere"),
    CheckKind("standing", "robots without a part in a phase at rest in it", "Robot moves that stands"),
    CheckKind("collision", "no collision", "Collision", group="collisions", excess=VALUE, concern=NEAR),
    CheckKind("grip_depth", "depth of holders in the part within the depth of their grip", "Holder too deep in the part"),
    CheckKind("mount_depth", "depth of tools in the arm within the depth of their mounting", "Tool too deep in the arm"),
    CheckKind("standing_depth", "depth of mounted bodies in their supports within its limit", "Body too deep in its support"),
    CheckKind("tool_depth", "tool depth in the part within its limit", "Tool too deep in the part", concern=NEAR),
    CheckKind("standoff", "tool tips at their distance from the part", "Tool tip off the part", excess=DISTANCE),
    CheckKind("seam_distance", "tips of rods at their seams", "Tip too far from its seam", excess=DISTANCE),
    CheckKind("wall_distance", "tools clear of the walls of seams", "Tool too near a wall", excess=DISTANCE, concern=NEAR),
    CheckKind("torch_angle", "tools within their angle from gravity", "Tool leans too far from gravity"),
    CheckKind("weld_slope", "slopes of welds within their limits", "Weld slopes too much", excess=DISTANCE),
    CheckKind("weld_rotation", "rotations of welds within their limits", "Weld face turned too far", excess=DISTANCE),
    CheckKind("same_robot", "tasks of one robot done by one", "Tasks of one robot done by several"),
    CheckKind("together", "paths that begin together do", "Paths begin apart", excess=DISTANCE),
    CheckKind("task_order", "tasks in their demanded order", "Task begins too early", excess=DISTANCE),
    CheckKind("arc_distance", "tips of tools at work keep their distance", "Arcs too near", group="distances of arcs", excess=DISTANCE),
    CheckKind("rest", "the part cools between tasks for its time", "Rest too short", group="rests between tasks", excess=DISTANCE),
    CheckKind("stop_depth", "tool depth in the part within its limit where a robot stops", "Tool too deep in the part where a robot stops"),
    CheckKind("joint_position", "joint positions within their limits", "Joint beyond its limit", group="joint limits", excess=DISTANCE, concern=LIMIT),
    CheckKind("controller_position", "positions that controllers show within their limits", "Shown position beyond its limit", group="joint limits", excess=DISTANCE, concern=LIMIT),
    CheckKind("joint_sum", "sums of joint angles within their ranges", "Sum of joint angles beyond its range", excess=DISTANCE),
    CheckKind("joint_margin", "joints keep the demanded margin", "Joint too near its limit", excess=DISTANCE, concern=LIMIT),
    CheckKind("via_point", "via points passed", "Via point missed"),
    CheckKind("service", "tools cleaned in time and long enough", "Tool cleaned too late or too shortly"),
    CheckKind("locked_joint", "failed joints at rest", "Failed joint moves"),
    CheckKind("home", "idle robots at their homes", "Idle robot leaves its home"),
    CheckKind("payload", "tool and part within the payload", "Payload exceeded"),
    CheckKind("payload_centre", "centre of mass of the load within its limits", "Centre of mass of the load"),
    CheckKind("payload_moment", "moments of the load on the wrist within their limits", "Moment of the load"),
    CheckKind("payload_inertia", "inertia of the load on the wrist within its limits", "Inertia of the load"),
    CheckKind("process_moment", "moments of load and process on the wrist within their limits", "Moment of load and process"),
    CheckKind("grip_slip", "friction of grips holds the part", "Grip does not hold the part", group="grips"),
    CheckKind("coming_apart", "pairs that begin too near only come apart", "Pair does not come apart", excess=DISTANCE),
    CheckKind("clearance", "required clearance kept", "Clearance too small", excess=DISTANCE, concern=NEAR),
    CheckKind("stop_clearance", "required clearance kept where a robot stops", "Clearance too small where a robot stops", excess=DISTANCE),
    CheckKind("joint_velocity", "joint velocities within their limits", "Joint too fast", group="joint speeds", concern=LIMIT, time_exponent=1.0),
    CheckKind("joint_acceleration", "joint accelerations within their limits", "Joint acceleration too high", group="joint accelerations", concern=LIMIT, time_exponent=0.5),
    CheckKind("joint_torque", "torques of the drives within their limits", "Torque of a drive too large"),
    CheckKind("joint_acceleration_between_phases", "joint accelerations where phases meet within their limits", "Joint acceleration too high where phases meet", concern=LIMIT, time_exponent=0.5),
    CheckKind("joint_acceleration_assumed", "joint accelerations within assumed limits", "Joint acceleration above its assumed limit", group="joint accelerations", concern=LIMIT, time_exponent=0.5),
    CheckKind("joint_jerk", "joint jerk within its limits", "Joint jerk too high", concern=LIMIT, time_exponent=1 / 3),
    CheckKind("part_acceleration", "acceleration of the part within its limit", "Acceleration of the part too high", time_exponent=0.5),
    CheckKind("tool_speed", "speed of the tools within its limit", "Tool too fast", time_exponent=1.0),
    CheckKind("transfer_joint_speed", "joint speeds in transfer moves within their limit", "Joint too fast in a transfer move"),
    CheckKind("transfer_speed", "speeds in transfer moves within their limit", "Too fast in a transfer move"),
    CheckKind("closure_position_error", "tools of co-holders on their grasps", "Co-holder off its grasp"),
    CheckKind("closure_orientation_error", "orientation of co-holders' tools", "Co-holder tilted on its grasp"),
    CheckKind("closure_position_error_between_rows", "tools of co-holders on their grasps between the rows", "Co-holder off its grasp between the rows", time_exponent=0.5, shrinks_with_step=True),
    CheckKind("closure_orientation_error_between_rows", "orientation of co-holders' tools between the rows", "Co-holder tilted on its grasp between the rows", time_exponent=0.5, shrinks_with_step=True),
    CheckKind("position_error", "tool position on the part within tolerance", "Tool off its path", group="tool errors", concern=TOOL),
    CheckKind("orientation_error", "tool orientation on the part within tolerance", "Tool orientation off", group="tool errors", concern=TOOL),
    CheckKind("position_error_between_rows", "tool position within tolerance between the rows", "Tool off its path between the rows", group="tool errors", concern=TOOL, time_exponent=0.5, shrinks_with_step=True),
    CheckKind("orientation_error_between_rows", "tool orientation within tolerance between the rows", "Tool orientation off between the rows", group="tool errors", concern=TOOL, time_exponent=0.5, shrinks_with_step=True),
    CheckKind("listed_position_error", "tool position within tolerance of the points of its file", "Tool off the path of its file", group="tool errors"),
    CheckKind("listed_orientation_error", "tool orientation within tolerance of the axes of its file", "Tool orientation off the axes of its file", group="tool errors"),
    CheckKind("listed_depth", "tool tips not farther into the part than their files allow", "Tool too far into the part against its file", excess=DISTANCE),
    CheckKind("true_position_error", "true position errors within tolerance", "True position error too large"),
    CheckKind("true_orientation_error", "true orientation errors within tolerance", "True orientation error too large"),
    CheckKind("process_feed", "demanded feeds within their tolerances", "Feed not kept"),
    CheckKind("process_on_delay", "delays of processes at the start of their paths", "Delay at the start of a process"),
    CheckKind("process_off_delay", "delays of processes at the end of their paths", "Delay at the end of a process"),
    CheckKind("joint_drift", "joints return after each cycle", "Joints do not return"),
)
# fmt: on
CHECK_KINDS: Final[Mapping[str, CheckKind]] = MappingProxyType({kind.name: kind for kind in _LISTED})
GRAVITY: Final[Mapping[str, int]] = {name: place for place, name in enumerate(CHECK_KINDS)}  # 0: the gravest
JOINT_LIMITS: Final = frozenset(kind.name for kind in _LISTED if kind.concern is LIMIT)
TOOL_ERRORS: Final = frozenset(kind.name for kind in _LISTED if kind.concern is TOOL)
DISTANCES: Final = frozenset(kind.name for kind in _LISTED if kind.concern is NEAR)
PASSED_BY_TIME: Final = frozenset(kind.name for kind in _LISTED if kind.time_exponent is not None)
PASSED_BY_STEP: Final = frozenset(kind.name for kind in _LISTED if kind.shrinks_with_step)
