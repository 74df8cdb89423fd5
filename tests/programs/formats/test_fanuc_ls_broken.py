"""Defects of FANUC programs: each is refused with its file and line."""

import re
from functools import cache

import numpy as np
import pytest
from builders.export_jobs import one_arm
from builders.fanuc_jobs import group_job, waiting_job
from programs.formats.test_krl_broken import break_file, line_of

from cellplan.errors import InputError
from cellplan.model.report.exported import ExportJob
from cellplan.programs.formats.fanuc_ls.writer import FANUC_LS

JOBS = {
    "marks": lambda: waiting_job(blend=0.5, marks=(0, 7)),
    "pages": lambda: waiting_job(blend=0.5, marks=(0, 7), split=8),
    "groups": lambda: group_job(blend=0.5),
}
MAIN = {"marks": "ALPHA.ls", "groups": "R30.ls"}


@cache
def written(name: str) -> tuple[ExportJob, dict[str, str]]:
    job = JOBS[name]()
    return job, FANUC_LS.render(job)


def message(job: ExportJob, files: dict[str, str]) -> str:
    with pytest.raises(InputError) as error:
        FANUC_LS.read(job.frame, files)
    text = str(error.value)
    assert "\n" not in text
    assert text.isprintable()
    return text


MOVE = re.compile(r"(?<=J P\[9\] )\S+ \S+")
WAIT = "WAIT DI[101]=OFF ;\r\n"
# what is replaced (once, the first one), what by, and the text that begins the refused line of the broken file
ONE = {
    "other name": ("/PROG ALPHA", "/PROG BETA", "/PROG"),
    "name in small letters": ("/PROG ALPHA", "/PROG alpha", "/PROG"),
    "no first line": ("/PROG ALPHA\r\n", "", "/ATTR"),
    "no attributes": ("/ATTR\r\n", "", "/MN"),
    "no motions": ("/MN\r\n", "", "/POS"),
    "no points": ("/POS\r\n", "", "/END"),
    "no end": ("/END\r\n", "", "};", 20),
    "text behind the end": ("/END\r\n", "/END\r\nP[99]{};\r\n", "P[99]"),
    "another section": ("/MN\r\n", "/APPL\r\n  ARC : TRUE ;\r\n/MN\r\n", "/APPL"),
    "two kinds of line ends": ("/MN\r\n", "/MN\n", "/MN"),
    "letter beyond ASCII": ("! promise", "! Nähe", "   1:"),
    "no groups": ("DEFAULT_GROUP = 1,*,*,*,*;\r\n", "", "/ATTR"),
    "other group": ("1,*,*,*,*", "*,1,*,*,*", "/ATTR"),
    "two groups": ("1,*,*,*,*", "1,1,*,*,*", "/ATTR"),
    "four slots": ("1,*,*,*,*", "1,*,*,*", "DEFAULT"),
    "attribute twice": ("OWNER = MNEDITOR;", "OWNER = MNEDITOR;\r\nOWNER = MNEDITOR;", "OWNER", 2),
    "unknown attribute": ("OWNER", "MACRO", "MACRO"),
    "comma behind an attribute": ("READ_WRITE;", "READ_WRITE,", "PROTECT"),
    "semicolon within TCD": ("TIME_SLICE = 0,", "TIME_SLICE = 0;", "TIME_SLICE"),
    "long comment": ('"test"', '"a program of an arm"', "COMMENT"),
    "line without a number": ("   9:", "    ", "      UFRAME"),
    "number again": ("   9:", "   8:", "   8:", 2),
    "number too large": ("  10:", "10000:", "10000:"),
    "line without an end": ("UTOOL_NUM=1 ;", "UTOOL_NUM=1", "  10:"),
    "two instructions": ("UTOOL_NUM=1 ;", "UTOOL_NUM=1 ; J P[1] 10% FINE ;", "  10:"),
    "remark that ends": ("! promise", "! ; J P[1]", "   1:"),
    "no user frame": ("   9:  UFRAME_NUM=0 ;\r\n", "", "  12:"),
    "other user frame": ("UFRAME_NUM=0", "UFRAME_NUM=1", "   9:"),
    "other tool": ("UTOOL_NUM=1", "UTOOL_NUM=2", "  10:"),
    "tool of another group": ("UTOOL_NUM=1", "UTOOL_NUM[GP2]=1", "  10:"),
    "tool twice": ("UFRAME_NUM=0", "UTOOL_NUM=1", "  10:"),
    "tool in motion": (re.compile(r"(?<=  19:)J P\[4\] [^;]*"), "  UTOOL_NUM=1 ", "  19:"),
    "tool by a register": ("UTOOL_NUM=1", "UTOOL_NUM=R[1]", "  10:"),
    "point of nowhere": ("J P[9]", "J P[99]", "  28:"),
    "point twice": ("J P[9]", "J P[8]", "  28:"),
    "point of a register": ("J P[9]", "J PR[9]", "  28:"),
    "motion left out": (re.compile(r"  28:J P\[9\][^\n]*\n"), "", "P[9]{"),
    "motion twice": (re.compile(r"  38:J P\[19\]"), "  38:J P[18]", "  38:"),
    "straight line": ("J P[9]", "L P[9]", "  28:"),
    "no speed": (MOVE, "FINE", "  28:"),
    "speed of nothing": (MOVE, "0% FINE", "  28:"),
    "speed of too much": (MOVE, "101% FINE", "  28:"),
    "speed of a part": (MOVE, "0.5% FINE", "  28:"),
    "duration": (MOVE, "40msec FINE", "  28:"),
    "speed of a tool": (MOVE, "100mm/sec FINE", "  28:"),
    "no ending": (MOVE, "10%", "  28:"),
    "too much CNT": (MOVE, "10% CNT101", "  28:"),
    "corner radius": (MOVE, "10% CR5", "  28:"),
    "acceleration": (MOVE, "10% FINE ACC50", "  28:"),
    "offset": (MOVE, "10% FINE Offset,PR[1]", "  28:"),
    "last row passed": (re.compile(r"(J P\[20\] \d+%) FINE"), r"\1 CNT100", "/END"),
    "mark passed": (re.compile(r"(J P\[8\] \d+%) FINE"), r"\1 CNT100", "  24:"),
    "wait for a time": ("J P[9]", "  WAIT 1.00(sec) ; J P[9]", "  28:"),
    "jump": (re.compile(r"(?<=  28:)[^;]*"), "  JMP LBL[1] ", "  28:"),
    "call": (re.compile(r"(?<=  28:)[^;]*"), "  CALL GRIPPER ", "  28:"),
    "call of a page": (re.compile(r"(?<=  28:)[^;]*"), "  CALL ALPHA_001 ", "  28:"),
    "pulse": ("DO[10]=ON", "DO[10]=PULSE,0.1sec", "  14:"),
    "other output": ("DO[10]=ON", "DO[11]=ON", "  13:"),
    "other state": ("DO[10]=ON", "DO[10]=OFF", "  13:"),
    "other input": ("WAIT DI[101]=ON", "WAIT DI[102]=ON", "  13:"),
    "handshake without its wait": (re.compile(r"  15:  WAIT[^\n]*\n"), "", "  13:"),
    "handshake without its end": (re.compile(r"  16:  DO[^\n]*\n"), "", "  13:"),
    "output not lowered": (re.compile(r"  11:  DO[^\n]*\n"), "", "  12:"),
    "output raised at the start": ("DO[10]=OFF", "DO[10]=ON", "  11:"),
    "no handshake": (
        re.compile(r"(?s)  13:  WAIT.*?DO\[10\]=OFF ;\r\n(.*?)  2\d:  WAIT.*?DO\[10\]=OFF ;\r\n"),
        r"\1",
        "  11:",
    ),
    "point left out": (re.compile(r"(?s)P\[4\]\{.*?\};\r\n"), "", "  19:"),
    "point too much": (re.compile(r"(?s)(P\[4\])(\{.*?\};\r\n)"), r"\1\2P[99]\2", "P[99]"),
    "point there twice": (re.compile(r"(?s)(P\[4\]\{.*?\};\r\n)"), r"\1\1", "P[4]{", 2),
    "point without its end": ("};\r\nP[5]{", "P[5]{", "P[4]{"),
    "no group": (re.compile(r"(?s)(P\[4\]\{\r\n)   GP1:\r\n"), r"\1", "P[4]{"),
    "another group": (re.compile(r"(?s)(P\[4\]\{\r\n)   GP1:"), r"\1   GP2:", "P[4]{"),
    "another user frame": (re.compile(r"(?s)(P\[4\]\{.*?)UF : 0"), r"\1UF : 1", "P[4]{"),
    "another tool": (re.compile(r"(?s)(P\[4\]\{.*?)UT : 1"), r"\1UT : 2", "P[4]{"),
    "place instead": (re.compile(r"(?s)(P\[4\]\{.*?)UT : 1,"), r"\1UT : 1, CONFIG : 'N U T, 0, 0, 0',", "P[4]{"),
    "axis left out": (re.compile(r"(?s)(P\[4\]\{.*?)J1 = [^,]*, "), r"\1", "P[4]{"),
    "axis twice": (re.compile(r"(?s)(P\[4\]\{.*?)J2"), r"\1J1", "P[4]{"),
    "axis too much": (re.compile(r"(?s)(P\[4\]\{.*?J6 = \S+ deg)"), r"\1, E1 = 0.0 mm", "P[4]{"),
    "axes in another order": (re.compile(r"(?s)(P\[4\]\{.*?)(J1 = [^,]*), (J2 = [^,]*)"), r"\1\3, \2", "P[4]{"),
    "millimetres": (re.compile(r"(?s)(P\[4\]\{.*?J1 = \S+) deg"), r"\1 mm", "P[4]{"),
    "no number": (re.compile(r"(?s)(P\[4\]\{.*?J1 =) \S+"), r"\1 x", "P[4]{"),
    "number with an exponent": (re.compile(r"(?s)(P\[4\]\{.*?J1 =) \S+"), r"\1 1.0E1", "P[4]{"),
    "comma behind the last axis": (re.compile(r"(?s)(P\[4\]\{.*?J6 = \S+ deg)"), r"\1,", "P[4]{"),
    "no comma": (re.compile(r"(?s)(P\[4\]\{.*?J1 = \S+ deg),"), r"\1", "P[4]{"),
}
GROUPS = {
    "group missing in a point": (re.compile(r"(?s)(P\[4\]\{.*?)   GP2:.*?(?=   GP3)"), r"\1", "P[4]{"),
    "group missing at all": ("DEFAULT_GROUP = 1,1,1,*,*", "DEFAULT_GROUP = 1,1,*,*,*", "/ATTR"),
    "group twice in a point": (re.compile(r"(?s)(P\[4\]\{.*?)GP2"), r"\1GP1", "P[4]{"),
    "rail left out": (re.compile(r"(?s)(P\[4\]\{.*?J6.*?J6 = \S+ deg),\s+E1 = \S+ mm"), r"\1", "P[4]{"),
    "frame of a group left out": (re.compile(r"[^\n]*UTOOL_NUM\[GP3\]=1 ;\r\n"), "", "  29:"),
    "speed instead of a duration": (re.compile(r"(?<=J P\[4\] )\S+"), "10%", "  32:"),
    "duration of nothing": (re.compile(r"(?<=J P\[4\] )\S+"), "0msec", "  32:"),
    "duration of too much": (re.compile(r"(?<=J P\[4\] )\S+"), "32.1sec", "  32:"),
    "duration to the first row": (re.compile(r"(?<=J P\[1\] )\S+"), "1000msec", "  29:"),
    "signal": (re.compile(r"(?<=  32:)[^;]*"), "  DO[1]=ON ", "  32:"),
}
# the file, what is replaced in it, what by, the file that is refused, and the text that begins the refused line
PAGES = {
    "call left out": ("ALPHA.ls", re.compile(r"[^\n]*CALL ALPHA_002 ;\r\n"), "", "ALPHA.ls", "  14:"),
    "calls in another order": ("ALPHA.ls", "CALL ALPHA_001", "CALL ALPHA_002", "ALPHA.ls", "  12:"),
    "call twice": ("ALPHA.ls", "CALL ALPHA_002", "CALL ALPHA_001", "ALPHA.ls", "  13:"),
    "signal behind pages": ("ALPHA.ls", "/POS", "  15:  DO[10]=OFF ;\r\n/POS", "ALPHA.ls", "  15:"),
    "settings in a page": ("ALPHA_002.ls", re.compile(r"   9:J[^;]*"), "   9:  UTOOL_NUM=1 ", "ALPHA_002.ls", "   9:"),
    "call in a page": (
        "ALPHA_002.ls",
        re.compile(r"  10:J[^;]*"),
        "  10:  CALL ALPHA_003 ",
        "ALPHA_002.ls",
        "  10:",
    ),
    "name of another page": ("ALPHA_002.ls", "/PROG ALPHA_002", "/PROG ALPHA_003", "ALPHA_002.ls", "/PROG"),
    "last row of a page passed": (
        "ALPHA_002.ls",
        re.compile(r"(J P\[8\] \d+%) FINE"),
        r"\1 CNT100",
        "ALPHA_002.ls",
        "/END",
    ),
    "handshake cut off": ("ALPHA_001.ls", re.compile(r"[^\n]*DO\[10\]=OFF ;\r\n/POS"), "/POS", "ALPHA_001.ls", "  21:"),
}


