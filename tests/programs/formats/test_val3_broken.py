"""Defects of VAL3 projects: each is refused with its file and line."""

import re
from functools import cache

import numpy as np
import pytest
from builders.export_jobs import one_arm, two_arms

from cellplan.errors import InputError
from cellplan.model.report.exported import ExportJob
from cellplan.programs.formats.val3.writer import VAL3

JOBS = {
    "marks": lambda: two_arms("staubli", marks=(0, 7)),
    "pages": lambda: two_arms("staubli", marks=(0, 7), split=8),
}


@cache
def written(name: str) -> tuple[ExportJob, dict[str, str]]:
    job = JOBS[name]()
    return job, VAL3.render(job)


def message(job: ExportJob, files: dict[str, str]) -> str:
    with pytest.raises(InputError) as error:
        VAL3.read(job.frame, files)
    text = str(error.value)
    assert "\n" not in text
    return text


def after(name: str, added: str) -> tuple[str, str]:
    """A replacement that adds lines before the motion to a row."""
    return f"  movej(jRow[{name}]", f"  {added}\n  movej(jRow[{name}]"


LAST_WAIT = "  wait(diMark1==false)\n"
# what is replaced (once, the first one), what by, and the text that begins the refused line of the broken file
START = {
    "cut off": (re.compile(r"  waitEndMove\(\)\nend\]\]>.*", re.S), "", 'end of "start.pgx"'),
    "no end": ("end]]>", "]]>", "  waitEndMove()\n]]>"),
    "end is not the last": ("end]]>", "end\nwaitEndMove()]]>", "waitEndMove()]]>"),
    "no begin": ("[begin", "[", "  doMark=false"),
    "empty code": (re.compile(r"\[begin.*?end\]", re.S), "[]", "    <Code>"),
    "begin in capitals": ("[begin", "[BEGIN", "    <Code>"),
    "tag not closed": ("  </Program>\n", "", "</Programs>"),
    "other tag": ("<Code>", "<Kode>", "end]]></Code>"),
    "unknown element": ("    <Code>", "    <Text/>\n    <Code>", "    <Text/>"),
    "two codes": ("    <Code>", "    <Code/>\n    <Code>", '  <Program name="start"'),
    "element in the code": ("<![CDATA[begin", "<b/><![CDATA[begin", "    <Code>"),
    "other namespace": ("VAL3/Program/2", "VAL3/Program/1", "<Programs"),
    "data instead": ("<Programs ", "<Datas ", "</Programs>"),
    "other name": ('name="start"', 'name="begin"', "  <Program"),
    "name in capitals": ('name="start"', 'name="Start"', "  <Program"),
    "other access": ('access="public"', 'access="secret"', "  <Program"),
    "unknown attribute": ('access="public"', 'accessible="public"', "  <Program"),
    "local of another type": (
        "    <Code>",
        '    <Locals><Local name="a" type="string" xsi:type="array" size="1"/></Locals>\n    <Code>',
        "    <Locals>",
    ),
    "parameters": (
        "    <Code>",
        '    <Parameters xmlns="http://www.staubli.com/robotics/VAL3/Param/1">\n<Parameter name="a"/></Parameters>\n'
        "    <Code>",
        "<Parameter ",
    ),
    "document type": ("<Programs ", "<!DOCTYPE a>\n<Programs ", "<!DOCTYPE"),
    "two kinds of line ends": ("\n  movej(jRow[9]", "\r\n  movej(jRow[9]", "  movej(jRow[8]"),
    "straight line": (*after("9", "movel(jRow[9],tTool[0],mMove[1])"), "  movel"),
    "motion in capitals": (*after("9", "MOVEJ(jRow[9],tTool[0],mMove[1])"), "  MOVEJ"),
    "point by value": (*after("9", "movej({0,0,0,0,0,0},tTool[0],mMove[1])"), "  movej({"),
    "two arguments": (*after("9", "movej(jRow[9],tTool[0])"), "  movej(jRow[9],tTool[0])"),
    "two statements": (re.compile(r"\n  movej\(jRow\[10\]"), " movej(jRow[10]", "  movej(jRow[9]"),
    "motion left out": (re.compile(r"  movej\(jRow\[9\].*\n"), "", "  movej(jRow[10]"),
    "motion twice": (*after("9", "movej(jRow[8],tTool[0],mMove[1])"), "  movej(jRow[8]", 2),
    "motions in another order": (*after("9", "movej(jRow[10],tTool[0],mMove[1])"), "  movej(jRow[10]"),
    "one row too far": (*after("9", "movej(jRow[20],tTool[0],mMove[1])"), "  movej(jRow[20]"),
    "row below the first": (*after("9", "movej(jRow[-1],tTool[0],mMove[1])"), "  movej(jRow[-1]"),
    "rows of nowhere": (*after("9", "movej(jPath[9],tTool[0],mMove[1])"), "  movej(jPath"),
    "row by a name that counts nothing": (*after("9", "movej(jRow[n],tTool[0],mMove[1])"), "  movej(jRow[n]"),
    "tool of nowhere": (*after("9", "movej(jRow[9],tGun[0],mMove[1])"), "  movej(jRow[9],tGun"),
    "second tool": (*after("9", "movej(jRow[9],tTool[1],mMove[1])"), "  movej(jRow[9],tTool[1]"),
    "speed of nowhere": (*after("9", "movej(jRow[9],tTool[0],mFast)"), "  movej(jRow[9],tTool[0],mFast"),
    "third speed": (*after("9", "movej(jRow[9],tTool[0],mMove[2])"), "  movej(jRow[9],tTool[0],mMove[2]"),
    "tool and speed exchanged": (*after("9", "movej(jRow[9],mMove[0],tTool[0])"), "  movej(jRow[9],mMove"),
    "no wait at the end": ("  waitEndMove()\nend]]>", "end]]>", "end]]>"),
    "loop with a counter that is not declared": (*after("9", "for n=9 to 9\nendFor"), "  for n"),
    "condition": (*after("9", "if true"), "  if"),
    "endFor without a loop": (*after("9", "endFor"), "  endFor"),
    "delay": (*after("9", "delay(0.5)"), "  delay"),
    "call of nowhere": (*after("9", "call gripper()"), "  call"),
    "call with a parameter": (*after("9", "call gripper(1)"), "  call"),
    "call of itself": (*after("0", "call start()"), "  call"),
    "call of stop": (*after("0", "call stop()"), "  call"),
    "motions forgotten": (*after("9", "resetMotion()"), "  resetMotion"),
    "signal before all motions": (*after("0", "doMark=true"), "  doMark=true\n  movej"),
    "signal of no mark": (*after("9", "doMark=true"), "  doMark=true\n  movej"),
    "signal in motion": ("  waitEndMove()\n  wait(", "  wait(", "  wait(diMark1==true)"),
    "other output": ("doMark=true", "diMark1=true", "  diMark1=true"),
    "output of nowhere": ("doMark=true", "doOther=true", "  doOther"),
    "output of another type": ("doMark=true", "tTool=true", "  tTool"),
    "other state": ("doMark=true", "doMark=false", "  doMark=false", 2),
    "state of no word": ("doMark=true", "doMark=1", "  doMark=1"),
    "other input": ("wait(diMark1==true)", "wait(doMark==true)", "  wait(doMark"),
    "input turned round": ("wait(diMark1==true)", "wait(diMark1==false)", "  wait(diMark1==false)"),
    "one equals sign": ("wait(diMark1==true)", "wait(diMark1=true)", "  wait(diMark1="),
    "watch instead of wait": ("wait(diMark1==true)", "watch(diMark1==true,5)", "  watch"),
    "handshake without its wait": ("  wait(diMark1==false)\n", "", "  doMark=false", 2),
    "handshake without its end": (f"{LAST_WAIT}  doMark=false\n", LAST_WAIT, "  movej(jRow[1]"),
    "output not lowered at the start": ("  doMark=false\n", "", "  wait(diMark1==true)"),
    "output raised at the start": ("doMark=false", "doMark=true", "  doMark=true"),
    "output lowered twice": (*after("0", "doMark=false"), "  doMark=false", 2),
    "wait at the start": ("doMark=false", "wait(diMark1==false)", "  wait(diMark1==false)"),
    "motion in a handshake": (
        "  doMark=true\n",
        "  doMark=true\n  movej(jRow[1],tTool[0],mMove[0])\n",
        "  movej(jRow[1]",
    ),
    "handshake twice": (
        f"{LAST_WAIT}  doMark=false\n",
        f"{LAST_WAIT}  doMark=false\n  doMark=true\n",
        "  doMark=true\n  movej",
    ),
    "no motion at all": (re.compile(r"  movej\(jRow\[0\].*(?=  waitEndMove\(\)\nend)", re.S), "", "end]]>"),
}
DATA = {
    "cut off": (re.compile(r"  </Datas>.*", re.S), "", 'end of "alpha.dtx"'),
    "other namespace": ("VAL3/Data/2", "VAL3/Data/1", "<Database"),
    "unknown element": ("  <Datas>", "  <Types/>\n  <Datas>", "  <Types/>"),
    "text among the data": ("  <Datas>\n", "  <Datas>\nhello\n", "  <Datas>"),
    "size too large": ('size="20"', 'size="21"', '    <Data name="jRow"'),
    "size too small": ('size="20"', 'size="19"', '    <Data name="jRow"'),
    "size of nothing": ('size="20"', 'size="0"', '    <Data name="jRow"'),
    "size that is no number": ('size="20"', 'size="many"', '    <Data name="jRow"'),
    "no size": (' size="20"', "", '    <Data name="jRow"'),
    "no name": (' name="jRow"', "", '    <Data access="public" xsi:type="array" type="jointRx"'),
    "no type": (' type="jointRx"', "", '    <Data name="jRow"'),
    "other type": ('type="jointRx"', 'type="pointRx"', '      <Value key="0" j1'),
    "joints of another arm": ('type="jointRx"', 'type="jointRs"', '    <Data name="jRow"'),
    "no array": ('xsi:type="array" type="jointRx"', 'xsi:type="collection" type="jointRx"', '    <Data name="jRow"'),
    "other access": (
        'access="public" xsi:type="array" type="jointRx"',
        'access="all" xsi:type="array" type="jointRx"',
        '    <Data name="jRow"',
    ),
    "long name": ('name="jRow"', f'name="{"j" * 16}"', '    <Data name="jjj'),
    "long name of the tool": ('name="tTool"', f'name="{"t" * 14}"', '    <Data name="ttt'),
    "name that begins with a digit": ('name="jRow"', 'name="1Row"', '    <Data name="1Row"'),
    "name with a hyphen": ('name="jRow"', 'name="j-Row"', '    <Data name="j-Row"'),
    "name twice": ('name="jRow"', 'name="diMark1"', '    <Data name="diMark1"', 2),
    "key twice": ('key="4"', 'key="3"', '      <Value key="3"', 2),
    "key left out": ('key="4"', 'key="5"', '      <Value key="5"'),
    "no key": ('<Value key="4"', "<Value", "      <Value j1"),
    "value left out": (re.compile(r'      <Value key="4".*\n'), "", '    <Data name="jRow"'),
    "axis twice": ('<Value key="4"', '<Value key="4" j1="0"', '      <Value key="4"'),
    "axis 7": ('<Value key="4"', '<Value key="4" j7="0"', '      <Value key="4"'),
    "axis in capitals": (re.compile(r'(key="4" )j1'), r"\1J1", '      <Value key="4"'),
    "no number": (re.compile(r'(key="4" j1=)"[^"]*"'), r'\1"x"', '      <Value key="4"'),
    "empty number": (re.compile(r'(key="4" j1=)"[^"]*"'), r'\1""', '      <Value key="4"'),
    "number with an exponent": (re.compile(r'(key="4" j1=)"[^"]*"'), r'\1"1e1"', '      <Value key="4"'),
    "number without end": (re.compile(r'(key="4" j1=)"[^"]*"'), r'\1"inf"', '      <Value key="4"'),
    "comma as the point": (re.compile(r'(key="4" j1=)"[^"]*"'), r'\1"1,5"', '      <Value key="4"'),
    "number of a thousand digits": (re.compile(r'(key="4" j1=)"[^"]*"'), rf'\1"{"1" * 1000}"', '      <Value key="4"'),
    "element in a value": (re.compile(r'(key="4".*)/>'), r"\1><Field/></Value>", '      <Value key="4"'),
    "quotes left out": (re.compile(r'(key="4" j1=)"([^"]*)"'), r"\1\2", '      <Value key="4"'),
    "tool without a father": (' fatherId="flange[0]"', "", '      <Value key="0" x='),
    "tool on the world": ('"flange[0]"', '"world[0]"', '      <Value key="0" x='),
    "tool with an unknown attribute": ('fatherId="flange', 'mass="3" fatherId="flange', '      <Value key="0" x='),
    "world on something": ('"world[0]"', '"fOther[0]"', '      <Value key="0" fatherId'),
    "speed of nothing": ('vel="10"', 'vel="0"', '      <Value key="0" accel'),
    "speed of too much": ('vel="10"', 'vel="101"', '      <Value key="0" accel'),
    "speed below nothing": ('vel="10"', 'vel="-5"', '      <Value key="0" accel'),
    "unknown rounding": ('blend="off"', 'blend="some"', '      <Value key="0" accel'),
    "last row rounded": (
        re.compile(r'(vel="100".*)blend="off" leave="0"'),
        r'\1blend="joint" leave="1"',
        "start:  waitEndMove()\n  wait",
        2,
    ),
    "signal without a link": (re.compile(r' link="[^"]*Q10"'), "", '      <Value key="0"/>'),
    "other link of the output": (r"\%Q10", r"\%Q11", "start:  doMark=false"),
    "other link of the input": (r"\%I101", r"\%I102", "start:  wait(diMark1==true)"),
    "tool left out": (re.compile(r'    <Data name="tTool".*?</Data>\n', re.S), "", "start:  movej(jRow[0]"),
    "rows left out": (re.compile(r'    <Data name="jRow".*?</Data>\n', re.S), "", "start:  movej(jRow[0]"),
    "rows that are not used": (
        "  </Datas>",
        '    <Data name="jPark" xsi:type="array" type="jointRx" size="1"><Value key="0"/></Data>\n  </Datas>',
        '    <Data name="jPark"',
    ),
    "two kinds of line ends": ("  <Datas>\n", "  <Datas>\r\n", "  <Datas>"),
}
INDEX = {
    "cut off": (re.compile(r"</Project>\n"), "", 'end of "alpha.pjx"'),
    "other namespace": ("VAL3/Project/3", "VAL3/Project/4", "<Project"),
    "inches": ('millimeterUnit="true"', 'millimeterUnit="false"', "  <Parameters"),
    "no parameters": (re.compile(r"  <Parameters.*\n"), "", "<Project"),
    "a library": ("<Libraries/>", '<Libraries>\n<Library alias="a" path="b"/></Libraries>', "<Library "),
    "start left out": ('    <Program file="start.pgx"/>\n', "", "  <Programs>"),
    "stop left out": ('    <Program file="stop.pgx"/>\n', "", "  <Programs>"),
    "start twice": ("stop.pgx", "start.pgx", "  <Programs>"),
    "file of another kind": ("stop.pgx", "stop.txt", '    <Program file="stop.txt"'),
    "file elsewhere": ("stop.pgx", "../stop.pgx", '    <Program file="../stop.pgx"'),
    "long name": ("stop.pgx", "s" * 16 + ".pgx", '    <Program file="sss'),
    "no data": ('    <Data file="alpha.dtx"/>\n', "", "  <Database>"),
    "other data": ("alpha.dtx", "beta.dtx", "  <Database>"),
    "two data": ("  </Database>", '    <Data file="beta.dtx"/>\n  </Database>', "  <Database>"),
    "unknown element": ("  <Types/>", "  <Tasks/>", "  <Tasks/>"),
}
TABLES = {"start.pgx": START, "alpha.dtx": DATA, "alpha.pjx": INDEX}


