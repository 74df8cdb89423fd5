"""Defects of KUKA programs: each is refused with its file and line."""

import re
from functools import cache

import numpy as np
import pytest
from builders.export_jobs import arm_on_a_rail, one_arm, two_arms

from cellplan.errors import InputError
from cellplan.model.report.exported import ExportJob
from cellplan.programs.formats.krl.writer import KRL

JOBS = {
    "marks": lambda: two_arms("kuka", blend=0.3, marks=(0, 7)),
    "pages": lambda: two_arms("kuka", blend=0.3, marks=(0, 7), split=8),
    "rail": lambda: arm_on_a_rail("kuka"),
}


@cache
def written(name: str) -> tuple[ExportJob, dict[str, str]]:
    job = JOBS[name]()
    return job, KRL.render(job)


def message(job: ExportJob, files: dict[str, str]) -> str:
    with pytest.raises(InputError) as error:
        KRL.read(job.frame, files)
    text = str(error.value)
    assert "\n" not in text
    assert text.isprintable()
    return text


LAST_WAIT = "WAIT FOR NOT $IN[101]\r\n"
POINT = r"DECL E6AXIS XP4={[^}]*}"
# what is replaced (once, the first one), what by, and the text that begins the refused line of the broken file
SOURCE = {
    "other name": ("DEF alpha()", "DEF alphas()", "DEF"),
    "name in capitals": ("DEF alpha()", "DEF ALPHA()", "DEF"),
    "no brackets": ("DEF alpha()", "DEF alpha", "DEF"),
    "parameters": ("DEF alpha()", "DEF alpha(x:IN)", "DEF"),
    "data instead": ("DEF alpha()", "DEFDAT alpha", "DEF"),
    "no first line": ("DEF alpha()\r\n", "", "BAS(#INITMOV"),
    "function": ("DEF alpha()", "DEFFCT INT alpha()", "DEF"),
    "no end": ("\r\nEND\r\n", "\r\n", "PTP XP20"),
    "cut off": ("PTP XP20\r\nEND\r\n", "PTP XP2", "PTP XP2", 2),
    "cut off after a line": ("PTP XP20\r\nEND\r\n", "PTP XP20\r\n", "PTP XP20"),
    "no last line end": ("END\r\n", "END", "END"),
    "text after the end": ("\r\nEND\r\n", "\r\nEND\r\nPTP XP1\r\n", "PTP XP1\r", 2),
    "two ends": ("PTP XP9 C_PTP\r\n", "END\r\nPTP XP9\r\n", "END"),
    "header later": ("PTP XP9 C_PTP\r\n", "&REL 2\r\nPTP XP9\r\n", "&REL 2"),
    "letter beyond ASCII": ("PTP XP9 C_PTP\r\n", "PTP XP9 ; Nähe\r\n", "PTP XP9"),
    "control character": ("PTP XP9 C_PTP\r\n", "PTP XP9\x0b\r\n", "PTP XP9"),
    "two kinds of line ends": ("PTP XP9 C_PTP\r\n", "PTP XP9\n", "PTP XP9"),
    "long line": ("PTP XP9 C_PTP\r\n", "PTP XP9 ; " + "x" * 470 + "\r\n", "PTP XP9"),
    "declaration later": ("PTP XP9 C_PTP\r\n", "EXT BAS (BAS_COMMAND :IN,REAL :IN )\r\nPTP XP9\r\n", "EXT"),
    "other declaration": ("BAS(#INIT", "DECL INT I\r\nBAS(#INIT", "DECL INT"),
    "declaration with a value": ("BAS(#INIT", "DECL INT I=1\r\nBAS(#INIT", "DECL INT"),
    "declared and not called": ("BAS(#INIT", "EXT alpha_001()\r\nBAS(#INIT", "EXT"),
    "declared with parameters": ("BAS(#INIT", "EXT alpha_001(INT :IN)\r\nBAS(#INIT", "EXT"),
    "other parameters of BAS": ("BAS(#INIT", "EXT BAS (REAL :IN)\r\nBAS(#INIT", "EXT"),
    "no INITMOV": ("BAS(#INITMOV,0)\r\n", "", "PTP XP1\r"),
    "INITMOV of something": ("BAS(#INITMOV,0)", "BAS(#INITMOV,1)", "BAS"),
    "INITMOV twice": ("$ADVANCE", "BAS(#INITMOV,0)\r\n$ADVANCE", "BAS(#INITMOV", 2),
    "other BAS": ("$ADVANCE", "BAS(#ACC_CP,50)\r\n$ADVANCE", "BAS(#ACC"),
    "no ADVANCE": ("$ADVANCE=3\r\n", "", "PTP XP1\r"),
    "large ADVANCE": ("$ADVANCE=3", "$ADVANCE=6", "$ADVANCE"),
    "ADVANCE with a comma": ("$ADVANCE=3", "$ADVANCE=3.0", "$ADVANCE"),
    "ADVANCE in motion": ("PTP XP9 C_PTP\r\n", "$ADVANCE=3\r\nPTP XP9\r\n", "$ADVANCE=3\r\nPTP"),
    "no tool": ("$TOOL=$NULLFRAME\r\n", "", "PTP XP1\r"),
    "other tool": ("$TOOL=$NULLFRAME", "$TOOL=TOOL_DATA[1]", "$TOOL"),
    "tool by value": ("$TOOL=$NULLFRAME", "$TOOL={X 0,Y 0,Z 0,A 0,B 0,C 0}", "$TOOL"),
    "no base": ("$BASE=$NULLFRAME\r\n", "", "PTP XP1\r"),
    "other base": ("$BASE=$NULLFRAME", "$BASE=BASE_DATA[4]", "$BASE"),
    "share of nothing": ("$APO.CPTP=60", "$APO.CPTP=0", "$APO"),
    "share of too much": ("$APO.CPTP=60", "$APO.CPTP=101", "$APO"),
    "no share": ("$APO.CPTP=60\r\n", "", "PTP XP2 C_PTP"),
    "no speed": ("BAS(#VEL_PTP,10)\r\n", "", "PTP XP1\r"),
    "speed of nothing": ("BAS(#VEL_PTP,10)", "BAS(#VEL_PTP,0)", "BAS(#VEL_PTP,0"),
    "speed of too much": ("BAS(#VEL_PTP,10)", "BAS(#VEL_PTP,100.1)", "BAS(#VEL_PTP,100.1"),
    "speed below nothing": ("BAS(#VEL_PTP,10)", "BAS(#VEL_PTP,-10)", "BAS(#VEL_PTP,-"),
    "point of nowhere": ("PTP XP9 C_PTP\r\n", "PTP XP99\r\n", "PTP XP99"),
    "motion left out": ("PTP XP9 C_PTP\r\n", "", "PTP XP10"),
    "motion twice": ("PTP XP9 C_PTP\r\n", "PTP XP9\r\nPTP XP9\r\n", "PTP XP9\r\nPTP XP10"),
    "motions in another order": ("PTP XP9 C_PTP\r\nPTP XP10 C_PTP\r\n", "PTP XP10\r\nPTP XP9\r\n", "PTP XP10"),
    "straight line": ("PTP XP9 C_PTP\r\n", "LIN XP9\r\n", "LIN"),
    "spline motion": ("PTP XP9 C_PTP\r\n", "SPTP XP9\r\n", "SPTP"),
    "spline block": ("PTP XP9 C_PTP\r\n", "SPLINE\r\nPTP XP9\r\nENDSPLINE\r\n", "SPLINE"),
    "point by value": ("PTP XP9 C_PTP\r\n", "PTP {A1 0,A2 0,A3 0,A4 0,A5 0,A6 0}\r\n", "PTP {"),
    "relative motion": ("PTP XP9 C_PTP\r\n", "PTP_REL {A1 1}\r\n", "PTP_REL"),
    "other rounding": ("PTP XP9 C_PTP\r\n", "PTP XP9 C_DIS\r\n", "PTP XP9"),
    "two rounding words": ("PTP XP9 C_PTP\r\n", "PTP XP9 C_PTP C_DIS\r\n", "PTP XP9"),
    "last row rounded": ("PTP XP20\r\n", "PTP XP20 C_PTP\r\n", "END"),
    "mark rounded": ("PTP XP8\r\n", "PTP XP8 C_PTP\r\n", "WAIT FOR $IN[101]\r\n", 2),
    "wait for time": ("PTP XP9 C_PTP\r\n", "WAIT SEC 0.5\r\nPTP XP9\r\n", "WAIT SEC"),
    "loop": ("PTP XP9 C_PTP\r\n", "LOOP\r\nPTP XP9\r\nENDLOOP\r\n", "LOOP"),
    "condition": ("PTP XP9 C_PTP\r\n", "IF TRUE THEN\r\nPTP XP9\r\nENDIF\r\n", "IF"),
    "halt": ("PTP XP9 C_PTP\r\n", "HALT\r\nPTP XP9\r\n", "HALT"),
    "two statements": ("PTP XP9 C_PTP\r\nPTP XP10", "PTP XP9 PTP XP10", "PTP XP9"),
    "call of another program": ("PTP XP9 C_PTP\r\n", "gripper()\r\nPTP XP9\r\n", "gripper"),
    "call of a page": ("PTP XP9 C_PTP\r\n", "alpha_001()\r\nPTP XP9\r\n", "alpha_001"),
    "signal before all motions": ("PTP XP1\r\n", "$OUT[10]=TRUE\r\nPTP XP1\r\n", "$OUT[10]=TRUE\r\nPTP"),
    "signal of no mark": ("PTP XP9 C_PTP\r\n", "PTP XP9\r\n$OUT[10]=TRUE\r\n", "$OUT[10]=TRUE\r\nPTP"),
    "signal to the world": ("PTP XP9 C_PTP\r\n", "PTP XP9\r\nPULSE($OUT[10],TRUE,1)\r\n", "PULSE"),
    "other output": ("$OUT[10]=TRUE", "$OUT[11]=TRUE", "$OUT[11]"),
    "other state": ("$OUT[10]=TRUE", "$OUT[10]=FALSE", "$OUT[10]=FALSE", 2),
    "state of no word": ("$OUT[10]=TRUE", "$OUT[10]=1", "$OUT[10]=1"),
    "other input": ("WAIT FOR $IN[101]", "WAIT FOR $IN[102]", "WAIT FOR $IN[102]"),
    "input turned round": ("WAIT FOR NOT $IN[101]", "WAIT FOR $IN[101]==TRUE", "WAIT FOR $IN[101]==TRUE"),
    "two negations": ("WAIT FOR NOT $IN[101]", "WAIT FOR NOT $IN[101]==TRUE", "WAIT FOR NOT"),
    "handshake without its wait": ("WAIT FOR NOT $IN[101]\r\n", "", "$OUT[10]=FALSE", 2),
    "handshake without its end": (f"{LAST_WAIT}$OUT[10]=FALSE\r\n", LAST_WAIT, "BAS(#VEL_PTP,100"),
    "output not lowered at the start": ("$OUT[10]=FALSE\r\n", "", "WAIT FOR $IN[101]"),
    "output raised at the start": ("$OUT[10]=FALSE\r\n", "$OUT[10]=TRUE\r\n", "$OUT[10]=TRUE"),
    "output lowered twice": ("PTP XP1\r\n", "$OUT[10]=FALSE\r\nPTP XP1\r\n", "$OUT[10]=FALSE", 2),
    "another output lowered": ("$OUT[10]=FALSE\r\n", "$OUT[11]=FALSE\r\n", "$OUT[11]=FALSE"),
    "wait at the start": ("$OUT[10]=FALSE\r\n", "WAIT FOR NOT $IN[101]\r\n", "WAIT FOR NOT $IN[101]"),
    "output lowered after the first motion": (
        "$OUT[10]=FALSE\r\nBAS(#VEL_PTP,10)\r\nPTP XP1\r\n",
        "BAS(#VEL_PTP,10)\r\nPTP XP1\r\n$OUT[10]=FALSE\r\n",
        "$OUT[10]=FALSE",
    ),
    "handshake in another order": ("WAIT FOR $IN[101]\r\n$OUT", "$OUT", "$OUT[10]=TRUE"),
    "motion in a handshake": ("$OUT[10]=TRUE\r\n", "$OUT[10]=TRUE\r\nPTP XP2\r\n", "PTP XP2"),
    "handshake twice": (
        f"{LAST_WAIT}$OUT[10]=FALSE\r\n",
        f"{LAST_WAIT}$OUT[10]=FALSE\r\nWAIT FOR $IN[101]\r\n",
        "WAIT FOR $IN[101]\r\nBAS",
    ),
    "no motion at all": (re.compile(r"BAS\(#VEL_PTP,10\).*(?=END)", re.S), "", "END"),
}
DATA = {
    "other name": ("DEFDAT alpha", "DEFDAT beta", "DEFDAT"),
    "name in capitals": ("DEFDAT alpha", "DEFDAT Alpha", "DEFDAT"),
    "brackets": ("DEFDAT alpha", "DEFDAT alpha()", "DEFDAT"),
    "no first line": ("DEFDAT alpha\r\n", "", "DECL E6AXIS XP1="),
    "no end": ("ENDDAT\r\n", "", "DECL E6AXIS XP20="),
    "cut off": (re.compile(r",A6[^}]*\}\r\nENDDAT\r\n"), "", "DECL E6AXIS XP20="),
    "text after the end": ("ENDDAT\r\n", "ENDDAT\r\nDECL INT I\r\n", "DECL INT"),
    "point left out": (re.compile(POINT + "\r\n"), "", "src:PTP XP4"),
    "point too much": (
        "ENDDAT",
        "DECL E6AXIS XP99={A1 0,A2 0,A3 0,A4 0,A5 0,A6 0,E1 0,E2 0,E3 0,E4 0,E5 0,E6 0}\r\nENDDAT",
        "DECL E6AXIS XP99",
    ),
    "point twice": ("XP5=", "XP4=", "DECL E6AXIS XP4=", 2),
    "point twice in small letters": ("XP5=", "xp4=", "DECL E6AXIS xp4="),
    "long name": ("XP4=", "X" * 25 + "=", "DECL E6AXIS XXX"),
    "name of digits": ("XP4=", "4=", "DECL E6AXIS 4"),
    "other type": ("DECL E6AXIS XP4", "DECL E6POS XP4", "DECL E6POS"),
    "type of six": ("DECL E6AXIS XP4", "DECL AXIS XP4", "DECL AXIS"),
    "no value": (re.compile(r"(?<=XP4)={[^}]*}"), "", "DECL E6AXIS XP4"),
    "axis left out": (re.compile(r"(?<=XP4=\{)A1 [^,]*,"), "", "DECL E6AXIS XP4"),
    "axis twice": (re.compile(r"(XP4=\{A1 [^,]*),A2"), r"\1,A1", "DECL E6AXIS XP4"),
    "axis 7": (re.compile(r"(XP4=.*?)A6"), r"\1A7", "DECL E6AXIS XP4"),
    "gap in the external axes": (re.compile(r"(XP4=.*?),E2 0.00000"), r"\1", "DECL E6AXIS XP4"),
    "fewer axes than before": (re.compile(r"(XP4=.*?),E6 0.00000"), r"\1", "DECL E6AXIS XP4"),
    "external axis of no robot": (re.compile(r"(XP4=.*?),E6 0.00000"), r"\1,E6 1.00000", "DECL E6AXIS XP4"),
    "no number": (re.compile(r"(?<=XP4=\{)A1 [^,]*"), "A1 x", "DECL E6AXIS XP4"),
    "number with an exponent": (re.compile(r"(?<=XP4=\{)A1 [^,]*"), "A1 1.0E1", "DECL E6AXIS XP4"),
    "number without end": (re.compile(r"(?<=XP4=\{)A1 [^,]*"), "A1 inf", "DECL E6AXIS XP4"),
    "number without digits": (re.compile(r"(?<=XP4=\{)A1 [^,]*"), "A1 .5", "DECL E6AXIS XP4"),
    "two numbers": (re.compile(r"(?<=XP4=\{)A1 [^,]*"), "A1 1 2", "DECL E6AXIS XP4"),
    "equals sign": (re.compile(r"(?<=XP4=\{)A1 "), "A1=", "DECL E6AXIS XP4"),
    "comma as the point": (re.compile(r"(?<=XP4=\{)A1 [^,]*"), "A1 1,5", "DECL E6AXIS XP4"),
    "comma at the end": (re.compile(r"(XP4=.*?)\}"), r"\1,}", "DECL E6AXIS XP4"),
    "bracket left out": (re.compile(r"(XP4=.*?)\}"), r"\1", "DECL E6AXIS XP4"),
    "text after a point": (re.compile(r"(XP4=.*?\})"), r"\1 x", "DECL E6AXIS XP4"),
    "degree sign": (re.compile(r"(?<=XP4=\{)A1 [^,]*"), "A1 1°", "DECL E6AXIS XP4"),
    "assignment": ("ENDDAT", "XP4.A1=0\r\nENDDAT", "XP4.A1"),
    "two kinds of line ends": ("DEFDAT alpha\r\n", "DEFDAT alpha\n", "DEFDAT"),
}
# the file, what is replaced in it, what by, the file that is refused, and the text that begins the refused line
PAGES = {
    "call left out": ("alpha.src", "alpha_002()\r\nalpha_003()", "alpha_003()", "alpha.src", "alpha_003()"),
    "last call left out": ("alpha.src", "alpha_003()\r\nEND", "END", "alpha.src", "EXT alpha_003"),
    "call twice": ("alpha.src", "\r\nalpha_001()", "\r\nalpha_001()\r\nalpha_001()", "alpha.src", "alpha_001", 2),
    "calls in another order": (
        "alpha.src",
        "alpha_001()\r\nalpha_002()",
        "alpha_002()\r\nalpha_001()",
        "alpha.src",
        "alpha_002()",
    ),
    "call with a parameter": ("alpha.src", "\r\nalpha_001()", "\r\nalpha_001(1)", "alpha.src", "alpha_001(1)"),
    "call in capitals": ("alpha.src", "\r\nalpha_001()", "\r\nALPHA_001()", "alpha.src", "ALPHA_001"),
    "motion beside pages": ("alpha.src", "alpha_003()\r\nEND", "alpha_003()\r\nPTP XP1\r\nEND", "alpha.src", "PTP XP1"),
    "signal beside pages": (
        "alpha.src",
        "alpha_003()\r\nEND",
        "alpha_003()\r\nWAIT FOR $IN[101]\r\nEND",
        "alpha.src",
        "WAIT FOR",
    ),
    "declared twice": ("alpha.src", "EXT alpha_001()", "EXT alpha_001()\r\nEXT alpha_001()", "alpha.src", "EXT", 2),
    "points beside pages": (
        "alpha.dat",
        "ENDDAT",
        "DECL E6AXIS XP1={A1 0,A2 0,A3 0,A4 0,A5 0,A6 0}\r\nENDDAT",
        "alpha.dat",
        "DECL",
    ),
    "settings in a page": ("alpha_002.src", "BAS(", "$ADVANCE=3\r\nBAS(", "alpha_002.src", "$ADVANCE"),
    "INITMOV in a page": ("alpha_001.src", "BAS(", "BAS(#INITMOV,0)\r\nBAS(", "alpha_001.src", "BAS(#INITMOV"),
    "call in a page": ("alpha_002.src", "BAS(", "alpha_003()\r\nBAS(", "alpha_002.src", "alpha_003"),
    "declaration in a page": ("alpha_002.src", "BAS(", "EXT alpha_003()\r\nBAS(", "alpha_002.src", "EXT"),
    "name of another page": ("alpha_002.src", "DEF alpha_002()", "DEF alpha_003()", "alpha_002.src", "DEF"),
    "data of another page": ("alpha_002.dat", "DEFDAT alpha_002", "DEFDAT alpha_003", "alpha_002.dat", "DEFDAT"),
    "point of another page": ("alpha_002.src", "PTP XP9", "PTP XP8", "alpha_002.src", "PTP XP8"),
    "first row again": ("alpha_002.src", "PTP XP9", "PTP XP8\r\nPTP XP9", "alpha_002.src", "PTP XP8"),
    "last row of a page rounded": ("alpha_002.src", "PTP XP16", "PTP XP16 C_PTP", "alpha_002.src", "END"),
    "page cut off": ("alpha_003.src", "PTP XP20\r\nEND\r\n", "", "alpha_003.src", "PTP XP19"),
    "handshake cut off": ("alpha_001.src", re.compile(r"\$OUT\[10\]=FALSE\r\nEND"), "END", "alpha_001.src", "END"),
}


