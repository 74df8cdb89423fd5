"""KRL with seams: what is written is read back as it was, and every change of a file is noticed."""

import re
from typing import Any

import numpy as np
import pytest
from builders.elbow_arm import tip
from builders.seam_jobs import KUKA_ZERO, ROBOT, SEAM, VALVE, X_WP, joints_at, poses, run_of, seam_job

from cellplan.errors import InputError, NotVerifiedError
from cellplan.geometry.transforms import pose_from, rotation_from_rpy
from cellplan.model.report.exported import ExportJob
from cellplan.programs.formats.krl.writer import KRL
from cellplan.programs.judgement.compare_rows import other_rows
from cellplan.programs.seams.executed import executed_programs

ARC: dict[str, Any] = {"on": "ARC_ON({data})", "off": "ARC_OFF()", "data": {"seam": "WELD1"}}


def job_with(**stated: Any) -> ExportJob:
    return seam_job("kuka", controller=KUKA_ZERO, **({"process": VALVE} | stated))


NUMBERED = {"control": {"tool_number": 3}, "number": 5}


@pytest.mark.parametrize("stated", [{}, NUMBERED, {"process": ARC}, {"process": None}], ids=str)
def test_seams_come_back_as_they_were(stated: dict[str, Any]) -> None:
    job = job_with(**stated)
    written = job.programs[0].robots[ROBOT]

    files = KRL.render(job)
    read = KRL.read(job.frame, files)

    rows = read[0].robots[ROBOT]
    assert files == KRL.render(job)
    assert list(other_rows(KRL, job, read)) == []
    assert rows.seams == (SEAM,)
    assert (rows.process is None) is (stated == {"process": None})
    assert rows.process is None or np.array_equal(rows.process, written.process)
    np.testing.assert_allclose(rows.feeds, written.feeds, atol=1e-9)
    assert rows.rounding is not None
    assert 0.19 < rows.rounding[3] <= 0.2
    assert np.count_nonzero(rows.rounding) == 1


def test_the_text_puts_the_tool_where_the_joints_do() -> None:
    """Base, tool and points taken from the text, without the reader: KUKA turns by A about z, B about y, C about x."""
    job = job_with()
    robot, rows = job.frame.robot(ROBOT), job.programs[0].robots[ROBOT]
    data = KRL.render(job)["alpha.dat"]

    def frame(name: str) -> np.ndarray:
        match = re.search(rf" {name}={{([^}}]*)}}", data)
        assert match is not None
        values = {part.split()[0]: float(part.split()[1]) for part in match[1].split(",")}
        place = np.array([values[axis] for axis in "XYZ"]) / 1000.0
        return pose_from(rotation_from_rpy(np.deg2rad([values["C"], values["B"], values["A"]])), place)

    np.testing.assert_allclose(frame("TOOL_FRAME"), robot.tool.X_FT, rtol=0.0, atol=1e-6)
    for point, row in enumerate(range(2, 7), start=1):
        X_WT = tip(robot, rows.q[row])
        np.testing.assert_allclose(frame("PART_FRAME_1") @ frame(f"seam_{point}"), X_WT, rtol=0.0, atol=1e-6)


def test_a_seam_has_few_statements_and_the_process_stands_at_its_ends() -> None:
    files = KRL.render(job_with())

    routine = files["alpha.src"].partition("DEF seam()\r\n")[2].split("\r\n")
    assert routine[: routine.index("END")] == [
        "$BASE=PART_FRAME_1",
        "BAS(#VEL_PTP,46)",
        "PTP XP2",
        "$VEL.CP=0.05",
        "LIN seam_1",
        "$OUT[6]=TRUE",
        "$OUT[7]=TRUE",
        "WAIT SEC 0.300",
        "$VEL.CP=0.008",
        "$APO.CDIS=10.77",
        "LIN seam_2 C_DIS",
        "CIRC seam_3,seam_4",
        "WAIT SEC 0.200",
        "$OUT[7]=FALSE",
        "$OUT[6]=FALSE",
        "$VEL.CP=0.05",
        "LIN seam_5",
    ]


