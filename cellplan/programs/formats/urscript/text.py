"""URScript as its writer and its reader share it: names, limits, and the instructions besides rows."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, Promise
from cellplan.model.settings.units import si_or_none
from cellplan.programs.elements.handshake import HandshakeStep, handshake_steps, lowering_step, require_signals_like
from cellplan.programs.elements.joints import ARM
from cellplan.programs.elements.pages import MOST_PAGES
from cellplan.programs.elements.text import safe_names
from cellplan.programs.elements.timed_rows import cycle_of, decimals_of
from cellplan.programs.formats.urscript.rows import APPROACH_ACCELERATION, APPROACH_SPEED, move_acceleration

DECIMALS: Final = 9  # of a radian
FEWEST_TIMED: Final = 8  # decimals of a radian: as fine as the six of a degree that a stream has
MOST_ROWS: Final = 25_000  # of a routine, and of a program that anybody has tried; longer ones have several routines
TURNS: Final = 4.0 * np.pi  # [rad] the largest position either way: two turns
CYCLES: Final = (2, 8)  # [ms] of e-Series and of CB3 controllers
LOOKAHEAD: Final = (0.03, 0.2)  # [s] that servoj takes
GAIN: Final = 300  # 100 to 2000: that of the maker
SIGNALS: Final = frozenset(str(number) for number in range(8))
OFF_CYCLE: Final = 1e-9  # [s]
LONGEST_NAME: Final = 40
ENDING: Final = ".script"
_WORDS: Final = (
    "and or xor not if elif else end while for def thread return break continue global local struct pass halt sec "
    "True False PI movej movel movep movec servoj servoc speedj speedl stopj stopl sync sleep join kill run "
    "set_standard_digital_out get_standard_digital_in switch case default in is popup textmsg norm length sin cos tan "
    "asin acos atan atan2 sqrt log pow floor ceil random d2r r2d force freedrive_mode set_tcp set_payload set_gravity "
    "pose_add pose_sub pose_trans pose_inv pose_dist point_dist interpolate_pose get_actual_tcp_pose str_len"
)
RESERVED: Final = (*_WORDS.split(), *(f"page_{number:03d}" for number in range(1, MOST_PAGES + 1)))


def function_names(frame: ExportFrame) -> dict[tuple[str | None, str], str]:
    """Name of the function of each program of each robot."""
    keys = [(program, robot) for program in frame.programs for robot in frame.robots]
    plain = {key: key[1] if key[0] is None else f"{key[0]}/{key[1]}" for key in keys}
    safe = safe_names(plain.values(), longest=LONGEST_NAME, reserved=RESERVED)
    return {key: safe[name] for key, name in plain.items()}


def decimals_of_urscript(frame: ExportFrame, robot: Robot) -> int:
    """Decimals of the positions of a robot of six joints: enough that rounding is not felt as acceleration."""
    joints = robot.model.joints
    if len(joints) != ARM or not all(joint.is_revolute for joint in joints):
        raise InputError(f"robots.{robot.name}: expected {ARM} turning joints for urscript, got {len(joints)} joints")
    decimals = decimals_of(robot, DECIMALS)
    if frame.promise is Promise.TIMED and decimals < FEWEST_TIMED:
        added = 2.0 * 10.0**-decimals / cycle_of(robot) ** 2
        raise InputError(
            f"robots.{robot.name}.controller.decimals: expected {FEWEST_TIMED} or more, of a radian, got {decimals}, "
            f"with which rounding adds up to {added:.3g} rad/s^2 of acceleration in each cycle"
        )
    return decimals


def most_rows(frame: ExportFrame) -> int:
    """Most rows of a routine."""
    return MOST_ROWS if frame.split is None else min(frame.split, MOST_ROWS)


def page_name(number: int) -> str:
    """Name of a routine of a program that has several, from 1."""
    return f"page_{number:03d}"


def require_turns(joints: Sequence[str], numbers: Array, *, row_of: Sequence[str]) -> None:
    """Make sure that no written position in [rad], shape (N, 6), is beyond two turns; rows have places."""
    beyond = np.argwhere(np.abs(numbers) > TURNS)
    if len(beyond):
        row, place = (int(index) for index in beyond[0])
        raise InputError(
            f"{row_of[row]}: expected joint {joints[place]} within two turns, got {numbers[row, place]:.6f} rad"
        )


def servo_call(frame: ExportFrame, robot: Robot) -> str:
    """Arguments of ``servoj`` after the joints; cycle and latency are stated, and such as the controller takes."""
    cycle = cycle_of(robot)
    if not any(abs(cycle - known / 1000.0) <= OFF_CYCLE for known in CYCLES):
        raise InputError(
            f"robots.{robot.name}.controller.cycle_ms: expected 2 (e-Series) or 8 (CB3), got {1000.0 * cycle:.9g}"
        )
    if robot.control is None:
        raise InputError(f"robots.{robot.name}.controller: expected the controller that plays urscript, got none")
    controller = frame.cell.controllers[robot.control.id]
    latency, shortest, longest = si_or_none(controller.latency_ms), *LOOKAHEAD
    if latency is None or latency < shortest:
        shown = "none" if latency is None else f"{1000.0 * latency:g}"
        raise InputError(
            f"controllers.{robot.control.id}.latency_ms: expected {1000.0 * shortest:g} or more, as servoj follows its "
            f"rows with a lookahead time of {1000.0 * shortest:g} to {1000.0 * longest:g} ms, got {shown}"
        )
    return f"a=0, v=0, t={cycle:.3f}, lookahead_time={min(latency, longest):.3f}, gain={GAIN}"


def approach_call() -> str:
    """Arguments of the ``movej`` to the first row."""
    return f"a={APPROACH_ACCELERATION:.3f}, v={APPROACH_SPEED:.3f}"


def stop_call(robot: Robot) -> str:
    """The instruction at the end of a timed program."""
    return f"stopj({move_acceleration(robot):.3f})"


def handshake_lines(frame: ExportFrame, robot: str) -> list[str]:
    """Instructions of a robot at a mark, by standard digital signals; none in a cell of one robot."""
    lines = []
    for step in handshake_steps(frame, robot):
        require_standard_signals(frame, robot)
        lines += signal_lines(step)
    return lines


def signal_lines(step: HandshakeStep) -> list[str]:
    """One instruction of a handshake, by standard digital signals."""
    if not step.waits:
        return [f"set_standard_digital_out({step.signal}, {step.is_on})"]
    state = "not " if step.is_on else ""
    return [f"while {state}get_standard_digital_in({step.signal}):", "  sync()", "end"]


def lowering(frame: ExportFrame, robot: str) -> str:
    """The instruction at the begin of a program with marks."""
    return f"set_standard_digital_out({lowering_step(frame, robot).signal}, False)"


def require_standard_signals(frame: ExportFrame, robot: str) -> None:
    """Make sure that the signals of a robot are standard digital ones."""
    require_signals_like(frame, robot, SIGNALS.__contains__, "a standard digital signal 0 to 7")
