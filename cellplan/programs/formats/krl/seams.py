"""KRL with seams: LIN and CIRC at a stated speed in a frame of the part, a local routine for each seam.

Points are declared with names, so that they can be touched up: ``XP12`` for joints, ``NAME_2`` for poses of the routine
``NAME``. A tool, or a frame of the part, that has a number on the controller is that of the controller; one without is
declared beside the points.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import floor
from typing import Final

from cellplan.errors import InputError, LineRefusedError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame
from cellplan.model.units import MM
from cellplan.programs.elements.frames import on_flange
from cellplan.programs.elements.handshake import HandshakeStep
from cellplan.programs.elements.paced import Events, Move, blocks
from cellplan.programs.elements.pages import ENDING, PagedProgram
from cellplan.programs.elements.text import fixed, safe_names
from cellplan.programs.formats.krl.axes import external_axes, machine_of
from cellplan.programs.formats.krl.poses import components, frame_text, pose_text, status_and_turn
from cellplan.programs.formats.krl.text import MODULES, NAME, POINT, POINT_NAME, WHOLE

MODES: Final = ("$IPO_MODE=#BASE", "$ORI_TYPE=#VAR", "$CIRC_TYPE=#BASE")  # no tool that stands, no wrist axes
TOOL: Final = "TOOL_FRAME"
PART: Final = "PART_FRAME_"  # and the number of the station, from 1
DATA: Final = rf"{POINT_NAME}|{PART}[0-9]+"
LONGEST_ROUTINE: Final = NAME - ENDING
SPEED_DECIMALS: Final = 6  # of a metre in a second
ZONE_DECIMALS: Final = 3  # of a millimetre
WAIT_DECIMALS: Final = 3


def signal_text(step: HandshakeStep) -> str:
    """One step of a handshake. Both kinds stop the advance run: they are done when the robot stands at the row."""
    if step.waits:
        return f"WAIT FOR {'' if step.is_on else 'NOT '}$IN[{step.signal}]"
    return f"$OUT[{step.signal}]={'TRUE' if step.is_on else 'FALSE'}"


def krl_events(frame: ExportFrame, robot: str) -> Events:
    """What stands between the moves of a robot."""
    return Events(
        frame=frame,
        robot=robot,
        signal=signal_text,
        wait=lambda seconds: f"WAIT SEC {fixed(seconds, WAIT_DECIMALS)}",
        plain=lambda text: "".join(text.upper().split()),
        trigger=lambda lead, text: f"TRIGGER WHEN DISTANCE=1 DELAY=-{1000.0 * lead:.0f} DO {text}",
    )


def routine_names(frame: ExportFrame, robot: str, module: str) -> dict[str, str]:
    """Name of the routine of each task of a robot in a module."""
    tasks = [task.name for task in frame.cell.tasks if task.robot == robot]
    form = krl_events(frame, robot).form
    reserved = {*MODULES.reserved, module, TOOL, *(form.routines if form else ())}
    return safe_names(tasks, longest=LONGEST_ROUTINE, reserved=reserved, data=DATA)


def tool_text(robot: Robot) -> str:
    """The tool of a robot: by its number, or as it is declared."""
    number = None if robot.control is None else robot.control.tool_number
    return f"TOOL_DATA[{number}]" if number else TOOL


def tool_frame(robot: Robot) -> Array:
    """The tool of a robot in the flange of its controller in [m], shape (4, 4)."""
    return on_flange(robot, robot.tool.X_FT)


def part_text(frame: ExportFrame, robot: str, task: str) -> str:
    """The part that a robot works on in a task: by the number of its frame, or as it is declared."""
    station = frame.station(robot, task)
    return f"BASE_DATA[{station.number}]" if station.number else f"{PART}{frame.stations[robot].index(station) + 1}"


def base_texts(frame: ExportFrame, robot: str, task: str) -> list[str]:
    """What sets the frame in which a robot works on a task: the part, or where a positioner in step moves it."""
    part, holder = part_text(frame, robot, task), frame.station(robot, task).holder
    if holder is None:
        return [f"$BASE={part}"]
    try:
        machine = f"MACHINE_DEF[{machine_of(frame, holder)}]"
    except InputError as missing:
        raise LineRefusedError(task, f": {missing}") from None
    return [f"$BASE=EK({machine}.ROOT,{machine}.MECH_TYPE,{part})", f"$ACT_EX_AX={external_axes(frame, robot)}"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SeamWriter:
    """The statements and declarations of a robot in a program."""

    frame: ExportFrame
    program: PagedProgram  # what is written of it, numbers in the order of a point
    moves: Sequence[Move]
    names: Mapping[str, str]  # of the routine of each task
    stems: Mapping[str, str]  # with which names of its points begin

    @property
    def robot(self) -> str:
        """Name of the robot."""
        return self.program.placed.name

    def point(self, row: int) -> str:
        """Name of the point of a row."""
        seam = next((seam for seam in self.program.rows.seams if seam.first < row <= seam.last), None)
        return f"{POINT}{row + 1}" if seam is None else f"{self.stems[seam.task]}_{row - seam.first}"

    def points(self) -> Iterator[str]:
        """Declarations of frames and points."""
        robot, rows, decimals = self.program.placed, self.program.rows, self.program.decimals
        if tool_text(robot) == TOOL:
            yield f"DECL FRAME {TOOL}={frame_text(tool_frame(robot), decimals)}"
        for number, station in enumerate(self.frame.stations.get(self.robot, ()), start=1):
            if station.X is not None and not station.number:
                yield f"DECL FRAME {PART}{number}={frame_text(station.X, decimals)}"
        on_seam, states = rows.on_seam, status_and_turn(robot, rows.q).tolist()
        for row, numbers in enumerate(self.program.numbers.tolist()):
            if rows.X_PT is not None and on_seam[row]:
                pose = pose_text(rows.X_PT[row], states[row], numbers[6:], decimals=decimals)
                yield f"DECL E6POS {self.point(row)}={pose}"
            else:
                yield f"DECL E6AXIS {self.point(row)}={{{components(numbers, decimals)}}}"

    def routines(self) -> dict[str, list[str]]:
        """Statements of the main routine, under an empty name, and of that of each seam."""
        events = krl_events(self.frame, self.robot)
        main = list(events.before(bool(self.program.rows.marks)))
        routines = {"": main}
        for seam, moves in blocks(self.moves):
            if seam is None:
                main += self._block(events, None, moves)
                continue
            name = self.names[seam.task]
            routines[name] = [*base_texts(self.frame, self.robot, seam.task), *self._block(events, seam.task, moves)]
            main.append(f"{name}()")
        return routines

    def _block(self, events: Events, task: str | None, moves: Sequence[Move]) -> Iterator[str]:
        """The moves of a routine, each with its speed and rounding where these change, and what stands after it."""
        stated: dict[str, str] = {}
        for place, move in enumerate(moves):
            is_last_joint = not move.is_tool and place + 1 < len(moves) and moves[place + 1].is_tool
            settings, motion = self._tool_move(move) if move.is_tool else self._joint_move(move, stops=is_last_joint)
            for key, value in settings.items():
                if stated.get(key) != value:
                    stated[key] = value
                    yield value
            yield from move.triggers
            yield motion
            yield from events.texts(task, move.switches)

    def _joint_move(self, move: Move, *, stops: bool) -> tuple[dict[str, str], str]:
        """What is set before a motion of the joints, and the motion."""
        share = 0 if stops else min(floor(WHOLE * move.share + 1e-9), 100)  # in halves of a motion, in [%]
        settings = {"VEL_PTP": f"BAS(#VEL_PTP,{self.program.speeds[move.row]})"}
        if share:
            settings["CPTP"] = f"$APO.CPTP={share}"
        return settings, f"PTP {self.point(move.row)}{' C_PTP' if share else ''}"

    def _tool_move(self, move: Move) -> tuple[dict[str, str], str]:
        """What is set before a line or an arc of the tool, and the motion."""
        zone = floor(MM * move.zone * 10**ZONE_DECIMALS) / 10**ZONE_DECIMALS
        settings = {"CP": f"$VEL.CP={_plain(move.feed, SPEED_DECIMALS)}"}
        if zone:
            settings["CDIS"] = f"$APO.CDIS={_plain(zone, ZONE_DECIMALS)}"
        points = self.point(move.row) if move.middle is None else f"{self.point(move.middle)},{self.point(move.row)}"
        return settings, f"{'LIN' if move.middle is None else 'CIRC'} {points}{' C_DIS' if zone else ''}"


def _plain(number: float, decimals: int) -> str:
    """A number with as many decimals as it needs."""
    return fixed(number, decimals).rstrip("0").rstrip(".")
