"""Changes of program texts that change what they mean, made from the texts themselves."""

import re
from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import NamedTuple

NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?![\w.])")
SIZE = re.compile(r'(?:CDIS=|leave="|reach="|r=|zonedata .*)$')  # before the size of a zone: 2 % more is rounding
WORDS = (  # which are put for one another
    *(("TRUE", "FALSE"), ("true", "false"), ("True", "False"), ("ON", "OFF"), ("NOT ", ""), ("not ", "")),
    *(("Start", "End"), ("ARCON", "ARCOF"), ("WVON", "WVOF"), ("ARC_ON", "ARC_OFF"), ("ArcL ", "ArcLEnd ")),
    *(("FINE", "CR5"), ("CR10", "CR30"), ("C_DIS", ""), ("fine", "z_10000"), ("Cartesian", "off")),
    *(("LIN", "PTP"), ("L P", "J P"), ("C P", "L P"), ("MOVL", "MOVC"), ("MOVL", "MOVJ"), ("MoveL", "MoveJ")),
    *(("ArcL ", "MoveL "), ("movel", "movej"), ("movec", "movel"), ("weld1", "weld2"), ("WELD1", "WELD2")),
    *(("s_8", "s_50"), ("w_part_1", "wobj0"), ("t_alpha", "tool0"), ("N U T", "F U T"), ("UF", "UT")),
    *(("fPart", "fWorld"), ("part_1", "part_2"), ("UFRAME_NUM", "UTOOL_NUM"), ("seam_1", "seam_2")),
)


class Language(NamedTuple):
    """What of a language has no meaning, and what acts."""

    remark: str  # rows that stay as they are: comments, dates, and heads of files
    acts: str  # rows of which two in another order, or one twice, do something else
    free: str = r"^$"  # what nothing is promised of, as kind, row, and what stands before the change


SPEED_DATA = r"CONST speeddata \w+ := \[.*|tooldata .*\],\[.*"  # of joints and turns; the mass is not stated
LANGUAGES = {
    "rapid": Language(remark=r"!|<|MODULE|ENDMODULE", acts=r"(?:Move|Arc|SetDO|WaitDI|seam;)", free=rf"{SPEED_DATA}$"),
    "krl": Language(remark=r";|&", acts=r"(?:PTP|LIN|CIRC|\$OUT|WAIT|ARC_|seam\(\))", free=r"ADVANCE=$"),
    "fanuc_ls": Language(
        remark=r"\d+:  !|[A-Z_: ]+ =|/|[A-Z_]+ = \d+,",
        acts=r"\d+:(?!  U)",
        free=r"^whole number \|.*\| +$",
    ),
    "inform": Language(remark=r"'|///(?:DATE|COMM)", acts=r"(?:MOV|WAIT|DOUT|ARC|WV|CALL)"),
    "val3": Language(
        remark=r"<!--|//|<\?|<Programs|<Project|<Database xml|<Parameters|<Libraries|<Types",
        acts=r"(?:move|wait|do\w+=|call|delay)",
        free=r"^row twice \| waitEndMove",
    ),
    "urscript": Language(remark=r"#", acts=r"(?:move|set_\w*digital|sleep|while|seam\(\))"),
}


class Mutation(NamedTuple):
    """A changed text."""

    kind: str
    file: str
    line: int  # from 1
    old: str  # the row
    before: str  # what stands in it before the change
    text: str  # all of the file


def mutations(files: Mapping[str, str], language: Language) -> Iterator[Mutation]:
    """All changes of some kinds that change what the programs mean."""
    for file, text in files.items():
        lines = text.splitlines(keepends=True)
        counted = [
            place for place, line in enumerate(lines) if line.strip() and not re.match(language.remark, line.strip())
        ]
        for place in counted:
            for kind, before, rows in _changes(
                lines[place], acts=re.match(language.acts, lines[place].strip()) is not None
            ):
                changed = "".join([*lines[:place], *rows, *lines[place + 1 :]])
                mutation = Mutation(kind, file, place + 1, lines[place].strip(), before, _numbered(changed))
                if not re.search(language.free, f"{kind} | {mutation.old} | {before}"):
                    yield mutation
        for one, other in pairwise(counted):
            rows = [lines[one].strip(), lines[other].strip()]
            if all(re.match(language.acts, row) for row in rows) and rows[0] != rows[1]:
                swapped = lines.copy()
                swapped[one], swapped[other] = lines[other], lines[one]
                yield Mutation("rows exchanged", file, one + 1, rows[0], "", _numbered("".join(swapped)))


def _changes(line: str, *, acts: bool) -> Iterator[tuple[str, str, list[str]]]:
    """Kinds of changes of a row, each with what stands before it and the rows that stand instead."""
    yield "row left out", "", []
    if acts:
        yield "row twice", "", [line, line]
    for match in NUMBER.finditer(line):
        before, after = line[: match.start()], line[match.end() :]
        kind = "number with decimals" if "." in match[0] else "whole number"
        yield kind, before.rstrip("\r\n"), [before + _other(match[0], is_size=SIZE.search(before) is not None) + after]
    for one, other in WORDS:
        for old, new in ((one, other), (other, one)):
            if old and (changed := line.replace(old, new, 1)) != line:
                yield "word", line.partition(old)[0], [changed]


def _other(number: str, *, is_size: bool) -> str:
    """A number that is 1 more, or of numbers with decimals 0.2 more; 0.004 more of those with many, in [m] or [rad]."""
    decimals = len(number.partition(".")[2])
    if not decimals:
        return str(int(number) + 1)
    step = 0.1 * float(number) if is_size and float(number) else 0.004 if decimals > 5 else 0.2
    return f"{float(number) + step:.{decimals}f}"


def _numbered(text: str) -> str:
    """A TP program whose instructions are numbered again, and counted; other texts as they are."""
    head, start, rest = text.partition("/MN")
    body, end, positions = rest.partition("/POS")
    if not end:
        return text
    rows, count = [], 0
    for row in body.split("\n"):
        match = re.match(r" *\d+:", row)
        count += match is not None
        rows.append(f"{count:4}:{row[match.end() :]}" if match else row)
    head = re.sub(r"(LINE_COUNT\s*=\s*)\d+", rf"\g<1>{count}", head)
    return head + start + "\n".join(rows) + end + positions