def test_delays_that_weld_data_hold_are_not_waited_twice() -> None:
    text = KRL.render(job_with(process=ARC))["alpha.src"]

    assert "ARC_ON(WELD1)\r\n$VEL.CP=0.008" in text
    assert "WAIT SEC" not in text


def test_the_entry_decides_the_branch_and_the_bits_say_it() -> None:
    """Status and turn of each point are those of the joints there; another branch has others."""
    job = job_with()
    robot = job.frame.robot(ROBOT)
    data = KRL.render(job)["alpha.dat"]
    stated = [tuple(map(int, bits)) for bits in re.findall(r"S (\d),T (\d+)", data)]

    assert stated == [tuple(row) for row in KRL.configuration(robot, job.programs[0].robots[ROBOT].q[2:7]).tolist()]
    other = np.array([joints_at(robot, X, branch=(1, 1, -1)) for X in poses()[1:]])
    np.testing.assert_allclose(tip(robot, other[0]), X_WP @ poses()[1], rtol=0.0, atol=1e-12)
    assert not np.any(KRL.configuration(robot, other)[:, 0] == np.array(stated)[:, 0])


def noticed(job: ExportJob, files: dict[str, str]) -> str:
    """What is said of changed files: by the reader, in a comparison of rows, or where seams are executed."""
    try:
        read = KRL.read(job.frame, files)
        findings = list(other_rows(KRL, job, read))
        if not findings:
            executed_programs(job, KRL, [run_of(job)], read)
    except InputError as error:
        text = str(error)
        assert re.match(r"alpha\.(src|dat):\d+: expected ", text), text
        return text
    except NotVerifiedError as error:
        return str(error)
    return "\n".join(findings)


