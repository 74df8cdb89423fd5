"""Controllers of a cell file: what becomes of their entries, and what contradicts robots or other controllers."""

import re
from collections.abc import Iterator, Mapping
from typing import Final

from cellplan.files.input.findings import Finding, KeyPath, key_text, listed, unknown_name
from cellplan.files.schema.partial import ValidEntries
from cellplan.files.schema.robot import RobotEntry
from cellplan.files.yaml.reader import YamlDocument
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.controllers import ControllerEntry, RobotControlEntry
from cellplan.model.settings.process_statements import read_statement
from cellplan.model.settings.units import Mm, si_or_none

ARM: Final = 6  # axes of an arm, the last ones of a robot with as many joints or more
EXTERNAL: Final = 6  # external axes that a row of these programs holds
OF_SIX_AXES: Final = frozenset({"abb", "kuka", "staubli"})
SIGNALS: Final = {"kuka": (1, 4096), "ur": (0, 7)}  # first and last number, by kinds whose signals are numbers
FRAMES: Final = {"kuka": 128}  # largest number of a tool or base, by kind
PART_FRAMES: Final = {**FRAMES, "fanuc": 9}  # likewise of a frame of the part
WITH_GROUPS: Final = ("fanuc", "yaskawa")
MOST_OUTPUTS: Final = 9999  # that a statement of a process can name
OUTPUT: Final = re.compile(
    r"(?:\$out\[|do\[|ot#\(|set_(?:standard_)?digital_out\()?0*(\w+)[\])]?"
)  # its name or number
Uses = dict[tuple[str, str, str], str]  # controller, what, name in lower case -> key path of the first use


def control_findings(
    valid: ValidEntries, models: Mapping[str, RobotModel], document: YamlDocument
) -> Iterator[Finding]:
    """Everything about controllers that contradicts a robot, or that two robots claim."""
    uses: Uses = {}
    yield from _process_outputs(valid, uses, document)
    for name, robot in valid.robots.items():
        path: KeyPath = ("robots", name, "controller")
        yield from _cycle(path, robot, document)
        control = robot.controller
        if control is None:
            continue
        yield from _handshake((*path, "handshake"), name, control, valid, document)
        yield from _used_twice(path, control, uses, document)
        if control.id not in valid.names["controllers"]:
            yield document.finding(
                (*path, "id"), unknown_name("a controller of this cell", control.id, valid.names["controllers"])
            )
        elif control.id in valid.controllers:
            entry = valid.controllers[control.id]
            yield from _of_kind(path, control, entry, document)
            yield from _signals((*path, "handshake"), control, entry, document)
            yield from _frames(path, control, entry, uses, document)
            if name in models:
                yield from _joints((*path, "id"), entry, models[name], document)
    yield from _tools(valid, document)
    yield from _process_data(valid, document)
    yield from _process_delays(valid, document)
    yield from _process_weaves(valid, document)
    yield from _without_robots(valid, document)
    yield from _stop(valid, document)


def _cycle(path: KeyPath, robot: RobotEntry, document: YamlDocument) -> Iterator[Finding]:
    """The cycle of a controller is stated once, or twice alike."""
    stated, cycle = robot.controller_cycle_ms, robot.controller.cycle_ms if robot.controller is not None else None
    if stated is not None and cycle is not None and stated.si != cycle.si:
        text = f"expected {stated:g}, as controller_cycle_ms says, got {cycle:g}; remove one of them"
        yield document.finding((*path, "cycle_ms"), text)


def _of_kind(
    path: KeyPath, control: RobotControlEntry, entry: ControllerEntry, document: YamlDocument
) -> Iterator[Finding]:
    if control.task is not None and entry.kind != "abb":
        text = f"unexpected key, it applies to kind abb only, and '{control.id}' is of kind {entry.kind}"
        yield document.key_finding((*path, "task"), text)
    elif control.task is not None and control.task not in entry.tasks:
        text = unknown_name(f"a task of controllers.{control.id}.tasks", control.task, entry.tasks)
        yield document.finding((*path, "task"), text)
    if control.group is not None and entry.kind not in WITH_GROUPS:
        text = (
            f"unexpected key, it applies to the kinds {' and '.join(WITH_GROUPS)} only, and '{control.id}' is of kind "
            f"{entry.kind}"
        )
        yield document.key_finding((*path, "group"), text)
    if control.machine is not None and entry.kind != "kuka":
        text = f"unexpected key, it applies to kind kuka only, and '{control.id}' is of kind {entry.kind}"
        yield document.key_finding((*path, "machine"), text)


