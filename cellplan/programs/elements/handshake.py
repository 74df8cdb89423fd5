"""Handshakes at marks: signals by which robots wait for one another, without a clock.

The first robot of a cell leads. Each other one raises its output and waits until the leader has raised its own; then it
lowers its output and waits until the leader has lowered its own. The leader waits until all outputs are raised, raises
its own, waits until all are lowered, and lowers its own. Whatever the order in which the controllers read their
inputs, none misses a state of another, and none leaves a mark before all have come to it.

Tasks of one ABB controller need no wires among themselves: they meet at the mark, the first of them waits by wires for
the robots of other controllers, if there are any, and then they meet once more, before any of them goes on.
"""

from collections.abc import Callable
from functools import partial
from typing import Final, NamedTuple

from cellplan.errors import InputError, raise_findings, refusals
from cellplan.model.report.exported import ExportFrame
from cellplan.model.settings.controllers import HandshakeEntry
from cellplan.programs.elements.joints import unit_of

MEETINGS: Final = ("sync_mark", "sync_go")  # where tasks of one controller meet: at a mark, and before they go on


class HandshakeStep(NamedTuple):
    """One instruction of a handshake."""

    waits: bool  # whether it waits for an input, or else sets the output
    signal: str  # the input or output as the controller names it
    is_on: bool  # the state to wait for, or to set
    meets: bool = False  # whether tasks of one controller meet there, which need no wire


def handshake_steps(frame: ExportFrame, robot: str) -> tuple[HandshakeStep, ...]:
    """Instructions of a robot at a mark, at which all robots of the cell meet; none in a cell of one robot.

    Raises:
        InputError: A signal is not stated in the cell.
    """
    wires = tuple(_wires(frame, robot))
    if not task_group(frame, robot):
        return wires
    arrive, leave = (HandshakeStep(True, name, True, meets=True) for name in MEETINGS)
    return (arrive, *wires, leave) if len(speakers(frame)) > 1 else (arrive,)


def task_group(frame: ExportFrame, robot: str) -> tuple[str, ...]:
    """Robots of an ABB controller whose tasks wait for one another without wires, in the order of the cell, or none.

    They are those that state a task, unless an input of one of them is wired to another.
    """
    control = frame.robot(robot).control
    controller = None if control is None else frame.cell.controllers.get(control.id)
    if control is None or control.task is None or controller is None or controller.kind != "abb":
        return ()
    entries = [(one.name, one.control) for one in frame.cell.robots if one.control is not None]
    group = {name: entry.handshake for name, entry in entries if entry.id == control.id and entry.task is not None}
    is_wired = any(name in signals.inputs for signals in group.values() if signals is not None for name in group)
    return tuple(group) if len(group) > 1 and not is_wired else ()


def speakers(frame: ExportFrame) -> list[str]:
    """Robots that wait for others by wires: of tasks that meet without any, the first, and no external axes."""
    names = [robot.name for robot in frame.cell.robots]
    return [name for name in names if name in (task_group(frame, name) or unit_of(frame.cell, name))[:1]]


def _wires(frame: ExportFrame, robot: str) -> list[HandshakeStep]:
    """Instructions of a robot at a mark by which it waits for others through wires."""
    others = _senders(frame, robot)
    if not others:
        return []
    signals, leads = _signals(frame, robot), robot == speakers(frame)[0]
    inputs = [_input(signals, robot, other) for other in others]
    steps: list[HandshakeStep] = []
    for is_on in (True, False):
        waits = [HandshakeStep(True, signal, is_on) for signal in inputs]
        change = HandshakeStep(False, str(signals.output), is_on)
        steps += [*waits, change] if leads else [change, *waits]
    return steps


def lowering_step(frame: ExportFrame, robot: str) -> HandshakeStep:
    """The instruction before the first motion of a program with marks: the output of the robot is lowered.

    A program that was aborted at a mark may have left it raised, which would release others at the next start.

    Raises:
        InputError: A signal is not stated in the cell.
    """
    return next(step for step in reversed(handshake_steps(frame, robot)) if not step.waits)


def first_steps(frame: ExportFrame, robot: str) -> list[HandshakeStep]:
    """Instructions before the first motion of a program with marks; none without an output."""
    return [lowering_step(frame, robot)] if _senders(frame, robot) else []


def require_signals_like(frame: ExportFrame, robot: str, fits: Callable[[str], object], expected: str) -> None:
    """Require stated signals of a robot to be such as a language takes; the ``InputError`` names all that are not."""
    control = frame.robot(robot).control
    if control is None or control.handshake is None:
        return
    key, wires = f"robots.{robot}.controller.handshake", control.handshake
    signals = {"output": wires.output} | {f"inputs.{other}": signal for other, signal in wires.inputs.items()}
    raise_findings(
        InputError(f"{key}.{wire}: expected {expected}, got '{signal}'")
        for wire, signal in signals.items()
        if not fits(str(signal))
    )


def require_signals(frame: ExportFrame, robot: str) -> None:
    """Require every signal of a robot; the ``InputError`` names all that are not stated in the cell."""
    others = _senders(frame, robot)
    if others:
        stated = _signals(frame, robot)
        raise_findings(refusals(*(partial(_input, stated, robot, other) for other in others)))


def _senders(frame: ExportFrame, robot: str) -> list[str]:
    """Robots whose outputs a robot reads: those of all others if it leads, or else that of the leader, if any."""
    leader, *others = speakers(frame)
    return others if robot == leader else [leader] * (robot in others)


def _signals(frame: ExportFrame, robot: str) -> HandshakeEntry:
    """The signals of a robot."""
    control = frame.robot(robot).control
    if control is None or control.handshake is None:
        inputs = ", ".join(f"{other}: …" for other in _senders(frame, robot))
        raise InputError(
            f"robots.{robot}.controller.handshake: expected its signals, {{output: …, inputs: {{{inputs}}}}}, as its "
            "program waits for other robots, got none"
        )
    return control.handshake


def _input(handshake: HandshakeEntry, robot: str, other: str) -> str:
    """The input at which a robot reads the output of another one."""
    if other not in handshake.inputs:
        raise InputError(
            f"robots.{robot}.controller.handshake.inputs: expected the input that '{other}' sets, got none"
        )
    return str(handshake.inputs[other])
