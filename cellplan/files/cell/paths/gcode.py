"""G-code of five axes: moves of the tool tip with tool vectors I, J, K, lines and arcs."""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from cellplan.errors import InputError
from cellplan.files.cell.paths.arcs import Arc, arc_points
from cellplan.files.cell.paths.locations import MM_PER_INCH, UPRIGHT, Locations, Point, file_lines
from cellplan.files.cell.paths.settings import CamSettings
from cellplan.files.input.findings import shown
from cellplan.model.task.task import ProgrammedPath

PLANES: Final = {"G17": (0, 1, 2), "G18": (2, 0, 1), "G19": (1, 2, 0)}  # both axes of arcs, and the one across them
UNITS: Final = {"G20": MM_PER_INCH, "G21": 1.0}
MOVES: Final = frozenset({"G0", "G1", "G2", "G3"})
READ: Final = frozenset({*PLANES, *UNITS, *MOVES, "G90", "G91"})
STILL: Final = frozenset(
    {f"G{code}" for code in ("4", "40", "43", "43.4", "49", *range(54, 60), "61", "64", "80", "91.1", "94", "97")}
    | {f"M{code}" for code in (0, 1, *range(3, 10))}
)  # codes that move no tool
LAST: Final = frozenset({"M2", "M30"})
WITH: Final = {"H": ("G43", "G43.4"), "P": ("G4",)}  # words that go with codes
WORDS: Final = "XYZIJKRF"
COUNTED: Final = frozenset("STHP")
ONCE: Final = ("motion", "plane", "unit", "distances")
_WORD: Final = re.compile(r"\s*([A-Z])\s*([+-]?(?:\d{1,15}\.?\d{0,15}|\.\d{1,15}))(?![\d.])", re.ASCII)
_COMMENT: Final = re.compile(r"\([^()]*\)|;.*")


def _group(code: str) -> str | None:
    """What a code decides for all that follows; None for nothing that is read."""
    groups = {"motion": MOVES, "plane": PLANES, "unit": UNITS, "distances": {"G90", "G91"}}
    return next((group for group, codes in groups.items() if code in codes), None)