@pytest.mark.parametrize(("name", "defect"), [("marks", key) for key in ONE] + [("groups", key) for key in GROUPS])
def test_a_broken_program_is_refused_with_its_line(name: str, defect: str) -> None:
    old, new, begin, *which = (ONE if name == "marks" else GROUPS)[defect]
    job, files = written(name)
    file = MAIN[name]
    text = break_file(files[file], old, new)

    said = message(job, {**files, file: text})

    assert said.startswith(f"{file}:{line_of(text, begin, *which or [1])}: expected ")


@pytest.mark.parametrize("defect", PAGES)
def test_a_broken_page_is_refused_with_its_line(defect: str) -> None:
    file, old, new, place, begin = PAGES[defect]
    job, files = written("pages")
    broken = {**files, file: break_file(files[file], old, new)}

    said = message(job, broken)

    assert said.startswith(f"{place}:{line_of(broken[place], begin, 1)}: expected ")


def test_missing_and_further_files_are_named() -> None:
    job, files = written("pages")

    for file in ("ALPHA.ls", "BETA_003.ls"):
        left = {path: text for path, text in files.items() if path != file}
        assert message(job, left) == f"{file}: expected a file, got none"
    for file in ("ALPHA_004.ls", "alpha.ls", "notes.txt"):
        said = message(job, {**files, file: files["ALPHA.ls"]})
        assert said == f"{file}: expected no such file in this export"