def line_of(text: str, begin: str, which: int = 1) -> int:
    """Number of the line that begins with a text, the first or a later one of them; the last line for its end."""
    if begin.startswith("end of"):
        return text.count("\n") + 1
    places = [match.start() for match in re.finditer(rf"(?m)^{re.escape(begin)}", text)]
    return text.count("\n", 0, places[which - 1]) + 1


def break_file(text: str, old: str | re.Pattern[str], new: str) -> str:
    broken = old.sub(new, text, count=1) if isinstance(old, re.Pattern) else text.replace(old, new, 1)
    assert broken != text
    return broken


@pytest.mark.parametrize(("file", "defect"), [(file, defect) for file, table in TABLES.items() for defect in table])
def test_a_broken_file_is_refused_with_its_line(file: str, defect: str) -> None:
    old, new, begin, *which = TABLES[file][defect]
    job, files = written("marks")
    path = f"alpha/{file}"
    broken = {**files, path: break_file(files[path], old, new)}
    place = "alpha/start.pgx" if begin.startswith("start:") else path

    said = message(job, broken)

    assert said.startswith(f"{place}:{line_of(broken[place], begin.removeprefix('start:'), *which)}: expected ")


# the file, what is replaced in it, what by, the file that is refused, and the text that begins the refused line
PAGES = {
    "call left out": ("start.pgx", "  call alpha_002()\n", "", None, "alpha/alpha_002.pgx: expected a program that"),
    "call twice": ("start.pgx", "  call alpha_002()", "  call alpha_001()", "start.pgx", "  call alpha_001()", 2),
    "motion beside pages": (
        "start.pgx",
        "  waitEndMove()",
        "  movej(jRow_001[0],tTool,mMove)\n  waitEndMove()",
        "start.pgx",
        "  movej",
    ),
    "call in a page": ("alpha_002.pgx", "begin", "begin\n  call alpha_003()", "alpha_002.pgx", "  call"),
    "name of another page": ("alpha_002.pgx", 'name="alpha_002"', 'name="alpha_003"', "alpha_002.pgx", "  <Program"),
    "first row again": (
        "alpha_002.pgx",
        "begin",
        "begin\n  movej(jRow_001[7],tTool[0],mMove[1])",
        "alpha_002.pgx",
        "  movej(jRow_001",
    ),
    "page without motions": ("alpha_003.pgx", re.compile(r"  movej.*(?=end\])", re.S), "", "alpha_003.pgx", "end]"),
    "handshake cut off": ("alpha_001.pgx", "  doMark=false\nend", "end", "alpha_001.pgx", "end]"),
    "page of nowhere": ("start.pgx", "call alpha_003", "call alpha_004", "start.pgx", "  call alpha_004"),
}


