"""Mutations of the text of programs: each breaks a file in its own way, whatever the format.

A mutation takes a text and a generator and gives another text; None where the text has nothing of the kind.
"""

import re
from collections.abc import Callable
from itertools import pairwise

import numpy as np

Mutation = Callable[[str, np.random.Generator], str | None]
NUMBER = re.compile(r"(?<![\w.])-?\d+\.\d+")
WORD = re.compile(r"(?<![\w.\"'#;!])[A-Za-z_]\w{2,}")
COUNT = re.compile(r"(?<![\w.\-])\d+(?![\w.])")
COMMENTS = (";", "!", "#", "//", "&", "<!--")


def _lines(text: str) -> list[str]:
    return text.splitlines(keepends=True)


def _with_numbers(text: str) -> list[int]:
    """Places of the lines with numbers that are no comments."""
    return [
        place
        for place, line in enumerate(_lines(text))
        if NUMBER.search(line) and not line.lstrip().startswith(COMMENTS)
    ]


def _pick(places: list[int], rng: np.random.Generator) -> int | None:
    return int(rng.choice(places)) if places else None


def _edit(text: str, place: int, line: str) -> str:
    lines = _lines(text)
    lines[place] = line
    return "".join(lines)


def delete_line(text: str, rng: np.random.Generator) -> str | None:
    place = _pick(_with_numbers(text), rng)
    return None if place is None else _edit(text, place, "")


def duplicate_line(text: str, rng: np.random.Generator) -> str | None:
    place = _pick(_with_numbers(text), rng)
    return None if place is None else _edit(text, place, 2 * _lines(text)[place])


def swap_lines(text: str, rng: np.random.Generator) -> str | None:
    places = _with_numbers(text)
    pairs = [(a, b) for a, b in pairwise(places) if _lines(text)[a] != _lines(text)[b]]
    if not pairs:
        return None
    a, b = pairs[int(rng.integers(len(pairs)))]
    lines = _lines(text)
    lines[a], lines[b] = lines[b], lines[a]
    return "".join(lines)


def _edited_number(text: str, rng: np.random.Generator, change: Callable[[str], str]) -> str | None:
    place = _pick(_with_numbers(text), rng)
    if place is None:
        return None
    line = _lines(text)[place]
    matches = list(NUMBER.finditer(line))
    chosen = matches[int(rng.integers(len(matches)))]
    return _edit(text, place, line[: chosen.start()] + change(chosen.group()) + line[chosen.end() :])


def change_leading_digit(text: str, rng: np.random.Generator) -> str | None:
    def change(number: str) -> str:
        place = next(k for k, letter in enumerate(number) if letter.isdigit())
        return number[:place] + str((int(number[place]) + 3) % 10) + number[place + 1 :]

    return _edited_number(text, rng, change)


def change_last_digit(text: str, rng: np.random.Generator) -> str | None:
    return _edited_number(text, rng, lambda number: number[:-1] + str((int(number[-1]) + 5) % 10))


def change_sign(text: str, rng: np.random.Generator) -> str | None:
    def change(number: str) -> str:
        return number[1:] if number.startswith("-") else f"-{number}"

    return _edited_number(text, rng, change)


def write_an_exponent(text: str, rng: np.random.Generator) -> str | None:
    return _edited_number(text, rng, lambda number: f"{float(number):.6e}")


def write_no_number(text: str, rng: np.random.Generator) -> str | None:
    return _edited_number(text, rng, lambda _number: "nan")


def write_a_comma(text: str, rng: np.random.Generator) -> str | None:
    return _edited_number(text, rng, lambda number: number.replace(".", ","))


def delete_a_number(text: str, rng: np.random.Generator) -> str | None:
    return _edited_number(text, rng, lambda _number: "")