def test_an_empty_file_is_refused() -> None:
    job, files = written("marks")

    assert message(job, {**files, "ALPHA.ls": ""}).startswith("ALPHA.ls:1: expected an ended last line")
    assert message(job, {**files, "ALPHA.ls": "\r\n"}).startswith("ALPHA.ls:1: expected /PROG ALPHA")


def test_robots_that_do_not_meet_equally_often_are_refused() -> None:
    job, files = written("marks")
    second = re.compile(r"(?s)(J P\[8\][^\n]*\n).*?(?=  \d+:J P\[9\])")
    without = second.sub(r"\1", files["BETA.ls"], count=1)

    assert without != files["BETA.ls"]
    assert "as many marks" in message(job, {**files, "BETA.ls": without})


def test_signals_of_a_cell_with_one_robot_are_refused() -> None:
    job = one_arm("fanuc")
    text = FANUC_LS.render(job)["ALPHA.ls"].replace("/POS", "  99:  DO[1]=ON ;\r\n/POS")

    assert message(job, {"ALPHA.ls": text}).startswith(
        f"ALPHA.ls:{line_of(text, '  99:', 1)}: expected after this move"
    )


def test_a_file_that_was_cut_off_anywhere_is_refused() -> None:
    job, files = written("marks")

    for end in np.random.default_rng(0).integers(0, len(files["ALPHA.ls"]), 40):
        assert message(job, {**files, "ALPHA.ls": files["ALPHA.ls"][:end]}).startswith("ALPHA.ls:")
