"""Comments of a cell: what they name, and the choices that they offer as commented lines."""

import re

CHOICE = re.compile(r"^(?P<indent> *)# (?P<line>(?P<key>[a-z_]+): [^#]*?) *(?:#.*)?$")
QUOTED = re.compile(r"`([^`]+)`")


def offered_choices(text: str) -> list[str]:
    """Every commented line that stands for a key with its value."""
    return [line for line in text.splitlines() if CHOICE.match(line)]


def with_choice(text: str, line: str) -> str:
    """The cell with a commented line in force, in place of the line with the same key in the same mapping."""
    match = CHOICE.match(line)
    assert match is not None
    lines = text.splitlines()
    index = lines.index(line)
    lines[index] = match["indent"] + match["line"]
    start = re.compile(rf"{match['indent']}{match['key']}:")
    for step in (-1, 1):
        place = index + step
        while 0 <= place < len(lines) and lines[place].startswith(match["indent"]):
            if start.match(lines[place]):
                del lines[place]
                return "\n".join(lines) + "\n"
            place += step
    return "\n".join(lines) + "\n"


def quoted_words(text: str) -> set[str]:
    """Keys that the comments of a cell name between backticks; commands apart."""
    comments = "\n".join(line.partition("#")[2] for line in text.splitlines())
    named = [word for word in QUOTED.findall(comments) if not word.startswith("cellplan ")]
    return {key for word in named for key in re.findall(r"\b[a-z][a-z_]+\b(?=:|$)", word)}
