"""VAL3 with seams: what is written is read back as it was, and every change of a file is noticed."""

import re
from typing import Any

import numpy as np
import pytest
from builders.elbow_arm import tip
from builders.seam_jobs import ROBOT, SEAM, STAUBLI_VALVE, run_of, seam_job

from cellplan.errors import InputError, NotVerifiedError
from cellplan.geometry.transforms import pose_from, rotation_from_rpy
from cellplan.model.report.exported import ExportJob
from cellplan.programs.formats.val3.writer import VAL3
from cellplan.programs.judgement.compare_rows import other_rows
from cellplan.programs.seams.executed import executed_programs


def job_with(process: dict[str, Any] = STAUBLI_VALVE) -> ExportJob:
    return seam_job("staubli", process=process)


@pytest.mark.parametrize("process", [STAUBLI_VALVE, None], ids=str)
def test_seams_come_back_as_they_were(process: dict[str, Any] | None) -> None:
    job = seam_job("staubli", process=process)
    written = job.programs[0].robots[ROBOT]

    read = VAL3.read(job.frame, VAL3.render(job))

    rows = read[0].robots[ROBOT]
    assert list(other_rows(VAL3, job, read)) == []
    assert rows.seams == (SEAM,)
    assert (rows.process is None) is (process is None)
    assert rows.process is None or np.array_equal(rows.process, written.process)
    executed_programs(job, VAL3, [run_of(job)], read)


