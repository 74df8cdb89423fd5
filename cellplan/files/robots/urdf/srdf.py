"""SRDF of a robot: pairs of its links that need not be checked against each other, and named configurations."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cellplan.errors import InputError
from cellplan.files.input.findings import listed, shown
from cellplan.files.robots.urdf import XACRO_SUFFIX
from cellplan.files.robots.urdf.document.xacro import XacroSettings, read_elements
from cellplan.files.robots.urdf.document.xml import Element, Remarks
from cellplan.geometry.transforms import Array
from cellplan.model.robot.robot import RobotModel


@dataclass(frozen=True, slots=True, kw_only=True)
class DisabledPair:
    """Two links that the file leaves out of collision checks, and its word for why."""

    links: tuple[str, str]
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NamedConfiguration:
    """A state of a group: its joints by name, as elements of the file."""

    name: str
    group: str
    element: Element
    joints: Mapping[str, Element]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Srdf:
    """What is used of an SRDF."""

    file: str  # name in messages
    pairs: tuple[DisabledPair, ...]  # pairs of links that are disabled
    configurations: tuple[NamedConfiguration, ...]
    included: tuple[Path, ...] = ()  # files that a xacro file includes, each once
    remarks: tuple[str, ...] = ()  # what was not read, one line for each kind

    @property
    def configuration_names(self) -> tuple[str, ...]:
        """Names by which configurations can be called: ``STATE``, and ``GROUP/STATE`` where several groups have it."""
        names = [configuration.name for configuration in self.configurations]
        return tuple(
            configuration.name
            if names.count(configuration.name) == 1
            else f"{configuration.group}/{configuration.name}"
            for configuration in self.configurations
        )


def read_srdf(path: Path, settings: XacroSettings | None = None) -> Srdf:
    """Read disabled pairs and named configurations of an SRDF; groups, end effectors and the like are not used.

    A file called ``.xacro`` is expanded. An ``InputError`` has file and line.
    """
    remarks = Remarks()
    root, included = read_elements(path, settings, remarks)
    if root.tag != "robot":
        raise root.error(f"expected an SRDF, whose root element is <robot>, got <{root.tag}>")
    link = next((child for child in root.children if child.tag == "link"), None)
    if link is not None:
        raise link.error("expected an SRDF, got a URDF, with <link>")
    macro = next((child for child in root.children if child.tag.startswith("xacro:")), None)
    if macro is not None:
        raise macro.error(f"expected a plain SRDF, got <{macro.tag}>: let its name end in {XACRO_SUFFIX}")
    pairs = tuple(
        DisabledPair(
            links=(pair.text("link1", pair.tag), pair.text("link2", pair.tag)),
            reason=pair.attributes.get("reason", "").strip(),
        )
        for pair in root.all("disable_collisions")
    )
    configurations = tuple(map(_configuration, root.all("group_state")))
    if included is not None and not pairs and not configurations:
        remarks.add("empty", f"{path.name}: has no pairs and no configurations: is it a file of macros for others?")
    return Srdf(
        file=path.name, pairs=pairs, configurations=configurations, included=included or (), remarks=remarks.lines
    )


def disabled_bodies(srdf: Srdf, model: RobotModel) -> tuple[tuple[str, str, str], ...]:
    """The pairs of link bodies of a robot that its SRDF disables, each with the reason as reports show it.

    Pairs with a link that the robot does not have, such as one of a gripper that it does not carry, say nothing.

    ``InputError`` where the robot has none of the links: the file is another robot's.
    """
    links = {link.name for link in model.links}
    named = {link for pair in srdf.pairs for link in pair.links}
    if named and not named & links:
        raise InputError(f"{srdf.file}: expected the SRDF of '{model.name}', got one none of whose links it has")
    bodies = []
    for pair in srdf.pairs:
        if pair.links[0] == pair.links[1]:
            continue
        first, second = ([body.name for body in model.bodies if body.link_name == link] for link in pair.links)
        why = f"as {shown(pair.reason)}" if pair.reason else "without a reason"
        reason = f"disabled in {srdf.file} {why}"
        bodies += [(one, other, reason) for one in first for other in second]
    return tuple(bodies)


def unknown_links(srdf: Srdf, model: RobotModel) -> str | None:
    """Remark on disabled pairs that say nothing, as they name links that the robot does not have; None without any."""
    links = {link.name for link in model.links}
    pairs = [pair for pair in srdf.pairs if not set(pair.links) <= links]
    missing = dict.fromkeys(link for pair in pairs for link in pair.links if link not in links)
    if not pairs:
        return None
    return f"{srdf.file}: disabled pairs ({len(pairs)}) name links that '{model.name}' does not have: {listed(missing)}"


def configuration_of(srdf: Srdf, name: str, model: RobotModel, *, added: Collection[str] = ()) -> Array | None:
    """Joint positions of a named configuration in [rad] or [m], shape (n,); None when there is none of this name.

    Where several groups have a state of the name, those that lack joints of the chain to the flange are passed over.

    Args:
        name: ``STATE`` or ``GROUP/STATE``.
        added: Joints that are not the file's, such as a rail below the robot: at zero, or at the nearest limit.

    Raises:
        InputError: Joints are missing, several groups differ, or a value is no number or outside the joint's limits.
    """
    named = [
        configuration
        for configuration in srdf.configurations
        if name in (configuration.name, f"{configuration.group}/{configuration.name}")
    ]
    if not named:
        return None
    driven = [joint for joint in model.joint_names if joint not in added]
    complete = [entry for entry in named if set(driven) <= set(entry.joints)]
    if not complete:
        missing = [joint for joint in driven if joint not in named[0].joints]
        text = f"expected a value of every joint between base and flange, missing: {listed(missing)}"
        raise named[0].element.error(f"group_state '{name}': {text}")
    positions = [_positions(configuration, model, added) for configuration in complete]
    if any(not np.array_equal(q, positions[0]) for q in positions):
        names = listed(f"{configuration.group}/{configuration.name}" for configuration in complete)
        raise complete[1].element.error(f"group_state '{name}': expected one configuration of this name, got {names}")
    return positions[0]


def _configuration(state: Element) -> NamedConfiguration:
    name = state.text("name", "group_state")
    joints: dict[str, Element] = {}
    for joint in state.all("joint"):
        key = joint.text("name", f"group_state '{name}'")
        if key in joints:
            raise joint.error(f"group_state '{name}': expected each joint once, got '{key}' twice")
        joints[key] = joint
    return NamedConfiguration(name=name, group=state.attributes.get("group", ""), element=state, joints=joints)


def _positions(configuration: NamedConfiguration, model: RobotModel, added: Collection[str]) -> Array:
    """Values of the joints of the chain, within their limits."""
    values: Array = np.clip(np.zeros(len(model.joints)), model.lower, model.upper)
    for index, joint in enumerate(model.joints):
        if joint.name in added:
            continue
        element, owner = configuration.joints[joint.name], f"group_state '{configuration.name}': joint '{joint.name}'"
        values[index] = element.number("value", owner)
        if not joint.lower <= values[index] <= joint.upper:
            unit = "rad" if joint.is_revolute else "m"
            allowed = f"expected a value from {joint.lower:.9g} to {joint.upper:.9g} {unit}"
            raise element.error(f"{owner}: {allowed}, its limits here, got {values[index]:.9g}")
    return values