def _joints(path: KeyPath, entry: ControllerEntry, model: RobotModel, document: YamlDocument) -> Iterator[Finding]:
    """Joints that a controller of this kind can move: an arm of six axes after some external ones."""
    count, turning = len(model.joints), sum(joint.is_revolute for joint in model.joints)
    if entry.kind == "ur" and not count == turning == ARM:
        text = f"expected a controller for {count} joints, {turning} of them revolute, got one of kind ur, which moves "
        yield document.finding(path, f"{text}exactly {ARM} revolute joints")
    if entry.kind in OF_SIX_AXES and count > ARM + EXTERNAL:
        text = f"expected a controller for {count} joints, got one of kind {entry.kind}, which moves at most "
        yield document.finding(path, f"{text}{ARM} axes of an arm and {EXTERNAL} external axes")


def _handshake(
    path: KeyPath, name: str, control: RobotControlEntry, valid: ValidEntries, document: YamlDocument
) -> Iterator[Finding]:
    """Inputs are set by other robots of the cell."""
    others = [robot for robot in valid.names["robots"] if robot != name]
    for robot in control.handshake.inputs if control.handshake is not None else ():
        if robot not in others:
            text = unknown_name("another robot of this cell", robot, others)
            yield document.key_finding((*path, "inputs", robot), text)


def _signals(
    path: KeyPath, control: RobotControlEntry, entry: ControllerEntry, document: YamlDocument
) -> Iterator[Finding]:
    """Signals are numbered, or named, as controllers of the kind do."""
    if control.handshake is None:
        return
    stated: list[tuple[KeyPath, str | int]] = [((*path, "output"), control.handshake.output)]
    stated += [((*path, "inputs", robot), signal) for robot, signal in control.handshake.inputs.items()]
    for place, signal in stated:
        if entry.kind in SIGNALS:
            first, last = SIGNALS[entry.kind]
            if not isinstance(signal, int) or not first <= signal <= last:
                text = f"expected a whole number from {first} to {last}, as controllers of kind {entry.kind} number "
                yield document.finding(place, f"{text}their signals, got {signal!r}")
        elif entry.kind == "abb" and isinstance(signal, int):
            text = f"expected a name, as controllers of kind abb name their signals, got {signal}"
            yield document.finding(place, text)


def _frames(
    path: KeyPath, control: RobotControlEntry, entry: ControllerEntry, uses: Uses, document: YamlDocument
) -> Iterator[Finding]:
    """Numbers of tools and bases that a controller of the kind has, and no frame of two robots on a Yaskawa one."""
    stated: list[tuple[KeyPath, int | None, int | None]] = [
        (("tool_number",), control.tool_number, FRAMES.get(entry.kind)),
        (("base_number",), control.base_number, FRAMES.get(entry.kind)),
    ]
    stated += [(("frames", at), number, PART_FRAMES.get(entry.kind)) for at, number in enumerate(control.frames)]
    for key, number, last in stated:
        if last is not None and number is not None and number > last:
            text = f"expected at most {last}, as many as controllers of kind {entry.kind} have, got {number}"
            yield document.finding((*path, *key), text)
    for at, number in enumerate(control.frames):
        if number in control.frames[:at]:
            yield document.finding((*path, "frames", at), f"expected each number once, got {number} twice")
        elif entry.kind == "yaskawa":
            yield from _claim((*path, "frames", at), (control.id, "user frame", str(number)), uses, document)


