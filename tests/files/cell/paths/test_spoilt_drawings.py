"""Spoilt DXF drawings: each is refused in one line with its place, in the guarded child and within its memory."""

from pathlib import Path

import pytest
from builders.drawings import HEAD, LINE, TAIL, entity, settings, write_drawing, write_text

from cellplan.errors import InputError
from cellplan.files.cell.paths.dxf import MOST_BYTES, read_drawing
from cellplan.guard import Guard, in_child

CORNERS = [(10, 0), (20, 0), (10, 9), (20, 9)]
CIRCLE = [(10, 0), (20, 0), (40, 5)]
SPLINE = [
    (100, "AcDbSpline"),
    (70, 8),
    (71, 1),
    (72, 4),
    (73, 2),
    *((40, k) for k in (0, 0, 1, 1)),
    (10, 0),
    (20, 0),
    (10, 9),
    (20, 9),
]
END = entity("SEQEND")


def spline(**changes: list) -> str:
    """A spline with other values under some codes."""
    tags = [tag for tag in SPLINE if f"c{tag[0]}" not in changes]
    return entity("SPLINE", *tags, *((int(code[1:]), value) for code, values in changes.items() for value in values))


# entities behind the head, line, words of the message
ENTITIES = [
    (
        entity("TEXT", (10, 0), (20, 0), (40, 3), (1, "words")),
        19,
        "expected LINE, ARC, CIRCLE, ELLIPSE, LWPOLYLINE, POLY",
    ),
    (
        LINE + entity("MTEXT", (100, "AcDbMText"), (10, 0), (20, 0), (1, "words")),
        31,
        "on the layer CUT, got this; move it to another layer",
    ),
    (LINE + entity("HATCH", (10, 0), (20, 0), (2, "SOLID")), 0, "but ezdxf says"),
    (LINE + entity("POINT", (10, 0), (20, 0)), 31, "POINT"),
    (LINE + entity("3DFACE", (10, 0), (20, 0), (11, 0), (21, 5), (12, 5), (22, 5)), 31, "3DFACE"),
    (LINE + entity("SOLID", (10, 0), (20, 0), (11, 0), (21, 5), (12, 5), (22, 5)), 31, "SOLID"),
    (LINE + entity("XLINE", (10, 0), (20, 0), (11, 1), (21, 0)), 31, "XLINE"),
    (LINE + entity("WIGGLE", (10, 0), (20, 0)), 31, "WIGGLE"),
    (LINE + entity("VERTEX", (10, 0), (20, 0)), 0, "VERTEX"),
    (
        entity("LINE", (10, 0), (20, 0), (30, 5), (11, 9), (21, 9), (31, 5)),
        19,
        "expected a curve at z = 0, got z = 5 mm",
    ),
    (entity("CIRCLE", (10, 0), (20, 0), (30, 2), (40, 5)), 19, "expected a curve at z = 0, got z = 2 mm; draw it flat"),
    (
        entity("CIRCLE", *CIRCLE, (210, 0), (220, 1), (230, 0)),
        19,
        "in the plane of the drawing, got the normal [0, 1, 0]",
    ),
    (
        entity("LWPOLYLINE", (100, "AcDbPolyline"), (90, 2), (38, 4), *CORNERS),
        19,
        "expected a curve at z = 0, got z = 4 mm",
    ),
    (entity("CIRCLE", (10, 0), (20, 0), (40, -5)), 19, "expected a radius above 0, got -5"),
    (entity("CIRCLE", (10, 0), (20, 0), (40, 0)), 19, "expected a radius above 0, got 0"),
    (entity("CIRCLE", (10, 0), (20, 0), (40, "nan")), 19, "expected a radius above 0, got nan"),
    (entity("ARC", *CIRCLE, (50, "inf"), (51, 90)), 19, "expected angles that are numbers"),
    (
        entity("LINE", (10, "nan"), (20, 0), (11, 9), (21, 9)),
        19,
        "expected coordinates of at most 100000 mm, got x nan",
    ),
    (entity("LINE", (10, "1e400"), (20, 0), (11, 9), (21, 9)), 19, "got x inf, y 0; is the unit right?"),
    (entity("LINE", (10, "1e7"), (20, 0), (11, 9), (21, 9)), 19, "got x 1e+07, y 0; is the unit right?"),
    (
        entity("LWPOLYLINE", (100, "AcDbPolyline"), (90, 2), (10, 0), (20, 0), (42, "nan"), (10, 9), (20, 9)),
        19,
        "expected a bulge that is a",
    ),
    (
        entity(
            "SPLINE",
            (100, "AcDbSpline"),
            (70, 8),
            (71, 3),
            (72, 0),
            (73, 0),
            (74, 2),
            (11, 0),
            (21, 0),
            (11, 9),
            (21, 9),
        ),
        19,
        "got 0; convert",
    ),
    (spline(c71=[4]), 19, "expected more than 4 control points for a spline, got 2"),
    (spline(c40=[0, 1, 1]), 19, "expected 4 knots that do not decrease, got 3"),
    (spline(c40=[0, 1, 0, 1]), 19, "knots that do not decrease"),
    (spline(c40=[0, 0, 0, 0]), 19, "expected a spline in one piece, got knots that repeat too often"),
    (spline(c40=[0, 0, "nan", 1]), 19, "knots that do not decrease"),
    (spline(c41=[1, -1]), 19, "expected 2 weights above 0"),
    (spline(c41=[1]), 19, "expected 2 weights above 0, got 1"),
    (
        entity("POLYLINE", (66, 1), (70, 4)) + entity("VERTEX", (10, 0), (20, 0)) + END,
        19,
        "got a fitted one or a surface",
    ),
    (entity("POLYLINE", (66, 1), (70, 64)) + END, 19, "got a fitted one or a surface; explode it"),
    (entity("INSERT", (2, "LOGO"), (10, 0), (20, 0)), 19, "expected a block of the file, got 'LOGO', which it has not"),
    (LINE + LINE, 31, "expected each curve once, got the one of LINE #"),
    (LINE + entity("LINE", (10, 30), (20, 0), (11, 0), (21, 0)), 31, "again; delete one of them"),
    (
        LINE
        + entity("LINE", (10, 30), (20, 0), (11, 50), (21, 0))
        + entity("LINE", (10, 30), (20, 0), (11, 30), (21, 9)),
        43,
        "expected at most two ends of curves at x 30.000, y 0.000 mm, got those of LINE #",
    ),
    (
        entity("LINE", (10, 0), (20, 0), (11, 5), (21, 0), layer="OTHER"),
        0,
        "expected curves on the layer 'CUT', got none",
    ),
    ("", 0, "got none; it has none at all"),
    (
        entity("LINE", (10, "abc"), (20, 0), (11, 9), (21, 9)),
        28,
        "expected a sound DXF file, but ezdxf says: Invalid floating point",
    ),
    (
        entity("LINE", (10, 0), (11, 9), (21, 9)),
        26,
        "expected a sound DXF file, but ezdxf says: Missing required y coordinate",
    ),
    (LINE + "x\n0\n", 31, "expected a group code, a whole number, got 'x'"),
    (LINE + "\n" + LINE, 31, "expected a group code, a whole number, got ''"),
    (LINE + "99999\n0\n", 31, "expected a group code, a whole number, got '99999'"),
]
TEXT = HEAD + LINE + TAIL
WHOLE = [
    ("", 1, "expected 0 and EOF at the end of a DXF file, got the end; is it whole?"),
    (TEXT[: len(TEXT) // 2], 0, "expected 0 and EOF at the end of a DXF file"),
    (TEXT[:-6], 0, "expected 0 and EOF"),
    ("ISO-10303-21;\nHEADER;\n", 1, "expected a group code, a whole number, got 'ISO-10303-21;'"),
    ("<svg>\n</svg>\n", 1, "expected a group code"),
    ("\x00\x01\x02\n" * 50, 1, "expected a group code"),
    (TEXT.replace("$INSUNITS\n70\n4", "$INSUNITS\n70\nmm"), 0, "expected "),
    (TEXT.replace("0\nENDSEC\n0\nEOF", "0\nEOF"), 0, "expected a sound DXF file, but ezdxf says: missing ENDSEC tag"),
    (TEXT.replace("2\nENTITIES\n", ""), 0, "expected a sound DXF file"),
]


def refusal(file: Path) -> str:
    with pytest.raises(InputError) as refused:
        read_drawing(file, settings())
    return str(refused.value)


@pytest.mark.parametrize(("entities", "line", "words"), ENTITIES)
def test_spoilt_entities_are_refused_by_line(tmp_path: Path, entities: str, line: int, words: str) -> None:
    assert_one_line(refusal(write_text(tmp_path, entities)), line, words)


@pytest.mark.parametrize(("whole", "line", "words"), WHOLE)
def test_spoilt_files_are_refused(tmp_path: Path, whole: str, line: int, words: str) -> None:
    assert_one_line(refusal(write_text(tmp_path, whole=whole)), line, words)


def assert_one_line(message: str, line: int, words: str) -> None:
    assert message.startswith(f"logo.dxf:{line}: " if line else "logo.dxf:")
    assert words in message
    assert "\n" not in message


def test_every_truncation_is_refused_in_one_line(tmp_path: Path) -> None:
    lines = (HEAD + LINE + entity("CIRCLE", *CIRCLE) + TAIL).splitlines(keepends=True)

    for count in range(len(lines) - 1):
        assert_one_line(refusal(write_text(tmp_path, whole="".join(lines[:count]))), 0, "expected ")


def test_binary_drawings_and_files_that_are_too_large_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "logo.dxf"
    file.write_bytes(b"AutoCAD Binary DXF\r\n\x1a\x00" + bytes(100))
    assert refusal(file) == "logo.dxf: expected a DXF file as text, got a binary one; save it as text"
    with file.open("wb") as stream:
        stream.truncate(MOST_BYTES + 1)
    assert refusal(file) == "logo.dxf: expected a file of at most 30 MB, got a larger one"


def test_blocks_within_themselves_and_blocks_that_multiply_are_refused(tmp_path: Path) -> None:
    def endless(document, space) -> None:
        document.blocks.new("A").add_blockref("A", (1, 0), dxfattribs={"layer": "CUT"})
        space.add_blockref("A", (0, 0), dxfattribs={"layer": "CUT"})

    def array(document, space) -> None:
        document.blocks.new("C").add_circle((0, 0), 1)
        many = {"layer": "CUT", "row_count": 30000, "column_count": 30000, "row_spacing": 9, "column_spacing": 9}
        space.add_blockref("C", (0, 0), dxfattribs=many)

    assert "expected at most 16 blocks within one another, got more" in refusal(write_drawing(tmp_path, endless))
    assert "expected at most 100000 curves, those of blocks included, got more" in refusal(
        write_drawing(tmp_path, array)
    )


@pytest.mark.slow
def test_blocks_that_multiply_within_one_another_are_refused(tmp_path: Path) -> None:
    def bomb(document, space) -> None:
        for level in range(12):
            block = document.blocks.new(f"B{level}")
            for place in range(10):
                if level:
                    block.add_blockref(f"B{level - 1}", (place, 0))
                else:
                    block.add_circle((place, 0), 1)
        space.add_blockref("B11", (0, 0), dxfattribs={"layer": "CUT"})

    assert "expected at most 100000 curves, " in refusal(write_drawing(tmp_path, bomb))


@pytest.mark.slow
def test_a_large_drawing_stays_within_the_memory_of_the_guard(tmp_path: Path) -> None:
    entities = "".join(entity("LINE", (10, k), (20, 0), (11, k), (21, 1)) for k in range(200_000))
    file = write_text(tmp_path, entities)
    assert file.stat().st_size < MOST_BYTES

    with pytest.raises(InputError, match=r"^logo\.dxf:\d+: LINE #\w+: expected at most 100000 curves, got more"):
        in_child(read_drawing, file, settings(), guard=Guard(file="logo.dxf", worker="the DXF reader"))
