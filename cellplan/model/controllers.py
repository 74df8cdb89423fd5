"""Controllers of a cell: which one moves which robots, how far their clocks agree, and how they stop."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum


class ControllerKind(StrEnum):
    """Makers whose programs differ."""

    ABB = "abb"
    FANUC = "fanuc"
    KUKA = "kuka"
    REIS = "reis"
    ROS = "ros"
    STAUBLI = "staubli"
    UR = "ur"
    YASKAWA = "yaskawa"
    OTHER = "other"


@dataclass(frozen=True, slots=True, kw_only=True)
class Controller:
    """One controller of a cell; robots on different controllers share no clock.

    Attributes:
        name: Name in the cell.
        kind: Whose it is.
        tasks: Mechanical unit of each of its tasks, by the name of the task: ``T_ROB1: ROB_1``.
        latency: Time in [s] by which a robot follows what is sent to it; None when it is not stated.
        skew: Largest difference in [s] between its clock and those of the other controllers; None when not stated.
        reaction: Time in [s] for which its robots go on after a robot of another controller stopped; None likewise.
        brake: Time in [s] in which its robots then brake on their path; None likewise.
    """

    name: str
    kind: ControllerKind
    tasks: Mapping[str, str] = field(default_factory=dict)
    latency: float | None = None
    skew: float | None = None
    reaction: float | None = None
    brake: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Handshake:
    """Signals with which a robot waits for others at a mark, as its controller names them.

    Attributes:
        output: The output that it sets: a number, or a name.
        inputs: The inputs that it reads, by the name of the robot that sets them.
    """

    output: str
    inputs: Mapping[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotControl:
    """Where a robot is connected, and how programs of its controller name things.

    Attributes:
        controller: Name of its controller in the cell.
        task: Name of its task there (ABB); None when it is not stated.
        group: Number of its motion group there, from 1 (Fanuc, Yaskawa); None likewise.
        decimals: Of a degree or millimetre in programs of its controller's own language; None for those of the format.
        cycle: Cycle in [s] at which its controller takes positions; None for that of ``Robot.controller_cycle``.
        tool_number: Number of its tool on the controller; None for tool 0, or for the tool data of the cell.
        base_number: Number of its base frame on the controller; None for the base of the robot itself.
        handshake: Its signals; None when none are stated.
    """

    controller: str
    task: str | None = None
    group: int | None = None
    decimals: int | None = None
    cycle: float | None = None
    tool_number: int | None = None
    base_number: int | None = None
    handshake: Handshake | None = None