@pytest.mark.parametrize("defect", PAGES)
def test_a_broken_page_is_refused_with_its_line(defect: str) -> None:
    file, old, new, place, begin, *which = PAGES[defect]
    job, files = written("pages")
    broken = {**files, f"alpha/{file}": break_file(files[f"alpha/{file}"], old, new)}

    said = message(job, broken)

    if place is None:
        assert said.startswith(begin)
    else:
        assert said.startswith(f"alpha/{place}:{line_of(broken[f'alpha/{place}'], begin, *which)}: expected ")


@pytest.mark.parametrize("file", ["alpha/alpha.pjx", "beta/beta.dtx", "alpha/start.pgx", "beta/beta_003.pgx"])
def test_a_missing_file_is_named(file: str) -> None:
    job, files = written("pages")

    said = message(job, {path: text for path, text in files.items() if path != file})

    assert said == f"{file}: expected a file, got none"


@pytest.mark.parametrize("file", ["gamma/gamma.pjx", "alpha/alpha_004.pgx", "start.pgx"])
def test_a_file_too_many_is_named(file: str) -> None:
    job, files = written("pages")

    said = message(job, {**files, file: files["alpha/start.pgx"]})

    assert said == f"{file}: expected no such file in this export"


@pytest.mark.parametrize("file", ["alpha.pjx", "alpha.dtx", "start.pgx", "stop.pgx"])
def test_an_empty_file_is_refused(file: str) -> None:
    job, files = written("marks")

    assert message(job, {**files, f"alpha/{file}": ""}).startswith(f"alpha/{file}:1: expected well-formed XML")