@dataclass(slots=True)
class _Reader:
    """What the blocks up to one have said."""

    at: Locations
    settings: CamSettings
    modal: dict[str, str] = field(default_factory=lambda: {"plane": "G17"})  # code by group
    feed: float | None = None  # [mm/s]
    place: list[float | None] = field(default_factory=lambda: [None, None, None])  # of the tip in [mm], where known
    axis: Point = UPRIGHT
    ended: int = 0  # line of the end of the program; 0 before it

    def read(self, line: int, text: str) -> None:
        """One block."""
        code = _COMMENT.sub(" ", text.upper()).strip()
        if not code or code == "%":
            return
        if self.ended:
            self.at.refuse(
                line, f"expected nothing after the end of the program in line {self.ended}, got {shown(code)}"
            )
        codes, values = self._words(line, code)
        self._set(line, codes)
        for word in sorted(values.keys() & COUNTED):
            if word in WITH and not set(WITH[word]) & set(codes):
                self.at.refuse(line, f"expected {word} with {' or '.join(WITH[word])}, got it alone")
            self.at.unused[word] += 1
        if "F" in values:
            self.feed = self.at.feed(line, values["F"], self._unit(line))
        if values.keys() & set("XYZIJKR"):
            self._move(line, values)

    def _words(self, line: int, code: str) -> tuple[list[str], dict[str, float]]:
        """Codes of a block, and its other words with their numbers."""
        codes, values, place = list[str](), dict[str, float](), 0
        while place < len(code):
            match = _WORD.match(code, place)
            if match is None:
                if not code[place:].strip():
                    break
                self.at.refuse(line, f"expected words of a letter and a number, got {shown(code[place:].strip())}")
            (letter, number), place = match.groups(), match.end()
            if letter in "GM":
                codes.append(f"{letter}{float(number):g}")
            elif letter in values:
                self.at.refuse(line, f"expected {letter} once in a block, got it twice")
            elif letter in WORDS or letter in COUNTED:
                values[letter] = float(number)
            elif letter in "ABCUVW":
                text = f"expected tool vectors I, J, K, got the axis {letter} of a machine; have CAM write tool vectors"
                self.at.refuse(line, text)
            elif letter not in "NO":
                self.at.refuse(line, f"expected words {', '.join(WORDS)}, G, M, N, S and T, got {letter}{number}")
        return codes, values

    def _set(self, line: int, codes: list[str]) -> None:
        """Take codes over that hold for what follows, and count those that move nothing."""
        groups = [group for code in codes if (group := _group(code)) is not None]
        for group in ONCE:
            if groups.count(group) > 1:
                self.at.refuse(line, f"expected one code for the {group} in a block, got {', '.join(codes)}")
        for code in codes:
            group = _group(code)
            if group is not None:
                if group == "unit" and self.at.points and self.modal.get("unit") != code:
                    self.at.refuse(line, "expected one unit in a file, got another one after the first point")
                self.modal[group] = code
            elif code in LAST:
                self.ended = line
            elif code == "M6" and self.at.points:
                self.at.refuse(line, "expected one tool, got M6 after the first point; write a file for each tool")
            elif code in STILL:
                self.at.unused[code] += 1
            else:
                known = "G0, G1, G2, G3, G17 to G21, G90, G91 and codes that move nothing"
                self.at.refuse(line, f"expected {known}, got {code}; have CAM write plain moves")

    def _unit(self, line: int) -> float:
        """The unit of lengths in [mm]."""
        if "unit" not in self.modal:
            self.at.refuse(line, "expected the unit before the first length, got none; write G21 (mm) or G20 above it")
        return UNITS[self.modal["unit"]]

    def _move(self, line: int, values: dict[str, float]) -> None:
        """A line or an arc to a point, or a tool axis before the first one."""
        unit, motion = self._unit(line), self.modal.get("motion")
        if motion is None:
            self.at.refuse(line, "expected G0, G1, G2 or G3 before the first point, got none")
        if "distances" not in self.modal:
            self.at.refuse(line, "expected G90 or G91 before the first point, got none; write G90 above it")
        start, target = list(self.place), list(self.place)
        for index, word in enumerate("XYZ"):
            if word in values:
                before = self.place[index] if self.modal["distances"] == "G91" else 0.0
                if before is None:
                    self.at.refuse(line, f"expected {word} at G90 before the first one at G91, got a step from nowhere")
                target[index] = before + values[word] * unit
        is_arc = motion in {"G2", "G3"}
        if is_arc:
            points = self._arc(line, start, target, {word: values[word] * unit for word in "IJKR" if word in values})
        else:
            points = self._line(line, target, values)
        self.place = target
        if motion != "G0" and self.feed is None:
            self.at.refuse(line, "expected a feed before the first move at a feed, got none; write F above it")
        for point in points:
            self.at.move(line, point, self.axis, None if motion == "G0" else self.feed)

    def _line(self, line: int, target: list[float | None], values: dict[str, float]) -> list[Point]:
        """The end of a line, with the tool axis that is reached there; none while a coordinate is not known."""
        if "R" in values:
            self.at.refuse(line, "expected R with G2 or G3, got it on a line")
        vector = [values[word] for word in "IJK" if word in values]
        if vector:
            if len(vector) < 3:
                self.at.refuse(line, f"expected a tool vector I, J, K, got {len(vector)} of its three components")
            self.axis = self.at.unit_axis(line, (vector[0], vector[1], vector[2]))
        x, y, z = target
        if x is not None and y is not None and z is not None:
            return [(x, y, z)]
        if self.modal["motion"] != "G0":
            self.at.refuse(
                line, "expected X, Y and Z before the first move at a feed, got a move from an unknown place"
            )
        self.at.unused["moves to an unknown place"] += 1
        return []

    def _arc(
        self, line: int, start: list[float | None], target: list[float | None], values: dict[str, float]
    ) -> list[Point]:
        """Points of an arc within the chord, its end the last."""
        if None in start:
            self.at.refuse(line, "expected X, Y and Z before the first arc, got an arc from an unknown place")
        first, second, across = PLANES[self.modal["plane"]]
        offsets = [values.get("IJK"[first]), values.get("IJK"[second])]
        if "IJK"[across] in values:
            self.at.refuse(line, f"expected a centre in the plane {self.modal['plane']}, got {'IJK'[across]} across it")
        arc = Arc(
            start=(start[first] or 0.0, start[second] or 0.0),
            end=(target[first] or 0.0, target[second] or 0.0),
            offsets=None if offsets == [None, None] else (offsets[0] or 0.0, offsets[1] or 0.0),
            radius=values.get("R"),
            is_clockwise=self.modal["motion"] == "G2",
        )
        try:
            flat = arc_points(arc, self.settings.chord)
        except InputError as error:
            self.at.refuse(line, str(error))
        points, heights = [], (start[across] or 0.0, target[across] or 0.0)
        for share, u, v in flat:
            point = [0.0, 0.0, 0.0]
            point[first], point[second], point[across] = u, v, heights[0] + share * (heights[1] - heights[0])
            points.append((point[0], point[1], point[2]))
        return points


def read_gcode(path: Path, settings: CamSettings) -> tuple[ProgrammedPath, str]:
    """Read G-code of moves of the tool tip: G0 to G3, F, G17 to G21, G90 and G91, tool vectors I, J, K on lines.

    Modal codes, feeds and tool vectors hold until others are stated. Codes that move nothing are counted.

    Returns:
        The path, and what of the file is not part of it.

    Raises:
        InputError: The file cannot be read, or a line has anything else.
    """
    reader = _Reader(Locations(settings.source), settings)
    for line, text in file_lines(path, settings.source):
        reader.read(line, text)
    return reader.at.path(settings), reader.at.remark
