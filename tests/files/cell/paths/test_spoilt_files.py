"""Spoilt files of CAM: each is refused in one line with its place, within bounded memory."""

import tracemalloc
from pathlib import Path

import pytest
from builders.cam_files import APT_HEAD, GCODE_HEAD, settings, written

from cellplan.errors import InputError
from cellplan.files.cell.paths.apt import read_apt
from cellplan.files.cell.paths.gcode import read_gcode
from cellplan.files.cell.paths.locations import MOST_BYTES

TWO = "GOTO/0,0,0\nGOTO/1,0,0\n"
MOVES = "G0 X0 Y0 Z0\nG1 X1\n"

# text, line, words of the message
APT = [
    (APT_HEAD + TWO + "CIRCLE/0,0,0,0,0,1,5\n", 7, "expected motions as points (GOTO), got arcs (CIRCLE)"),
    (APT_HEAD + TWO + "CYCLE/DRILL,5,MMPM,60\n", 7, "got cycles (CYCLE)"),
    (APT_HEAD + "TRACUT/MX1\n" + TWO, 5, "got transformations (TRACUT)"),
    (APT_HEAD + "COPY/1,XYROT,90,3\n" + TWO, 5, "got copies (COPY)"),
    (APT_HEAD + TWO + "GODLTA/0,0,5\n", 7, "got steps (GODLTA)"),
    (APT_HEAD + TWO + "GOHOME\n", 7, "got moves home (GOHOME)"),
    (APT_HEAD + TWO + "RETRCT/TO,50\n", 7, "got retracts (RETRCT)"),
    (APT_HEAD + "ROTABL/90\n" + TWO, 5, "got turns of the table (ROTABL)"),
    (APT_HEAD + "CUTCOM/LEFT\n" + TWO, 5, "got cutter compensation (CUTCOM)"),
    (APT_HEAD + "INSERT G1 X5\n" + TWO, 5, "expected a statement of APT, got 'INSERT G1 X5'"),
    (APT_HEAD + "ORIGIN/0,0,5\n" + TWO, 5, "got another origin (ORIGIN)"),
    (APT_HEAD + "GOTT/0,0,0\n" + TWO, 5, "did you mean 'GOTO'?"),
    (APT_HEAD + "P1=POINT/0,0,0\n" + TWO, 5, "expected a statement of APT, got 'P1=POINT/0,0,0'"),
    (APT_HEAD + "GOTO/P1\n" + TWO, 5, "GOTO: expected a number with a decimal point, got 'P1'"),
    (APT_HEAD + "GOTO/0,0\n" + TWO, 5, "expected GOTO/x,y,z or GOTO/x,y,z,i,j,k, got 2 numbers"),
    (APT_HEAD + "GOTO\n" + TWO, 5, "got 0 numbers"),
    (APT_HEAD + "GOTO/0,0,0,0,1\n" + TWO, 5, "got 5 numbers"),
    (APT_HEAD + "GOTO/0,,0\n" + TWO, 5, "GOTO: expected a number with a decimal point, got ''"),
    (APT_HEAD + "GOTO/0,0,nan\n" + TWO, 5, "expected a number with a decimal point, got 'NAN'"),
    (APT_HEAD + "GOTO/0,0,1e9\n" + TWO, 5, "expected coordinates of at most 100000 mm, got 1e+09; is the unit right?"),
    (APT_HEAD + "GOTO/0,0,1e999\n" + TWO, 5, "expected coordinates of at most 100000 mm, got inf"),
    (APT_HEAD + f"GOTO/0,0,{'1' * 50}\n" + TWO, 5, "expected a number with a decimal point"),
    (APT_HEAD + "GOTO/0,0,0,0,0,0\n" + TWO, 5, "expected a tool axis (I, J, K) with a length, got 0"),
    (APT_HEAD + TWO + "GOTO/1,0,0,0,1,1\n", 7, "expected another point than that of line 6, got the same with another"),
    (APT_HEAD.replace("ON", "OFF") + "GOTO/0,0,0,0,0,1\n", 5, "expected GOTO/x,y,z after MULTAX/OFF, got a tool axis"),
    (APT_HEAD.replace("ON", "MAYBE") + TWO, 3, "expected MULTAX or MULTAX/ON or MULTAX/OFF, got 'MULTAX/MAYBE'"),
    (TWO, 1, "expected UNITS before the first point, got none; write UNITS/MM or UNITS/INCHES above it"),
    ("FEDRAT/60\nUNITS/MM\n" + TWO, 1, "expected UNITS before the first feed"),
    ("UNITS/FURLONG\n" + TWO, 1, "expected UNITS/MM or UNITS/INCH or UNITS/INCHES, got 'UNITS/FURLONG'"),
    (APT_HEAD + TWO + "UNITS/INCHES\n", 7, "expected one unit in a file, got another one after the first point"),
    ("UNITS/MM\n" + TWO, 3, "expected a feed before the first move, got none; write FEDRAT or RAPID above it"),
    ("UNITS/MM\nFEDRAT/0.1,MMPR\n" + TWO, 2, "got '0.1,MMPR'; feeds are per minute"),
    ("UNITS/MM\nFEDRAT/0\n" + TWO, 2, "expected a feed above 0"),
    ("UNITS/MM\nFEDRAT/-5\n" + TWO, 2, "expected a feed above 0"),
    ("UNITS/MM\nFEDRAT/1e12\n" + TWO, 2, "expected a feed above 0 and up to"),
    ("UNITS/MM\nFEDRAT\n" + TWO, 2, "expected FEDRAT/v"),
    (APT_HEAD + "RAPID/ON\n" + TWO, 5, "expected RAPID, got 'RAPID/ON'"),
    (APT_HEAD + TWO + "FROM/0,0,0\n", 7, "expected FROM before the first point, got it after one; write GOTO"),
    (APT_HEAD + TWO + "LOADTL/2\n", 7, "expected one tool, got LOADTL after the first point"),
    (APT_HEAD + TWO + "FINI\nGOTO/2,0,0\n", 8, "expected nothing after FINI in line 7, got 'GOTO/2,0,0'"),
    (APT_HEAD + TWO + "GOTO/2,0,$\n", 7, "expected the rest of a statement after '$', got the end of the file"),
    (APT_HEAD + TWO + "GOTO/2,0,\x00\n", 7, "expected plain text, got control character 0x00"),
    (APT_HEAD, 0, "expected two points with a move at a feed between them, got none"),
    (APT_HEAD + "GOTO/0,0,0\nRAPID\nGOTO/1,0,0\n", 0, "expected two points with a move at a feed between them"),
    ("", 0, "expected two points"),
]
GCODE = [
    ("G90 F60\n" + MOVES, 1, "expected the unit before the first length, got none; write G21 (mm) or G20 above it"),
    ("G21 F60\n" + MOVES, 2, "expected G90 or G91 before the first point, got none; write G90 above it"),
    ("G21 G90 F60\nX0 Y0 Z0\n", 2, "expected G0, G1, G2 or G3 before the first point, got none"),
    ("G21 G90\n" + MOVES, 3, "expected a feed before the first move at a feed, got none; write F above it"),
    (GCODE_HEAD + MOVES + "G1 X5 A30\n", 7, "expected tool vectors I, J, K, got the axis A of a machine"),
    (GCODE_HEAD + MOVES + "G1 X5 C30\n", 7, "got the axis C of a machine; have CAM write tool vectors"),
    (GCODE_HEAD + "G53 Z0\n" + MOVES, 5, "got G53; have CAM write plain moves"),
    (GCODE_HEAD + "G41 D1\n" + MOVES, 5, "expected words"),
    (GCODE_HEAD + "G92 X0\n" + MOVES, 5, "got G92"),
    (GCODE_HEAD + "G93 F2\n" + MOVES, 5, "got G93"),
    (GCODE_HEAD + MOVES + "G81 X5 R2\n", 7, "got G81"),
    (GCODE_HEAD + MOVES + "M98 P100\n", 7, "got M98"),
    (GCODE_HEAD + MOVES + "G28\n", 7, "got G28"),
    (GCODE_HEAD + MOVES + "M6 T2\n", 7, "expected one tool, got M6 after the first point"),
    (GCODE_HEAD + MOVES + "G20\n", 7, "expected one unit in a file"),
    (GCODE_HEAD + MOVES + "G1 G2 X5\n", 7, "expected one code for the motion in a block, got G1, G2"),
    (GCODE_HEAD + MOVES + "X5 X6\n", 7, "expected X once in a block, got it twice"),
    (GCODE_HEAD + MOVES + "X#1\n", 7, "expected words of a letter and a number, got 'X#1'"),
    (GCODE_HEAD + MOVES + "X[1+2]\n", 7, "expected words of a letter and a number"),
    (GCODE_HEAD + MOVES + "X1.2.3\n", 7, "expected words of a letter and a number"),
    (GCODE_HEAD + MOVES + "X" + "9" * 60 + "\n", 7, "expected words of a letter and a number"),
    (GCODE_HEAD + MOVES + "IF X1\n", 7, "expected words of a letter and a number"),
    (GCODE_HEAD + MOVES + "X999999\n", 7, "expected coordinates of at most 100000 mm"),
    (GCODE_HEAD + MOVES + "(open\n", 7, "expected words of a letter and a number, got '(OPEN'"),
    (GCODE_HEAD + MOVES + "/X5\n", 7, "expected words of a letter and a number, got '/X5'"),
    (GCODE_HEAD + MOVES + "F0 X5\n", 7, "expected a feed above 0"),
    (GCODE_HEAD + MOVES + "X5 R3\n", 7, "expected R with G2 or G3, got it on a line"),
    (GCODE_HEAD + MOVES + "X5 I1\n", 7, "expected a tool vector I, J, K, got 1 of its three components"),
    (GCODE_HEAD + MOVES + "X5 I0 J0 K0\n", 7, "expected a tool axis (I, J, K) with a length, got 0"),
    (GCODE_HEAD + MOVES + "I1 J0 K1\n", 7, "got the same with another tool axis"),
    (GCODE_HEAD + MOVES + "G2 X5 Y5\n", 7, "expected a centre or a radius R for an arc, got neither"),
    (GCODE_HEAD + MOVES + "G2 X5 Y5 I2 R3\n", 7, "expected a centre or a radius R for an arc, got both"),
    (GCODE_HEAD + MOVES + "G2 X5 Y5 R1\n", 7, "expected a radius of at least 3.20156 mm"),
    (GCODE_HEAD + MOVES + "G2 X1 Y0 R5\n", 7, "expected I, J or K for a full circle, got a radius"),
    (GCODE_HEAD + MOVES + "G2 X5 Y5 I1 J0\n", 7, "expected both ends of an arc at one distance from its centre, got 1"),
    (GCODE_HEAD + MOVES + "G2 X5 Y5 I0 J0\n", 7, "expected a centre off the start of an arc, got it there"),
    (GCODE_HEAD + MOVES + "G2 X5 Y5 I1 K1\n", 7, "expected a centre in the plane G17, got K across it"),
    (GCODE_HEAD + "G2 X5 Y5 I1\n", 5, "expected X, Y and Z before the first arc"),
    (GCODE_HEAD + "G1 X5 Y5\n", 5, "expected X, Y and Z before the first move at a feed"),
    (GCODE_HEAD + "G91 G0 X5 Y5 Z5\n", 5, "expected X at G90 before the first one at G91, got a step from nowhere"),
    (GCODE_HEAD + MOVES + "P5\n", 7, "expected P with G4, got it alone"),
    (GCODE_HEAD + MOVES + "E5\n", 7, "got E5"),
    (GCODE_HEAD + MOVES + "M30\nX5\n", 8, "expected nothing after the end of the program in line 7, got 'X5'"),
    (GCODE_HEAD + "G0 X0 Y0 Z0\nX5\n", 0, "expected two points with a move at a feed between them, got none"),
]