@pytest.mark.parametrize("code", ["movej(jRow[0],tTool[0],mMove[0])", "doMark=false", "waitEndMove()", "cls()"])
def test_stop_does_nothing_but_forget_motions(code: str) -> None:
    job, files = written("marks")
    text = files["alpha/stop.pgx"].replace("resetMotion()", code)

    assert message(job, {**files, "alpha/stop.pgx": text}).startswith("alpha/stop.pgx:5: expected ")


@pytest.mark.parametrize(
    ("loop", "begin"),
    [
        ("for n=0 to 20", "    movej"),  # one past the end
        ("for n=1 to 19", "    movej"),
        ("for n=0 to 18 step 2", "    movej"),
        ("for n=5 to 4", "  for"),
        ("for n=0 to 19 step 0", "  for"),
        ("for n=0 to 19 step -1", "  for"),
        ("for n=0 to 99999999", "  for"),
        ("for m=0 to 19", "  for"),
        ("for n=0 to size(jRow)-1", "  for"),
        ("while n<20", "  while"),
    ],
)
def test_loops_that_do_not_fit_the_rows_are_refused(loop: str, begin: str) -> None:
    job = one_arm("staubli")
    files = VAL3.render(job)
    code = "for n=0 to 19\n    movej(jRow[n],tTool[0],mMove[0])\n  endFor\n  "
    text = re.sub(r"(?s)movej.*(?=waitEndMove)", code, files["alpha/start.pgx"])
    local = '<Locals><Local name="n" type="num" xsi:type="array" size="1"/></Locals>\n    <Code>'
    text = text.replace("<Code>", local)
    broken = text.replace("for n=0 to 19", loop)

    assert len(VAL3.read(job.frame, {**files, "alpha/start.pgx": text})[0].robots["alpha"]) == 20
    said = message(job, {**files, "alpha/start.pgx": broken})
    assert said.startswith(f"alpha/start.pgx:{line_of(broken, begin)}: expected ")


