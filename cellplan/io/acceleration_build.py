"""Accelerations of a cell file: the rule of each robot, its own or the cell's, and what contradicts its joints."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, Final

from cellplan.io.complaints import Complaint, KeyPath, listed
from cellplan.io.schema.acceleration import AccelerationChoice, AccelerationRuleEntry
from cellplan.io.schema.cell import CellDocument
from cellplan.io.schema.pieces import Pieces
from cellplan.io.schema.robot import RobotEntry
from cellplan.io.yaml_reader import YamlDocument
from cellplan.model.acceleration import USUAL_ACCELERATION, AccelerationRule
from cellplan.model.cell import Robot
from cellplan.model.robot import RobotModel

MS: Final = 1000.0  # [ms/s]


def acceleration_rule(entry: RobotEntry, cell: AccelerationChoice | None, *, joints: int) -> AccelerationRule:
    """The rule of one robot of so many joints: its own, else the cell's, else the usual assumption."""
    rule = _chosen(cell if entry.acceleration is None else entry.acceleration)
    return replace(rule, full_speed_in=rule.full_speed_in[:joints])


def _chosen(choice: AccelerationChoice | None) -> AccelerationRule:
    """The rule that an entry asks for."""
    if choice is None:
        return USUAL_ACCELERATION
    if isinstance(choice, AccelerationRuleEntry):
        if choice.unlimited is not None:
            return AccelerationRule(full_speed_in=(), is_unlimited=True, reason=choice.unlimited)
        seconds = choice.full_speed_in_s
        return AccelerationRule(full_speed_in=seconds if isinstance(seconds, tuple) else (float(seconds or 0.0),))
    return AccelerationRule(full_speed_in=(), is_unlimited=choice == "unlimited")


def controller_cycle(entry: RobotEntry, document: CellDocument) -> float:
    """Cycle of a robot's controller in [s]."""
    own = entry.controller_cycle_ms
    return (document.motion.controller_cycle_ms if own is None else own) / MS


def written_rule(robot: Robot) -> Any:
    """The rule of a robot in the words of a cell file."""
    rule = robot.acceleration
    if rule.is_unlimited:
        return {"unlimited": rule.reason} if rule.reason else "unlimited"
    return {"full_speed_in_s": list(rule.full_speed_in)} if rule.full_speed_in else "stated"


def acceleration_complaints(
    pieces: Pieces, models: Mapping[str, RobotModel], document: YamlDocument
) -> Iterator[Complaint]:
    """Rules that do not fit a robot: no limit stated where only stated ones count, more times than joints."""
    for name, model in models.items():
        entry = pieces.robots[name]
        choice = pieces.acceleration if entry.acceleration is None else entry.acceleration
        path: KeyPath = ("acceleration",) if entry.acceleration is None else ("robots", name, "acceleration")
        missing = [joint for joint in model.joints if joint.acceleration is None]
        if choice == "stated" and missing:
            key = f"acceleration_{'deg' if missing[0].is_revolute else 'mm'}_s2"
            text = (
                f"expected a stated limit for every joint of '{name}', got none for "
                f"{listed(joint.name for joint in missing)}; give robots.{name}.limits: "
                f"{{{missing[0].name}: {{{key}: …}}}}, or acceleration: {{full_speed_in_s: …}}"
            )
            yield document.complaint(path, text)
        own = entry.acceleration
        times = own.full_speed_in_s if isinstance(own, AccelerationRuleEntry) else None
        if isinstance(times, tuple) and len(times) > len(model.joints):
            count = len(model.joints)
            text = f"expected at most {count} times, one per joint ({listed(model.joint_names)}), got {len(times)}"
            yield document.complaint((*path, "full_speed_in_s"), text)