@pytest.mark.parametrize(("text", "line", "words"), APT)
def test_spoilt_apt_is_refused_by_line(tmp_path: Path, text: str, line: int, words: str) -> None:
    with pytest.raises(InputError) as caught:
        read_apt(written(tmp_path, text), settings())

    assert_one_line(str(caught.value), "part.apt", line, words)


@pytest.mark.parametrize(("text", "line", "words"), GCODE)
def test_spoilt_g_code_is_refused_by_line(tmp_path: Path, text: str, line: int, words: str) -> None:
    with pytest.raises(InputError) as caught:
        read_gcode(written(tmp_path, text, "part.nc"), settings("part.nc"))

    assert_one_line(str(caught.value), "part.nc", line, words)


def assert_one_line(message: str, file: str, line: int, words: str) -> None:
    assert message.startswith(f"{file}:{line}: " if line else f"{file}: ")
    assert words in message
    assert "\n" not in message


@pytest.mark.parametrize("read", [read_apt, read_gcode])
def test_bytes_that_are_no_text_and_files_that_are_too_large_are_refused(tmp_path: Path, read) -> None:
    file = tmp_path / "part.apt"
    file.write_bytes(b"UNITS/MM\n\xff\xfe\n")
    with pytest.raises(InputError, match=r"^part\.apt:2: expected text in UTF-8, got byte 0xff$"):
        read(file, settings())
    with file.open("wb") as stream:
        stream.truncate(MOST_BYTES + 1)
    with pytest.raises(InputError, match=r"^part\.apt: expected a file of at most 30 MB, got a larger one$"):
        read(file, settings())


@pytest.mark.slow
def test_a_flood_of_empty_lines_takes_no_memory_beyond_the_file(tmp_path: Path) -> None:
    file = written(tmp_path, APT_HEAD + TWO + "\n" * 300_000 + "CIRCLE/0,0,0,0,0,1,5\n")
    tracemalloc.start()
    with pytest.raises(InputError, match=r"^part\.apt:300007: "):
        read_apt(file, settings())
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()

    assert peak < MOST_BYTES + 10 * file.stat().st_size  # a file is read into so many bytes at once