def truncate_in_a_line(text: str, rng: np.random.Generator) -> str | None:
    place = _pick(_with_numbers(text), rng)
    if place is None:
        return None
    lines = _lines(text)
    return "".join(lines[:place]) + lines[place][: max(1, len(lines[place]) // 2)]


def truncate_after_a_line(text: str, rng: np.random.Generator) -> str | None:
    places = _with_numbers(text)[:-1]
    place = _pick(places, rng)
    return None if place is None else "".join(_lines(text)[: place + 1])


def truncate_the_last_line(text: str, _rng: np.random.Generator) -> str | None:
    return "".join(_lines(text)[:-1])


def empty_the_file(_text: str, _rng: np.random.Generator) -> str | None:
    return ""


def add_a_statement(text: str, rng: np.random.Generator) -> str | None:
    place = _pick(_with_numbers(text), rng)
    return None if place is None else _edit(text, place, _lines(text)[place] + "do_something_else 17\n")


def add_to_the_end(text: str, _rng: np.random.Generator) -> str | None:
    return f"{text}1.0\n"


def rename_a_reference(text: str, rng: np.random.Generator) -> str | None:
    places = [
        place for place, line in enumerate(_lines(text)) if WORD.search(line) and not line.lstrip().startswith(COMMENTS)
    ]
    place = _pick(places, rng)
    if place is None:
        return None
    line = _lines(text)[place]
    matches = list(WORD.finditer(line))
    chosen = matches[int(rng.integers(len(matches)))]
    return _edit(text, place, f"{line[: chosen.end()]}zq{line[chosen.end() :]}")


def change_a_count(text: str, rng: np.random.Generator) -> str | None:
    places = [
        place
        for place, line in enumerate(_lines(text))
        if COUNT.search(line) and not line.lstrip().startswith(COMMENTS)
    ]
    place = _pick(places, rng)
    if place is None:
        return None
    line = _lines(text)[place]
    matches = list(COUNT.finditer(line))
    chosen = matches[int(rng.integers(len(matches)))]
    return _edit(text, place, line[: chosen.start()] + str(int(chosen.group()) + 1) + line[chosen.end() :])


def write_a_byte_that_is_no_text(text: str, rng: np.random.Generator) -> str | None:
    place = int(rng.integers(max(1, len(text))))
    return f"{text[:place]}\x00{text[place:]}"


def swap_numbers(text: str, rng: np.random.Generator) -> str | None:
    """Two different numbers of a line change their places."""
    lines = _lines(text)
    place = _pick([place for place in _with_numbers(text) if len(set(NUMBER.findall(lines[place]))) > 1], rng)
    if place is None:
        return None
    line = _lines(text)[place]
    matches = list(NUMBER.finditer(line))
    a, b = next((a, b) for a, b in pairwise(matches) if a.group() != b.group())
    return _edit(text, place, line[: a.start()] + b.group() + line[a.end() : b.start()] + a.group() + line[b.end() :])


def write_a_second_comma(text: str, rng: np.random.Generator) -> str | None:
    places = [place for place in _with_numbers(text) if "," in _lines(text)[place]]
    place = _pick(places, rng)
    return None if place is None else _edit(text, place, _lines(text)[place].replace(",", ",,", 1))


def move_a_line_to_the_end(text: str, rng: np.random.Generator) -> str | None:
    place = _pick(_with_numbers(text)[:-1], rng)
    if place is None:
        return None
    lines = _lines(text)
    return "".join([*lines[:place], *lines[place + 1 :], lines[place]])


def delete_the_first_statement(text: str, _rng: np.random.Generator) -> str | None:
    lines = _lines(text)
    place = next((k for k, line in enumerate(lines) if not line.lstrip().startswith(COMMENTS) and line.strip()), None)
    return None if place is None else _edit(text, place, "")


def write_the_file_twice(text: str, _rng: np.random.Generator) -> str | None:
    return 2 * text


MUTATIONS: dict[str, Mutation] = {
    mutation.__name__: mutation
    for mutation in (
        delete_line,
        duplicate_line,
        swap_lines,
        change_leading_digit,
        change_last_digit,
        change_sign,
        write_an_exponent,
        write_no_number,
        write_a_comma,
        delete_a_number,
        truncate_in_a_line,
        truncate_after_a_line,
        truncate_the_last_line,
        empty_the_file,
        add_a_statement,
        add_to_the_end,
        rename_a_reference,
        change_a_count,
        write_a_byte_that_is_no_text,
        swap_numbers,
        write_a_second_comma,
        move_a_line_to_the_end,
        delete_the_first_statement,
        write_the_file_twice,
    )
}