def _tools(valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """A Yaskawa controller has one tool of each number, whichever of its robots carries it."""
    first: dict[tuple[str, int], str] = {}
    for name, robot in valid.robots.items():
        control = robot.controller
        entry = None if control is None else valid.controllers.get(control.id)
        if control is None or entry is None or entry.kind != "yaskawa" or control.tool_number is None:
            continue
        other = first.setdefault((control.id, control.tool_number), name)
        if valid.robots[other].tool != robot.tool:
            text = f"expected another number than robots.{other}.controller.tool_number, whose tool differs and which "
            text += f"'{control.id}' has once, got {control.tool_number}"
            yield document.finding(("robots", name, "controller", "tool_number"), text)


def _used_twice(path: KeyPath, control: RobotControlEntry, uses: Uses, document: YamlDocument) -> Iterator[Finding]:
    """What a controller has once belongs to one robot: task, group, machine, output, input; an input to one sender."""
    numbers = (("task", control.task), ("group", control.group), ("machine", control.machine))
    claims: list[tuple[str, KeyPath, str]] = [(what, (what,), str(word)) for what, word in numbers if word is not None]
    if control.handshake is not None:
        claims.append(("output", ("handshake", "output"), str(control.handshake.output)))
        for robot, signal in control.handshake.inputs.items():
            claims.append(("input", ("handshake", "inputs", robot), str(signal)))
    for what, below, word in claims:
        yield from _claim((*path, *below), (control.id, what, word), uses, document)


def _claim(place: KeyPath, claim: tuple[str, str, str], uses: Uses, document: YamlDocument) -> Iterator[Finding]:
    """What a controller has once is claimed: controller, what, name."""
    controller, what, word = claim
    first = uses.setdefault((controller, what, word.lower()), key_text(place))
    if first != key_text(place):
        text = f"expected {_article(what)} that nothing else on '{controller}' uses, got '{word}', as {first} does"
        yield document.finding(place, text)


def _process_outputs(valid: ValidEntries, uses: Uses, document: YamlDocument) -> Iterator[Finding]:
    """Outputs of a process are those that a kind has; no handshake uses them."""
    for name, entry in valid.controllers.items():
        process, (first, last) = entry.process, SIGNALS.get(entry.kind, (1, MOST_OUTPUTS))
        for key, text in process.statements(on=True).items() if process is not None else ():
            read = read_statement(entry.kind, text, on=True)
            output = OUTPUT.fullmatch(read.words["name"]) if read is not None and read.switch.is_output else None
            if output is None:
                continue
            if output[1].isdigit() and not first <= int(output[1]) <= last:
                words = f"expected an output from {first} to {last}, as controllers of kind {entry.kind} number their "
                yield document.finding(("controllers", name, "process", "on"), f"{words}signals, got {text!r}")
            uses[name, "output", output[1]] = f"controllers.{name}.process.{key}"


def _article(noun: str) -> str:
    return f"an {noun}" if noun[0] in "aeio" else f"a {noun}"


def _process_data(valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """Data of a process are those of tasks of the cell, and every process of the controller's robots has some."""
    for name, entry in valid.controllers.items():
        if entry.process is None or not entry.process.data:
            continue
        path: KeyPath = ("controllers", name, "process", "data")
        for named in entry.process.data:
            if named not in valid.names["tasks"]:
                text = unknown_name("a task of this cell", named, valid.names["tasks"])
                yield document.key_finding((*path, named), text)
        for task in _in_process(name, valid):
            if task not in entry.process.data:
                yield document.key_finding(path, f"expected data of the task '{task}' too, got none")


def _process_delays(valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """A tool does not rest at an end of its path for an output that is switched ahead of it."""
    for name, entry in valid.controllers.items():
        for task in _in_process(name, valid):
            for key, on in (("on_delay_s", True), ("off_delay_s", False)):
                delay = getattr(valid.tasks[task].process, key)
                if delay and entry.process is not None and entry.process.lead(on=on):
                    lead = f"controllers.{name}.process.{key.replace('delay', 'lead')}"
                    text = f"expected 0, as {lead} switches its output ahead, got {delay:g}; state one of both"
                    yield document.finding(("tasks", task, "process", key), text)


def _process_weaves(valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """A task that weaves does so as far as its controller, where that one weaves."""
    for name, entry in valid.controllers.items():
        most = Mm(0.0) if entry.process is None else entry.process.weave_mm
        for task in _in_process(name, valid) if most > 0.0 else ():
            weave = valid.tasks[task].path.weave
            if weave is not None and weave.side_mm != most:
                text = f"expected {most:g}, as controllers.{name}.process.weave_mm weaves, got {weave.side_mm:g}"
                yield document.finding(("tasks", task, "path", "weave", "side_mm"), text)
            if weave is not None and weave.dwell == "standing":
                text = f"expected moving, as controllers.{name} weaves and would be behind the feed, got standing"
                yield document.finding(("tasks", task, "path", "weave", "dwell"), text)


def _in_process(controller: str, valid: ValidEntries) -> Iterator[str]:
    """Tasks with a process of the robots of a controller; of a task that is open for several robots none is known."""
    for name, task in valid.tasks.items():
        robot = valid.robots.get(task.robot)
        control = robot.controller if robot is not None else None
        if task.process is not None and control is not None and control.id == controller:
            yield name


def _without_robots(valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """A controller moves at least one robot; known only where all robots name one that exists."""
    used = {robot.controller.id for robot in valid.robots.values() if robot.controller is not None}
    if set(valid.robots) != set(valid.names["robots"]) or not used <= set(valid.names["controllers"]):
        return
    for name in valid.names["controllers"]:
        if name not in used:
            text = f"expected a robot with controller: {{id: {name}}} ({listed(valid.names['robots'])}), got none"
            yield document.key_finding(("controllers", name), text)


def _stop(valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """What is demanded of stops depends on how other robots go on; known only where all entries are valid."""
    is_whole = set(valid.robots) == set(valid.names["robots"]) and set(valid.controllers) == set(
        valid.names["controllers"]
    )
    if valid.checks is None or valid.checks.stop is None or not is_whole:
        return
    used = {robot.controller.id for robot in valid.robots.values() if robot.controller is not None}
    entries = [valid.controllers[name] for name in used if name in valid.controllers]
    if not any(si_or_none(entry.reaction_ms) or entry.brake_s for entry in entries):
        text = "expected controllers of robots that state reaction_ms or brake_s above 0, of which it is worked out, "
        yield document.key_finding(("checks", "stop"), f"{text}got none")
