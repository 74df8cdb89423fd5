"""Names in VAL3 projects: folders, programs, data and links of signals."""

import re
from collections.abc import Iterable
from typing import Final

from cellplan.model.report.exported import ExportFrame
from cellplan.programs.elements.handshake import HandshakeStep, require_signals_like
from cellplan.programs.elements.pages import ProgramNames

NAME: Final = 15  # most characters of a name, that of a tool excepted
TOOL_NAME: Final = 13
JOINTS, TOOL, MOVE, WORLD, OUTPUT, INPUT = "jRow", "tTool", "mMove", "fWorld", "doMark", "diMark"  # names of data
PART: Final = "fPart"
DATA: Final = rf"{JOINTS}|{TOOL}|{MOVE}|{WORLD}|{PART}|{OUTPUT}|{INPUT}[0-9]*"
_SIGNAL: Final = rf"[A-Za-z][A-Za-z0-9_]{{0,{NAME - 1}}}"
START, STOP = "start", "stop"  # programs that every project has
FLANGE: Final = "flange[0]"
BASE: Final = "world[0]"
BOARD: Final = "BasicIO-1"  # the board that a signal is on which is stated as a number
_WORDS: Final = """
abs accept acos aio align and appro array asc asin atan atan2 autoConnectMove begin bnot bool bor break call case chr
close clearBuffer config configRx cos default del delay dio dioGet dioLink dioSet disablePower distance do else elseIf
enablePower end endFor endIf endSwitch endWhile exp false flange for frame get getId hereJ herej if insert interpolate
isCalibrated isEmpty isPowered isSettled joint jointRx jointRs len link ln log max mdesc mid min movec movej movel not
num or point pointRx pointRs popUpMsg position power private public putln reset resetMotion restartMove return
round roundDown roundUp sel set setFrame setPayload setMutex sin sio size speedScale sqrt start step stop stopMove
string switch taskCreate taskKill taskResume taskStatus taskSuspend tan title to tool toNum toString trsf true until
userPage void wait waitEndMove watch while workingMode world xor
"""
WORDS: Final = frozenset(_WORDS.split())
PROJECTS: Final = ProgramNames(NAME, WORDS, DATA)


def signal_names(steps: Iterable[HandshakeStep]) -> dict[tuple[bool, str], str]:
    """Names of the data of signals: the signal itself where it can be one, else a name of this format.

    They are given by whether it is an input, and by the signal, in the order of their first use.
    """
    used = {word.lower() for word in WORDS}
    names: dict[tuple[bool, str], str] = {}
    for step in steps:
        if (step.waits, step.signal) in names:
            continue
        inputs = sum(is_input for is_input, _ in names)
        name = f"{INPUT}{inputs + 1}" if step.waits else OUTPUT
        is_taken = step.signal.lower() in used or re.fullmatch(rf"{DATA}|.*_[0-9]{{3}}", step.signal, re.IGNORECASE)
        if re.fullmatch(_SIGNAL, step.signal) and not is_taken:
            name = step.signal
        used.add(name.lower())
        names[step.waits, step.signal] = name
    return names


def link(signal: str, *, is_input: bool) -> str:
    """Physical link of a signal: as the cell states it, or that of a number on the first board."""
    return rf"{BOARD}\%{'I' if is_input else 'Q'}{signal}" if signal.isdecimal() else signal


def require_links(frame: ExportFrame, robot: str) -> None:
    """Refuse handshake signals that are no links."""
    expected = r"a number, or the link of a signal such as 'BasicIO-1\%Q0'"
    require_signals_like(frame, robot, re.compile(r"[A-Za-z0-9_%.:/\\-]+").fullmatch, expected)