@pytest.mark.parametrize(
    ("before", "got"), [("  movej(jRow[9]", "waitEndMove()"), ("\nend]]", "for n=1 to 2")], ids=["between", "last"]
)
def test_a_loop_without_its_end_is_refused(before: str, got: str) -> None:
    job, files = written("marks")
    local = '<Locals><Local name="n" type="num" xsi:type="array" size="1"/></Locals>\n    <Code>'
    text = files["alpha/start.pgx"].replace("<Code>", local).replace(before, f"\n  for n=1 to 2\n{before}")

    said = message(job, {**files, "alpha/start.pgx": text})

    assert re.fullmatch(rf"alpha/start.pgx:\d+: expected endFor, got {re.escape(repr(got))}", said)


def test_robots_that_do_not_meet_equally_often_are_refused() -> None:
    job, files = written("marks")
    text = re.sub(r"(?s)  waitEndMove\(\)\n  .*?(?=  movej\(jRow\[1\])", "", files["beta/start.pgx"], count=1)

    assert text != files["beta/start.pgx"]
    assert "as many marks" in message(job, {**files, "beta/start.pgx": text})


@pytest.mark.parametrize("file", ["alpha.pjx", "alpha.dtx", "start.pgx", "stop.pgx"])
def test_a_file_that_was_cut_off_anywhere_is_refused(file: str) -> None:
    job, files = written("marks")
    text = files[f"alpha/{file}"]
    whole = len(text.rstrip("\n"))

    for end in np.random.default_rng(0).integers(0, whole, 40):
        assert message(job, {**files, f"alpha/{file}": text[:end]}).startswith(f"alpha/{file}:")


@pytest.mark.parametrize("kind", [pytest.param("long", marks=pytest.mark.slow), "empty", "deep"])
def test_loops_that_would_never_end_are_refused(kind: str) -> None:
    job, files = written("marks")
    names = [f"n{place}" for place in range(9)]
    local = "".join(f'<Local name="{name}" type="num" xsi:type="array" size="1"/>' for name in names)
    text = files["alpha/start.pgx"].replace("<Code>", f"<Locals>{local}</Locals>\n    <Code>")

    def looped(*lines: str) -> str:
        return text.replace("[begin\n", "[begin\n" + "".join(f"{line}\n" for line in lines))

    long = [f"for {name}=0 to 9999" for name in names[:2]]
    deep = [f"for {name}=0 to 0" for name in names]
    broken, begin = {
        "long": (looped(*long, "waitEndMove()", "endFor", "endFor"), "waitEndMove"),
        "empty": (looped(*long, "endFor", "endFor"), long[1]),
        "deep": (looped(*deep, "waitEndMove()", *["endFor"] * 9), deep[8]),
    }[kind]

    said = message(job, {**files, "alpha/start.pgx": broken})

    assert said.startswith(f"alpha/start.pgx:{line_of(broken, begin)}: expected ")