def line_of(text: str, begin: str, which: int) -> int:
    """Number of the line that begins with a text, the first or a later one of them."""
    places = [match.start() for match in re.finditer(rf"(?m)^{re.escape(begin)}", text)]
    return text.count("\n", 0, places[which - 1]) + 1


def break_file(text: str, old: str | re.Pattern[str], new: str) -> str:
    broken = old.sub(new, text, count=1) if isinstance(old, re.Pattern) else text.replace(old, new, 1)
    assert broken != text
    return broken


@pytest.mark.parametrize("defect", SOURCE)
def test_a_broken_source_file_is_refused_with_its_line(defect: str) -> None:
    old, new, begin, *which = SOURCE[defect]
    job, files = written("marks")
    text = break_file(files["alpha.src"], old, new)

    said = message(job, {**files, "alpha.src": text})

    assert said.startswith(f"alpha.src:{line_of(text, begin, *which or [1])}: expected ")


@pytest.mark.parametrize("defect", DATA)
def test_a_broken_data_file_is_refused_with_its_line(defect: str) -> None:
    old, new, begin, *which = DATA[defect]
    job, files = written("marks")
    text = break_file(files["alpha.dat"], old, new)
    place, where = ("alpha.src", files["alpha.src"]) if begin.startswith("src:") else ("alpha.dat", text)

    said = message(job, {**files, "alpha.dat": text})

    assert said.startswith(f"{place}:{line_of(where, begin.removeprefix('src:'), *which or [1])}: expected ")


