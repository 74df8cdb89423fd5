"""Texts of VAL3 files: a project, arrays of data, a program."""

import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Final

from cellplan.programs.elements.text import comment, joined
from cellplan.programs.formats.val3.xml import DATA_SPACE, PROGRAM_SPACE, PROJECT_SPACE, TYPE_SPACE

VERSION: Final = "s7.10.2"  # of the language, as public projects state it
XML: Final = '<?xml version="1.0" encoding="utf-8"?>'


def index_text(name: str, programs: Iterable[str], *, notes: Iterable[str] = (), libraries: Sequence[str] = ()) -> str:
    """The file that lists programs and data, and libraries by their names, which are those of their projects too."""
    listed = [f'    <Library alias="{library}" path="{library}"/>' for library in libraries]
    return joined(
        [
            XML,
            f'<Project xmlns="{PROJECT_SPACE}">',
            *xml_comments(notes),
            f'  <Parameters version="{VERSION}" stackSize="5000" millimeterUnit="true"/>',
            "  <Programs>",
            *(f'    <Program file="{program}"/>' for program in programs),
            "  </Programs>",
            "  <Database>",
            f'    <Data file="{name}.dtx"/>',
            "  </Database>",
            *(["  <Libraries>", *listed, "  </Libraries>"] if listed else ["  <Libraries/>"]),
            "  <Types/>",
            "</Project>",
        ]
    )


def data_text(notes: Iterable[str], arrays: Iterable[str]) -> str:
    """The file of the data, of the lines of arrays."""
    head = f'<Database xmlns:xsi="{TYPE_SPACE}" xmlns="{DATA_SPACE}">'
    return joined([XML, head, *xml_comments(notes), "  <Datas>", *arrays, "  </Datas>", "</Database>"])


def array_lines(name: str, kind: str, values: Sequence[Mapping[str, str]]) -> list[str]:
    """One array of data, its size that of its values."""
    rows = [
        f'      <Value key="{key}" {" ".join(f"{item}={_quoted(text)}" for item, text in value.items())}/>'
        for key, value in enumerate(values)
    ]
    head = f'    <Data name="{name}" access="public" xsi:type="array" type="{kind}" size="{len(values)}">'
    return [head, *rows, "    </Data>"]


def program_text(name: str, code: Sequence[str], declared: Iterable[str] = ()) -> str:
    """A program, with the lines that declare its parameters and numbers of its own."""
    return joined(
        [
            XML,
            f'<Programs xmlns:xsi="{TYPE_SPACE}" xmlns="{PROGRAM_SPACE}">',
            f'  <Program name="{name}" access="public">',
            *declared,
            "    <Code><![CDATA[begin",
            *(f"  {line}" for line in code),
            "end]]></Code>",
            "  </Program>",
            "</Programs>",
        ]
    )


def xml_comments(notes: Iterable[str]) -> list[str]:
    """Comments of the notes, which two hyphens would end."""
    apart = (re.sub(r"-(?=-)", "- ", note) for note in notes)
    return [f"  <!--{line} -->" for note in apart for line in comment(note, "")]


def _quoted(text: str) -> str:
    """Text as the value of an attribute."""
    return '"' + escape(text, quote=False).replace('"', "&quot;") + '"'
