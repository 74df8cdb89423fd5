"""Accelerations of a cell file: the rule of each robot, its own or the cell's, and what contradicts its joints."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from cellplan.files.input.findings import Finding, KeyPath, key_text, listed
from cellplan.files.schema.cell import CellDocument
from cellplan.files.schema.partial import ValidEntries
from cellplan.files.schema.robot import RobotEntry
from cellplan.files.yaml.reader import YamlDocument
from cellplan.model.cell.acceleration import USUAL_ACCELERATION, AccelerationRule
from cellplan.model.cell.cell import Robot
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.acceleration import AccelerationChoice, AccelerationRuleEntry


def acceleration_rule(entry: RobotEntry, cell: AccelerationChoice | None, *, joints: int) -> AccelerationRule:
    """The rule of one robot of so many joints: its own, else the cell's, else the usual assumption."""
    rule = _chosen(cell if entry.acceleration is None else entry.acceleration)
    return replace(rule, full_speed_in=rule.full_speed_in[:joints])


def _chosen(choice: AccelerationChoice | None) -> AccelerationRule:
    if choice is None:
        return USUAL_ACCELERATION
    if isinstance(choice, AccelerationRuleEntry):
        if choice.unlimited is not None:
            return AccelerationRule(full_speed_in=(), is_unlimited=True, reason=choice.unlimited)
        seconds = choice.full_speed_in_s
        return AccelerationRule(full_speed_in=seconds if isinstance(seconds, tuple) else (float(seconds or 0.0),))
    return AccelerationRule(full_speed_in=(), is_unlimited=choice == "unlimited")


def controller_cycle(entry: RobotEntry, document: CellDocument) -> float:
    """Cycle of a robot's controller in [s]: as the robot states it, at either key, else that of the motion."""
    cycle = entry.controller_cycle_ms
    if cycle is None and entry.controller is not None:
        cycle = entry.controller.cycle_ms
    return (document.motion.controller_cycle_ms if cycle is None else cycle).si


def written_rule(robot: Robot) -> Any:
    """The rule of a robot as a value of a cell file."""
    rule = robot.acceleration
    if rule.is_unlimited:
        return {"unlimited": rule.reason} if rule.reason else "unlimited"
    return {"full_speed_in_s": list(rule.full_speed_in)} if rule.full_speed_in else "stated"


def acceleration_findings(
    valid: ValidEntries, models: Mapping[str, RobotModel], document: YamlDocument
) -> Iterator[Finding]:
    """Rules that do not fit a robot: stated limits that are missing or would not count, more times than joints."""
    for name, model in models.items():
        entry = valid.robots[name]
        choice = valid.acceleration if entry.acceleration is None else entry.acceleration
        path: KeyPath = ("acceleration",) if entry.acceleration is None else ("robots", name, "acceleration")
        missing = [joint for joint in model.joints if joint.acceleration is None]
        if choice == "stated" and missing:
            key = f"acceleration_{'deg' if missing[0].is_revolute else 'mm'}_s2"
            text = (
                f"expected a stated limit for every joint of '{name}', got none for "
                f"{listed(joint.name for joint in missing)}; give robots.{name}.limits: "
                f"{{{missing[0].name}: {{{key}: …}}}}, or acceleration: {{full_speed_in_s: …}}"
            )
            yield document.finding(path, text)
        if _chosen(choice).is_unlimited:
            yield from _unjudged_limits(name, entry, document, where=key_text(path))
        if entry.acceleration is not None:
            words = f"joint ({listed(model.joint_names)})"
            yield from _too_many_times(choice, len(model.joints), document, path=path, words=words)
    following = [len(model.joints) for name, model in models.items() if valid.robots[name].acceleration is None]
    if following:
        words = "joint of the longest arm that it counts for"
        yield from _too_many_times(valid.acceleration, max(following), document, path=("acceleration",), words=words)


def _unjudged_limits(robot: str, entry: RobotEntry, document: YamlDocument, *, where: str) -> Iterator[Finding]:
    """Limits of accelerations and jerk in the cell itself, which `unlimited` would leave unjudged."""
    for joint, limits in entry.limits.items():
        for key, value in limits.model_dump(exclude_none=True).items():
            if key.startswith(("acceleration_", "jerk_")):
                text = (
                    f"expected no limit, as {where} is unlimited and nothing is judged against it, got {value:g}; "
                    f"remove it, or give robots.{robot}.acceleration: {{full_speed_in_s: …}}"
                )
                yield document.finding(("robots", robot, "limits", joint, key), text)


def _too_many_times(
    choice: AccelerationChoice | None, joints: int, document: YamlDocument, *, path: KeyPath, words: str
) -> Iterator[Finding]:
    """A list of times that is longer than the arm has joints."""
    times = choice.full_speed_in_s if isinstance(choice, AccelerationRuleEntry) else None
    if isinstance(times, tuple) and len(times) > joints:
        text = f"expected at most {joints} times, one per {words}, got {len(times)}"
        yield document.finding((*path, "full_speed_in_s"), text)