@pytest.mark.parametrize("defect", PAGES)
def test_a_broken_page_is_refused_with_its_line(defect: str) -> None:
    file, old, new, place, begin, *which = PAGES[defect]
    job, files = written("pages")
    broken = {**files, file: break_file(files[file], old, new)}

    said = message(job, broken)

    assert said.startswith(f"{place}:{line_of(broken[place], begin, *which or [1])}: expected ")


@pytest.mark.parametrize("file", ["alpha.src", "beta.dat", "alpha_002.src", "beta_003.dat"])
def test_a_missing_file_is_named(file: str) -> None:
    job, files = written("pages")

    said = message(job, {path: text for path, text in files.items() if path != file})

    assert said == f"{file}: expected a file, got none"


@pytest.mark.parametrize("file", ["gamma.src", "alpha_004.dat", "Alpha.src", "notes.txt"])
def test_a_file_too_many_is_named(file: str) -> None:
    job, files = written("pages")

    assert message(job, {**files, file: files["alpha.src"]}) == f"{file}: expected no such file in this export"


@pytest.mark.parametrize("file", ["alpha.src", "alpha.dat"])
def test_an_empty_file_is_refused(file: str) -> None:
    job, files = written("marks")

    assert message(job, {**files, file: ""}).startswith(f"{file}:1: expected DEF")
    assert message(job, {**files, file: "; nothing\r\n"}).startswith(f"{file}:1: expected DEF")


