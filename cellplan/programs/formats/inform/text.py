"""Text of a job: its sections, positions and statements, strictly and with harmless variants."""

import re
from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.programs.elements.conventions import convention_of
from cellplan.programs.elements.text import Statement, lines_of, truncated_error
from cellplan.programs.formats.inform.jobs import KIND, JobFrame
from cellplan.programs.formats.inform.positions import REAR, STATED, WIDTH

COMMENT: Final = 32  # characters of a comment
MOST: Final = 9999  # positions of a job
POSITION: Final = re.compile(r"C(\d{5})=(-?\d+\.\d+(?:,-?\d+\.\d+){5})")
CONFIGURATION: Final = re.compile(r"///RCONF ([01](?:,[01])+)")
MOTIONS: Final = {
    "MOVJ": re.compile(r"MOVJ C(\d{5}) VJ=(\d{1,3}\.\d{1,2}) PL=([01])"),
    "MOVL": re.compile(r"MOVL C(\d{5}) V=(\d{1,4}\.\d) PL=([0-8])"),
    "MOVC": re.compile(r"MOVC C(\d{5}) V=(\d{1,4}\.\d) PL=([0-8])"),
    "CALL": re.compile(r"CALL JOB:([A-Z0-9_]+)"),
    "": re.compile(r"(?!MOV|SMOV|CALL JOB:[A-Z0-9_]+$).+"),  # what else stands there is compared with the cell
}
_DATE: Final = r"///DATE \d{4}/\d{2}/\d{2} \d{2}:\d{2}"


class JobPosition(NamedTuple):
    """A position of a job."""

    statement: Statement
    X: Array  # pose of the tool in the frame of the job in [m], shape (4, 4)
    stated: NDArray[np.int_]  # configuration, shape (6,)

    def is_that_of(self, other: "JobPosition") -> bool:
        """Whether it has the same numbers as another."""
        return np.array_equal(self.X, other.X) and np.array_equal(self.stated, other.stated)


class JobFile(NamedTuple):
    """What a job holds."""

    positions: Mapping[int, JobPosition]
    statements: Sequence[Statement]
    end: Statement  # its last line


def read_job(left: dict[str, str], name: str, frame: JobFrame) -> JobFile:
    """Read a job by its name, in a frame, and take its file out of those that are left."""
    path = f"{name}.JBI"
    if path not in left:
        raise InputError(f"{path}: expected a file, got none")
    lines = [
        Statement(path, number, line.strip())
        for number, line in enumerate(lines_of(left.pop(path), path), start=1)
        if line.strip()
    ]
    rest = _heads(lines, [r"/JOB", f"//NAME {re.escape(name)}", r"//POS"], path)
    count = rest[0] if rest else Statement(path, 1, "")
    npos = re.fullmatch(r"///NPOS (\d{1,4}),0,0,0,0,0", count.text)
    if npos is None:
        raise count.error("///NPOS with the number of positions of the robot, and no other")
    rest = rest[1:]
    if int(npos[1]):
        user = [] if frame.number is None else [f"///USER {frame.number}"]
        kind = "ROBOT" if frame.number is None else "USER"
        rest = _heads(rest, [*user, f"///TOOL {frame.tool}", f"///POSTYPE {kind}", "///RECTAN"], path)
    places = [place for place, line in enumerate(rest) if line.text == "//INST"]
    if not places:
        raise truncated_error(path, lines[-1].line, "//INST")
    positions = _positions(rest[: places[0]])
    if len(positions) != int(npos[1]):
        raise count.error(f"the number of positions of this job, {len(positions)}", npos[1])
    heads = [r"//INST", _DATE, rf"///COMM .{{0,{COMMENT}}}", r"///ATTR SC,RW,RJ", f"///FRAME {frame.name}"]
    rest = _heads(rest[places[0] :], [*heads, f"///GROUP1 RB{frame.group}", "NOP"], path)
    if not rest or rest[-1].text != "END":
        raise (rest or lines)[-1].error("END in the last line")
    statements = [line.read_by(MOTIONS) for line in rest[:-1] if not line.text.startswith("'")]
    return JobFile(positions, statements, rest[-1])


def _heads(lines: Sequence[Statement], expected: Sequence[str], path: str) -> Sequence[Statement]:
    """What follows some lines, each of which has its pattern."""
    for place, pattern in enumerate(expected):
        if place >= len(lines):
            raise truncated_error(path, lines[-1].line if lines else 1, pattern)
        if not re.fullmatch(pattern, lines[place].text):
            raise lines[place].error(pattern)
    return lines[len(expected) :]


def _positions(lines: Sequence[Statement]) -> dict[int, JobPosition]:
    """Positions by number, rising from 0, each with the configuration that was stated last."""
    positions: dict[int, JobPosition] = {}
    stated: NDArray[np.int_] | None = None
    for line in lines:
        if match := CONFIGURATION.fullmatch(line.text):
            numbers = [int(number) for number in match[1].split(",")]
            if not STATED <= len(numbers) <= WIDTH or any(numbers[STATED:]) or numbers[REAR]:
                raise line.error(f"{STATED} to {WIDTH} numbers, in front of axis S, and 0 behind the first {STATED}")
            stated = np.array(numbers[:STATED])
            continue
        position = POSITION.fullmatch(line.text)
        if position is None or stated is None or int(position[1]) != len(positions):
            raise line.error(f"C{len(positions):05d}= with six numbers, behind ///RCONF")
        numbers_of = np.array([float(number) for number in position[2].split(",")])
        positions[len(positions)] = JobPosition(line, convention_of(KIND).pose(numbers_of), stated)
    return positions
