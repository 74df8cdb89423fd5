"""TP programs as a controller would run them: labels and jumps, loops, blocks, calls with arguments.

Nothing of cellplan reads the texts here. An instruction has one operation at most, as controllers demand it.
"""

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from types import SimpleNamespace
from typing import Any

Event = tuple[Any, ...]
WAITS = {"WAIT 1.00(sec)": "pause", "PAUSE": "halt"}


class TpController:
    """Runs TP programs instruction by instruction: labels and jumps, loops, blocks, calls with arguments."""

    def __init__(self, files: Mapping[str, str], machine: SimpleNamespace, here: Sequence[float]) -> None:
        """Load programs; register 81 holds the step."""
        self._programs: dict[str, tuple[list[str], dict[int, list[float]]]] = {}
        for path, text in files.items():
            head, _, points = text.replace("\r", "").partition("/POS")
            lines = re.findall(r"^ *\d+:(.*) ;$", head, re.MULTILINE)
            assert re.search(r"LINE_COUNT = (\d+);", head)[1] == str(len(lines))  # type: ignore[index]
            poses = re.findall(r"P\[(\d+)\]\{(.*?)\};", points, re.DOTALL)
            values = {
                int(number): [float(v) for v in re.findall(r"J\d = (-?[\d.]+) deg", pose)] for number, pose in poses
            }
            self._programs[path.removesuffix(".ls")] = ([line.strip() for line in lines], values)
        self._machine, self._here = machine, list(here)
        self._registers: dict[int, float] = defaultdict(float, {81: machine.step})
        self._positions: dict[int, list[float]] = {}

    def _value(self, text: str, arguments: Sequence[float]) -> float:
        """Value of one operand, or of two with one operation between."""
        operand = r"(?:P?R\[[\d,]+\]|AR\[\d\]|\d*\.?\d+)"
        assert re.fullmatch(rf"{operand}(?:[-+*/<>=]=?{operand})?", text), text
        plain = re.sub(r"PR\[(\d+),(\d+)\]", r"P[\1][\2-1]", text)
        plain = re.sub(r"AR\[(\d)\]", r"A[\1-1]", plain).replace("=", "==").replace("<==", "<=")
        return float(eval(plain, {"P": self._positions, "A": arguments, "R": self._registers}))  # noqa: S307

    def run(self, name: str, arguments: Sequence[float]) -> Iterator[Event]:
        """What a program does when it is called."""
        lines, points = self._programs[name]
        labels = {line.replace(":STEP", ""): place for place, line in enumerate(lines) if line.startswith("LBL[")}
        place = 0
        while place < len(lines) and lines[place] != "END":
            line, place = lines[place], place + 1
            if match := re.fullmatch(r"R\[(\d+)\]=(.*)", line):
                self._registers[int(match[1])] = self._value(match[2], arguments)
                self._machine.step = int(self._registers[81])
            elif match := re.fullmatch(r"PR\[(\d+)\]=(?:P\[R\[(\d+)\]\]|JPOS)", line):
                pose = points[int(self._registers[int(match[2])])] if match[2] else self._here
                self._positions[int(match[1])] = list(pose)
            elif match := re.fullmatch(r"J PR\[(\d+)\] 10% FINE", line):
                yield "move", self._positions[int(match[1])]
            elif match := re.fullmatch(r"(DO|WAIT DI)\[(\d+)\]=(ON|OFF)", line):
                yield {"DO": "out"}.get(match[1], "in"), match[2], match[3] == "ON"
            elif line in WAITS:
                yield (WAITS[line],)
            elif match := re.fullmatch(r"CALL (\w+)(?:\((.*)\))?", line):
                yield from self.run(match[1], [float(value) for value in (match[2] or "").split(",") if value])
            elif match := re.fullmatch(r"(?:IF (.*),)?JMP (LBL\[\d+\])", line):
                place = labels[match[2]] if not match[1] or self._value(match[1], arguments) else place
            elif match := re.fullmatch(r"IF \((.*)\) THEN", line):
                place = place if self._value(match[1], arguments) else lines.index("ENDIF", place) + 1
            elif line.startswith(("FOR", "ENDFOR")):
                place = self._loop(lines, place, arguments)
            else:
                assert re.fullmatch(r"!.*|U(?:FRAME|TOOL)_NUM=\d+|ENDIF|LBL\[\d+(?::STEP)?\]", line), line

    def _loop(self, lines: Sequence[str], place: int, arguments: Sequence[float]) -> int:
        """Line after the begin or the end of a loop, which none is within."""
        begin = (
            place if lines[place - 1] != "ENDFOR" else max(k for k in range(place) if lines[k].startswith("FOR")) + 1
        )
        match = re.fullmatch(r"FOR R\[(\d+)\]=(.*) (TO|DOWNTO) (.*)", lines[begin - 1])
        assert match is not None
        register, step, last = int(match[1]), 1 if match[3] == "TO" else -1, self._value(match[4], arguments)
        self._registers[register] = (
            self._value(match[2], arguments) if begin == place else self._registers[register] + step
        )
        return begin if step * (last - self._registers[register]) >= 0.0 else lines.index("ENDFOR", begin) + 1