def test_one_line_that_ends_otherwise_is_found_in_both_kinds_of_files() -> None:
    job, files = written("marks")
    text = files["alpha.src"].replace("\r\n", "\n").replace("PTP XP9 C_PTP\n", "PTP XP9 C_PTP\r\n")

    assert message(job, {**files, "alpha.src": text}).startswith(
        f"alpha.src:{line_of(text, 'PTP XP9', 1)}: expected one"
    )


def test_robots_that_do_not_meet_equally_often_are_refused() -> None:
    job, files = written("marks")
    without = re.sub(r"(?s)(PTP XP1\r\n).*?(?=BAS)", r"\1", files["beta.src"], count=1)

    assert without != files["beta.src"]
    assert "as many marks" in message(job, {**files, "beta.src": without})


def test_a_rail_without_its_axis_is_refused() -> None:
    job, files = written("rail")
    text = re.sub(r",E1[^}]*", "", files["alpha.dat"])

    assert message(job, {**files, "alpha.dat": text}).startswith(
        f"alpha.dat:{line_of(text, 'DECL', 1)}: expected values for the 7 axes of the robot and for no other"
    )


def test_signals_of_a_cell_with_one_robot_are_refused() -> None:
    job = one_arm("kuka")
    files = KRL.render(job)
    text = files["alpha.src"].replace("PTP XP9\r\n", "PTP XP9\r\n$OUT[1]=TRUE\r\n")

    assert message(job, {**files, "alpha.src": text}).startswith(f"alpha.src:{line_of(text, '$OUT', 1)}: expected")


@pytest.mark.parametrize("file", ["alpha.src", "alpha.dat"])
def test_a_file_that_was_cut_off_anywhere_is_refused(file: str) -> None:
    job, files = written("marks")

    for end in np.random.default_rng(0).integers(0, len(files[file]), 40):
        assert message(job, {**files, file: files[file][:end]}).startswith(f"{file}:")