SOURCE: dict[str, tuple[str, str, str]] = {  # what is replaced once, what by, and what is said
    "other feed": ("$VEL.CP=0.008", "$VEL.CP=0.009", "expected a speed of 8 mm/s, read 9 mm/s"),
    "feed in millimetres": ("$VEL.CP=0.008", "$VEL.CP=8", "expected a speed of 8 mm/s, read 8000 mm/s"),
    "no feed": ("$VEL.CP=0.05\r\nLIN seam_1", "LIN seam_1", "behind $BASE and $VEL.CP"),
    "feed of the approach": ("$VEL.CP=0.008\r\n", "", "expected a speed of 8 mm/s, read 50 mm/s"),
    "other tool": ("$TOOL=TOOL_FRAME", "$TOOL=TOOL_DATA[1]", "expected TOOL_FRAME as the cell states it"),
    "no tool": ("$TOOL=TOOL_FRAME\r\n", "", "expected $TOOL to be set"),
    "no base of the seam": ("$BASE=PART_FRAME_1\r\n", "", "behind $BASE and $VEL.CP"),
    "world as base": ("$BASE=PART_FRAME_1", "$BASE=$NULLFRAME", "expected PART_FRAME_1 as the cell states it"),
    "base by number": ("$BASE=PART_FRAME_1", "$BASE=BASE_DATA[1]", "expected PART_FRAME_1 as the cell states it"),
    "tool in the world": ("$IPO_MODE=#BASE", "$IPO_MODE=#TCP", "a statement that these programs have"),
    "wrist by joints": ("$ORI_TYPE=#VAR", "$ORI_TYPE=#JOINT", "a statement that these programs have"),
    "no mode": ("$ORI_TYPE=#VAR\r\n", "", "expected $ORI_TYPE=#VAR to be set"),
    "line for the arc": ("CIRC seam_3,seam_4", "LIN seam_3\r\nLIN seam_4", "as a stop ends its process"),
    "arc turned round": ("CIRC seam_3,seam_4", "CIRC seam_4,seam_3", "read a pose that is"),
    "joints to a pose": ("LIN seam_2 C_DIS", "PTP seam_2", "a point that is declared for such a motion"),
    "line to joints": ("PTP XP2", "LIN XP2", "behind $BASE and $VEL.CP"),
    "spline": ("LIN seam_2 C_DIS", "SLIN seam_2", "a statement that these programs have"),
    "point left out": ("LIN seam_2 C_DIS\r\n", "", "expected"),
    "points exchanged": ("LIN seam_1", "LIN seam_5", "used once, got 'SEAM_5'"),
    "process rounded": ("LIN seam_1", "$APO.CDIS=5\r\nLIN seam_1 C_DIS", "a stop where a process goes on or off"),
    "end rounded": ("CIRC seam_3,seam_4", "CIRC seam_3,seam_4 C_DIS", "a stop where a process goes on or off"),
    "larger zone": ("$APO.CDIS=10.77", "$APO.CDIS=12", "expected rounding of at most 0.2"),
    "zone by joints": ("seam_2 C_DIS", "seam_2 C_PTP", "a statement that these programs have"),
    "no zone": ("$APO.CDIS=10.77\r\n", "", "$APO.CDIS to be set"),
    "on and off exchanged": ("$OUT[6]=TRUE\r\n$OUT[7]=TRUE", "$OUT[7]=FALSE\r\n$OUT[6]=FALSE", "expected"),
    "on in another order": ("$OUT[6]=TRUE\r\n$OUT[7]=TRUE", "$OUT[7]=TRUE\r\n$OUT[6]=TRUE", "as the cell states them"),
    "half on": ("$OUT[6]=TRUE\r\n", "", "as the cell states them"),
    "never on": ("$OUT[6]=TRUE\r\n$OUT[7]=TRUE\r\nWAIT SEC 0.300\r\n", "", "a process that is on before"),
    "never off": ("WAIT SEC 0.200\r\n$OUT[7]=FALSE\r\n$OUT[6]=FALSE\r\n", "", "as a stop ends its process"),
    "other output": ("$OUT[7]=TRUE", "$OUT[8]=TRUE", "a statement that these programs have"),
    "other delay": ("WAIT SEC 0.300", "WAIT SEC 0.200", "as the cell states them"),
    "no delay": ("WAIT SEC 0.300\r\n", "", "as the cell states them"),
    "unknown delay": ("WAIT SEC 0.300", "WAIT SEC 0.500", "a statement that these programs have"),
    "halt": ("LIN seam_2 C_DIS", "HALT\r\nLIN seam_2 C_DIS", "a statement that these programs have"),
    "seam twice": ("seam()\r\nBAS", "seam()\r\nseam()\r\nBAS", "a statement that these programs have"),
    "seam left out": ("\r\nseam()\r\n", "\r\n", "routines that are called once"),
    "another routine": ("LIN seam_2 C_DIS", "other()\r\nLIN seam_2 C_DIS", "a statement that these programs have"),
    "routine of no task": ("DEF seam()", "DEF beam()", "a statement that these programs have"),
    "line outside of a routine": ("PTP XP8", "LIN seam_5", "lines and arcs in the routine of a task"),
    "no end": ("\r\nEND\r\n\r\nDEF seam", "\r\n\r\nDEF seam", "expected"),
    "speed of the joints": ("BAS(#VEL_PTP,46)", "BAS(#VEL_PTP,146)", "of shares up to 100"),
}
NUMBER = r"-?\d+\.\d+"
DATA: dict[str, tuple[str, str, str]] = {
    "point 0.2 mm off": ("seam_2={X 100.00000", "seam_2={X 100.20000", "read a pose that is 0.2 mm"),
    "point 0.001 mm off": ("seam_5={X 200.00000", "seam_5={X 200.00100", "read a pose that is 0.001 mm"),
    "point turned": ("A 4.58366", "A 4.68366", "read a pose that is"),
    "middle of the arc off": ("seam_3={X 150.00000", "seam_3={X 150.20000", "read a pose that is 0.2 mm"),
    "frame off": ("PART_FRAME_1={X 600.00000", "PART_FRAME_1={X 600.20000", "expected PART_FRAME_1 as the cell has it"),
    "base offset left out": ("X 600.00000,Y -100.00000", "X 0.00000,Y 0.00000", "expected PART_FRAME_1 as"),
    "frame turned": ("B 5.72958,C 0.00000", "B 0.00000,C 5.72958", "expected PART_FRAME_1 as the cell has it"),
    "tool off": ("Z 100.00000,A 11.45916,B 0.00000", "Z 100.20000,A 11.45916,B 0.00000", "expected TOOL_FRAME as"),
    "tool turned": ("A 11.45916,B 0.00000,C 5.72958", "A 11.45916,B 5.72958,C 0.00000", "expected TOOL_FRAME as"),
    "status": ("S 2,T 35", "S 6,T 35", "along its seam: expected configuration [2, 35]"),
    "turn": ("S 2,T 35", "S 2,T 34", "along its seam: expected configuration [2, 35]"),
    "status of the arc": ("A 6.87549,B 90.00000,C 0.00000,S 2", "A 6.87549,B 90.00000,C 0.00000,S 3", ""),
    "no status": ("S 2,T 35,", "", "each once and in this order"),
    "status that is no number": ("S 2,T 35", "S 'B010',T 35", "plain decimal numbers"),
    "external axis of no robot": ("T 35,E1 0.00000", "T 35,E1 5.00000", "external axes that the robot has"),
    "point twice": ("seam_3=", "seam_2=", "another name"),
    "joints off": ("XP2={A1 -25.15427", "XP2={A1 -25.05427", "expected joint a1"),
    "frame as a point": ("DECL E6POS seam_1", "DECL FRAME seam_1", "each once and in this order"),
    "point as joints": ("DECL E6POS seam_1", "DECL E6AXIS seam_1", "each axis once"),
    "another declaration": ("ENDDAT", "DECL INT I=1\r\nENDDAT", "DECL E6AXIS, E6POS or FRAME"),
    "unused point": (
        "ENDDAT",
        "DECL E6POS p={X 0,Y 0,Z 0,A 0,B 0,C 0,S 2,T 35,E1 0,E2 0,E3 0,E4 0,E5 0,E6 0}\r\nENDDAT",
        "points that are used",
    ),
}