def test_the_text_puts_the_tool_where_the_joints_do() -> None:
    """Tool, frame and points taken from the text, without the reader: turns about x, the turned y and the turned z."""
    job = job_with()
    robot, rows = job.frame.robot(ROBOT), job.programs[0].robots[ROBOT]
    data = VAL3.render(job)["alpha/alpha.dtx"]

    def frame(name: str, key: int = 0) -> np.ndarray:
        block = data.partition(f'name="{name}"')[2].partition("</Data>")[0]
        match = re.search(rf'key="{key}" ([^/]*)/>', block)
        assert match is not None
        values = {word: float(number) for word, number in re.findall(r'(\w+)="(-?[\d.]+)"', match[1])}
        turns = [
            rotation_from_rpy(np.deg2rad([values[w] if a == w else 0.0 for a in ("rx", "ry", "rz")]))
            for w in ("rx", "ry", "rz")
        ]
        return pose_from(turns[0] @ turns[1] @ turns[2], np.array([values[axis] for axis in "xyz"]) / 1000.0)

    np.testing.assert_allclose(frame("tTool"), robot.tool.X_FT, rtol=0.0, atol=1e-6)
    for point, row in enumerate(range(2, 7)):
        X_WT = tip(robot, rows.q[row])
        np.testing.assert_allclose(frame("fPart") @ frame("p_seam", point), X_WT, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("call", ["call open()", "call gun:open(nPressure)", "call pneumaticGun_of_cell:open()"])
def test_a_routine_that_is_no_part_of_the_project_is_refused(call: str) -> None:
    with pytest.raises(InputError, match=r"controllers.box.process: expected outputs \(doName=true\) or routines of"):
        VAL3.render(job_with({"on": call, "off": "call gun:close()"}))


LIBRARIES = {"on": ["call gas:open()", "call arc:on(2, 0.5)"], "off": ["call arc:off()", "call gas:close()"]}
LIBRARY_CHANGES = {
    "another routine": ("seam.pgx", "call arc:on", "call arc:off", "signals of the process"),
    "another number": ("seam.pgx", "arc:on(2, 0.5)", "arc:on(3, 0.5)", "signals of the process"),
    "another library": ("seam.pgx", "call arc:on", "call gas:on", "signals of the process"),
    "exchanged": ("seam.pgx", "call gas:open()", "call gas:close()", "as the cell states them"),
    "not declared": ("alpha.pjx", '    <Library alias="gas" path="gas"/>\n', "", "the libraries arc, gas, got 'arc'"),
    "one more": (
        "alpha.pjx",
        "  </Libraries>",
        '<Library alias="io" path="io"/></Libraries>',
        "the libraries arc, gas",
    ),
    "elsewhere": ("alpha.pjx", 'path="gas"', 'path="gases"', "a library by the name of its project"),
}


def test_routines_of_libraries_are_declared_in_the_project() -> None:
    job = job_with(LIBRARIES)
    files = VAL3.render(job)

    read = VAL3.read(job.frame, files)

    assert list(other_rows(VAL3, job, read)) == []
    assert re.findall(r'<Library alias="(\w+)" path="(\w+)"/>', files["alpha/alpha.pjx"]) == [
        ("arc", "arc"),
        ("gas",) * 2,
    ]
    code = files["alpha/seam.pgx"]
    assert re.findall(r"call .*", code) == [*LIBRARIES["on"], *LIBRARIES["off"]]
    assert code.count("delay") == 0  # a routine holds its delays
    assert 'type="dio"' not in files["alpha/alpha.dtx"]


@pytest.mark.parametrize("change", LIBRARY_CHANGES)
def test_a_change_of_a_library_is_noticed(change: str) -> None:
    job = job_with(LIBRARIES)
    file, old, new, said = LIBRARY_CHANGES[change]
    files = VAL3.render(job)
    assert files[f"alpha/{file}"].count(old) == 1

    assert said in noticed(job, files | {f"alpha/{file}": files[f"alpha/{file}"].replace(old, new)})


def noticed(job: ExportJob, files: dict[str, str]) -> str:
    """What is said of changed files: by the reader, in a comparison of rows, or where seams are executed."""
    try:
        read = VAL3.read(job.frame, files)
        findings = list(other_rows(VAL3, job, read))
        if not findings:
            executed_programs(job, VAL3, [run_of(job)], read)
    except (InputError, NotVerifiedError) as error:
        return str(error)
    return "\n".join(findings)


CODE: dict[str, tuple[str, str, str]] = {  # what is replaced once, what by, and what is said
    "joints to a pose": ("movel(p_seam[1]", "movej(p_seam[1]", "a blend joint with leave or reach"),
    "line to joints": ("movej(jRow[1]", "movel(jRow[1]", "values of p_seam"),
    "line for the arc": (
        "movec(p_seam[2],p_seam[3],tTool[0],mMove[4])",
        "movel(p_seam[2],tTool[0],mMove[4])\n  movel(p_seam[3],tTool[0],mMove[4])",
        "as a stop ends its process",
    ),
    "points exchanged": ("movel(p_seam[0]", "movel(p_seam[4]", "p_seam[0]: all values in order"),
    "point left out": ("  movel(p_seam[1],tTool[0],mMove[3])\n", "", "p_seam[1]: all values in order"),
    "feed of the approach": ("mMove[3]", "mMove[2]", "as a stop ends its process"),
    "feed of the joints": ("mMove[3]", "mMove[1]", "a motion descriptor with accel=100"),
    "process rounded": ("tTool[0],mMove[4]", "tTool[0],mMove[3]", "a stop where a process goes on or off"),
    "no stop before on": ("  waitEndMove()\n  doGas=true", "  doGas=true", "after waitEndMove()"),
    "on and off exchanged": ("doGas=true\n  doArc=true", "doArc=false\n  doGas=false", "expected"),
    "on in another order": ("doGas=true\n  doArc=true", "doArc=true\n  doGas=true", "as the cell states them"),
    "half on": ("  doGas=true\n", "", "as the cell states them"),
    "never on": ("  doGas=true\n  doArc=true\n  delay(0.300)\n", "", "a process that is on before"),
    "never off": ("  delay(0.200)\n  doArc=false\n  doGas=false\n", "", "as a stop ends its process"),
    "other output": ("doArc=true", "doFire=true", "signals of the process or of a handshake"),
    "other delay": ("delay(0.300)", "delay(0.200)", "as the cell states them"),
    "unknown delay": ("delay(0.300)", "delay(0.500)", "signals of the process or of a handshake"),
    "call in a seam": ("  waitEndMove()\n  doGas", "  call seam()\n  doGas", "one after the other"),
    "another tool": ("p_seam[1],tTool[0]", "p_seam[1],tOther[0]", "tTool[0] and a motion descriptor"),
    "no descriptor": ("mMove[3]", "mMove[9]", "a motion descriptor of mMove"),
}
DATA: dict[str, tuple[str, str, str]] = {
    "other feed": (
        'tmax="8.000" decel="100" rmax="99999" blend="Cart',
        'tmax="9.000" decel="100" rmax="99999" blend="Cart',
        "expected a speed of 8 mm/s, read 9 mm/s",
    ),
    "point 0.2 mm off": ('x="100.00000" y="0.00000"', 'x="100.20000" y="0.00000"', "read a pose that is 0.2 mm"),
    "middle of the arc off": ('x="150.00000"', 'x="150.20000"', "read a pose that is 0.2 mm"),
    "point turned": ('ry="85.41634"', 'ry="85.51634"', "read a pose that is"),
    "point in another frame": (
        'rz="90.00000" fatherId="fPart[0]"',
        'rz="90.00000" fatherId="fPart[1]"',
        "frame of the part",
    ),
    "point in the world": (
        'rz="90.00000" fatherId="fPart[0]"',
        'rz="90.00000" fatherId="world[0]"',
        "expected fatherId",
    ),
    "frame off": ('x="600.00000"', 'x="600.20000"', "expected fPart as the cell has it"),
    "base offset left out": ('x="600.00000" y="-100.00000"', 'x="0.00000" y="0.00000"', "expected fPart as the cell"),
    "frame turned": ('ry="5.27595"', 'ry="-5.27595"', "expected fPart as the cell has it"),
    "tool off": ('x="0.00000" y="20.00000"', 'x="0.20000" y="20.00000"', "expected tTool as the cell has it"),
    "tool turned": ('rx="5.61611"', 'rx="-5.61611"', "expected tTool as the cell has it"),
    "joints off": ('j1="-25.15427"', 'j1="-25.05427"', "expected joint a1"),
    "larger zone": ('leave="10.770"', 'leave="12.000"', "expected rounding of at most 0.2"),
    "blend of joints": ('blend="Cartesian"', 'blend="joint"', "a blend Cartesian"),
    "other link": ('link="doArc"', 'link="doFire"', "expected the link doArc"),
    "configuration": (
        'y="20.00000" z="0.00000"',
        'shoulder="lefty" y="20.00000" z="0.00000"',
        "expected no other attributes",
    ),
}
CHANGES = (
    {f"alpha/seam.pgx: {name}": change for name, change in CODE.items()}
    | {f"alpha/alpha.dtx: {name}": change for name, change in DATA.items()}
    | {
        "alpha/start.pgx: seam twice": ("  call seam()\n", "  call seam()\n  call seam()\n", "once"),
        "alpha/start.pgx: seam left out": ("  call seam()\n", "", "jRow[1]: all values in order"),
        "alpha/start.pgx: no stop at the end": ("  waitEndMove()\n", "", "motions and waitEndMove()"),
    }
)


@pytest.mark.parametrize("name", CHANGES)
def test_changes_of_a_file_are_noticed(name: str) -> None:
    job = job_with()
    files, file = VAL3.render(job), name.partition(":")[0]
    old, new, words = CHANGES[name]
    assert old in files[file]

    text = noticed(job, files | {file: files[file].replace(old, new, 1)})

    assert text
    assert words in text
