"""The rules of MultiMove and of RAPID as another person reads them in the text of modules: no code of the product."""

import re
from collections.abc import Mapping
from typing import NamedTuple

MOVE = re.compile(r"^    Move(AbsJ|ExtJ|L) (\[.*?\]\])(?:\\ID:=(\d+))?,(\w+)(?:\\T:=([\d.]+))?,(\w+)(?:,(\w+))?")
LANGUAGE = {"fine"}  # what need not be declared


class Moves(NamedTuple):
    """Moves of a program in their order, and where those are that run together with others."""

    places: list[int]
    matches: list[re.Match[str]]
    on: int
    off: int

    @property
    def inside(self) -> list[re.Match[str]]:
        return [match for place, match in zip(self.places, self.matches, strict=True) if self.on < place < self.off]

    @property
    def outside(self) -> list[re.Match[str]]:
        return [match for place, match in zip(self.places, self.matches, strict=True) if not self.on < place < self.off]

    def before(self, line: int) -> re.Match[str] | None:
        earlier = [match for place, match in zip(self.places, self.matches, strict=True) if place < line]
        return earlier[-1] if earlier else None


def text_of(files: Mapping[str, str], module: str) -> list[str]:
    """Lines of a robot's program, its pages in their places."""
    words: list[str] = []
    for line in files[f"{module}.mod"].split("\r\n"):
        if page := re.fullmatch(r"    (page_(\d+));", line):
            other = files[f"{module}_{page[2]}.mod"].split("\r\n")
            start = other.index(f"  PROC {page[1]}()")
            words += other[start + 1 : other.index("  ENDPROC")]
        else:
            words.append(line)
    return words


def rules_broken(files: Mapping[str, str], tasks: Mapping[str, str]) -> list[str]:
    """Rules that synchronised modules break; ``tasks`` has the task of each module."""
    broken, moves_of, lists = [], set(), set()
    for module, task in tasks.items():
        lines = text_of(files, module)
        on = [k for k, line in enumerate(lines) if line.startswith("    SyncMoveOn ")]
        off = [k for k, line in enumerate(lines) if line.startswith("    SyncMoveOff ")]
        if len(on) != 1 or len(off) != 1 or not on[0] < off[0]:
            return [f"{module}: On and Off"]
        places = [k for k, line in enumerate(lines) if MOVE.match(line)]
        moves = Moves(places, [move for k in places if (move := MOVE.match(lines[k]))], on[0], off[0])
        broken += [f"{module}: {what}" for what in [*moves_broken(moves), *references_broken(lines, moves)]]
        moves_of.add(tuple((move[3], move[5]) for move in moves.inside))
        listed = re.search(r"PERS tasks \w+\{(\d+)\} := (\[\[.*\]\]);", "\n".join(lines))
        lists.add(listed[2] if listed else "")
        if listed is None or f'"{task}"' not in listed[2] or listed[2].count('"') != 2 * int(listed[1]):
            broken.append(f"{module}: list of tasks")
    broken += ["moves that run together differ in number, ID or duration"] * (len(moves_of) != 1)
    broken += ["lists of tasks differ"] * (len(lists) != 1)
    return [*broken, *(f"{path}: {what}" for path, text in files.items() for what in text_broken(text))]


def moves_broken(moves: Moves) -> list[str]:
    """Rules for the moves of one task."""
    numbers = [move[3] for move in moves.inside]
    stops = [moves.before(moves.on), moves.before(moves.off)]
    rules = {
        "a move without ID between On and Off": None in numbers,
        "an ID outside": any(move[3] is not None for move in moves.outside),
        "no stop point before On or Off": any(stop is None or stop[6] != "fine" for stop in stops),
        "an ID twice": len(set(numbers)) != len(numbers),
        "a move without its duration": any(move[5] is None or float(move[5]) <= 0.0 for move in moves.inside),
    }
    return [rule for rule, is_broken in rules.items() if is_broken]


def references_broken(lines: list[str], moves: Moves) -> list[str]:
    """Names that are used and not declared."""
    text = "\n".join(lines)
    declared = set(re.findall(r"^  (?:VAR|PERS|CONST) \w+ (\w+)", text, re.MULTILINE))
    used = {name for move in moves.matches for name in (move[4], move[6], move[7]) if name}
    used |= set(re.findall(r"\w+", lines[moves.on])) | set(re.findall(r"\w+", lines[moves.off]))
    used |= set(re.findall(r"\\WObj:=(\w+)", text))
    missing = used - declared - LANGUAGE - {"SyncMoveOn", "SyncMoveOff"}
    return [f"{name} not declared" for name in sorted(missing)]


def text_broken(text: str) -> list[str]:
    """Rules for the characters, numbers and names of a file."""
    code = re.sub(r"!.*", "", text)
    rules = {
        "characters": not text.isascii(),
        "ends of lines": not text.endswith("\r\n") or "\n" in text.replace("\r\n", ""),
        "numbers": re.search(r"-0\.0+(?!\d)", code) or re.search(r"\d[eE][-+\d]", code.replace("9E9", "")),
        "names": any(len(name) > 32 for name in re.findall(r"\b[A-Za-z]\w*", code)),
        "texts": any(len(name) > 80 for name in re.findall(r'"([^"]*)"', code)),
    }
    return [rule for rule, is_broken in rules.items() if is_broken]