CHANGES = {f"alpha.src: {name}": change for name, change in SOURCE.items()} | {
    f"alpha.dat: {name}": change for name, change in DATA.items()
}


@pytest.mark.parametrize("name", CHANGES)
def test_changes_of_a_file_are_noticed(name: str) -> None:
    job = job_with()
    files, file = KRL.render(job), name.partition(":")[0]
    old, new, words = CHANGES[name]
    assert old in files[file]

    text = noticed(job, files | {file: files[file].replace(old, new, 1)})

    assert text
    assert words in text


def test_unchanged_files_are_executed_on_the_lines() -> None:
    job = job_with()

    (program,) = executed_programs(job, KRL, [run_of(job)], KRL.read(job.frame, KRL.render(job)))

    rows = program.robots[ROBOT]
    assert rows.tube is not None
    np.testing.assert_allclose(rows.q[-1], job.programs[0].robots[ROBOT].q[-1], rtol=0.0, atol=1e-6)


@pytest.mark.parametrize(
    ("old", "new"), [("TOOL_DATA[3]", "TOOL_DATA[4]"), ("BASE_DATA[5]", "BASE_DATA[6]"), ("BASE_DATA[5]", "$NULLFRAME")]
)
def test_other_numbers_are_noticed(old: str, new: str) -> None:
    job = job_with(**NUMBERED)
    files = KRL.render(job)

    text = noticed(job, files | {"alpha.src": files["alpha.src"].replace(old, new)})

    assert f"expected {old} as the cell states it" in text


def test_another_weld_data_set_is_noticed() -> None:
    job = job_with(process=ARC)
    files = KRL.render(job)

    text = noticed(job, files | {"alpha.src": files["alpha.src"].replace("WELD1", "WELD2")})

    assert "expected a statement that these programs have, got 'ARC_ON(WELD2)'" in text
