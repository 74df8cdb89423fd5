"""Names in KUKA programs: modules, their files, points and signals."""

import re
from typing import Final

from cellplan.errors import InputError
from cellplan.model.report.exported import ExportFrame
from cellplan.programs.elements.handshake import signals_by_key
from cellplan.programs.elements.pages import ProgramNames

NAME: Final = 24  # most characters of a name
LAST_SIGNAL: Final = 4096  # number of the last input and output that all controllers of the language have
LINE: Final = 471  # most characters of a line
WHOLE: Final = 200.0  # [%] of $APO.CPTP for a share of one: 100 % is half a motion
POINT: Final = "XP"  # first letters of the name of a point; its number is that of the row, from 1
POINT_NAME: Final = rf"{POINT}[0-9]+"
EXTERNAL: Final = 6  # external axes E1 to E6
AXES: Final = tuple(f"A{axis}" for axis in range(1, 7)) + tuple(f"E{axis}" for axis in range(1, EXTERNAL + 1))
_WORDS: Final = """
ABS ACOS AND ANIN ANOUT ATAN2 AXIS BAS BASE_DATA BOOL B_AND B_EXOR B_NOT B_OR BRAKE CASE CAST_FROM CAST_TO CCLOSE
CHANNEL CHAR CIOCTL CIRC CIRC_REL CONFIRM CONST CONTINUE COPEN COS CREAD CWRITE C_DIS C_ORI C_PTP C_SPL C_VEL DECL
DEF DEFAULT DEFDAT DEFFCT DELAY DIGIN DISTANCE DO E6AXIS E6POS ELSE END ENDDAT ENDFCT ENDFOR ENDIF ENDLOOP
ENDSPLINE ENDSWITCH ENDWHILE ENUM EXIT EXOR EXT EXTFCT FALSE FOR FRAME GLOBAL GOTO HALT HOME IF IMPORT IN INI INT
INTERRUPT IS LIN LIN_REL LOAD LOAD_DATA LOOP MAXIMUM MINIMUM NOT OFF ON OR OUT PATH POS PTP PTP_REL PTP_SPLINE
PUBLIC PULSE REAL REPEAT RESUME RETURN SCIRC SEC SEMA SIGNAL SIN SLIN SPL SPLINE SPS SPTP SQRT SREAD STATE STEP
STRUC SWITCH SWRITE TAN THEN TIME_BLOCK TO TOOL_DATA TRIGGER TRUE UNTIL USER WAIT WHEN WHILE WITH
"""
MODULES: Final = ProgramNames(NAME, frozenset(_WORDS.split()), POINT_NAME)


def require_numbers(frame: ExportFrame, robot: str) -> None:
    """Refuse handshake signals that are not the numbers of inputs and outputs.

    Raises:
        InputError: With the key path.
    """
    for path, signal in signals_by_key(frame, robot).items():
        if not re.fullmatch(r"[1-9][0-9]{0,3}", signal) or int(signal) > LAST_SIGNAL:
            raise InputError(
                f"{path}: expected a whole number from 1 to {LAST_SIGNAL}, as KUKA controllers number their signals, "
                f"got '{signal}'"
            )
