"""URScript with seams: what is written is read back as it was, and every change of a file is noticed."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.elbow_arm import tip
from builders.seam_jobs import KUKA_ZERO, ROBOT, SEAM, UR_VALVE, run_of, seam_job

from cellplan.errors import InputError, NotVerifiedError
from cellplan.geometry.transforms import pose_from, rotation_exp
from cellplan.model.report.exported import ExportJob
from cellplan.model.settings.controllers import KindName
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.formats.urscript.writer import URSCRIPT
from cellplan.programs.judgement.compare_rows import other_rows
from cellplan.programs.seams.executed import executed_programs

FILE = "alpha.script"
GUN: dict[str, Any] = {"on": "gun_on({data})", "off": "gun_off()", "data": {"seam": "4"}}


@pytest.mark.parametrize("process", [UR_VALVE, GUN, None], ids=str)
def test_seams_come_back_as_they_were(process: dict[str, Any] | None) -> None:
    job = seam_job("ur", process=process)
    written = job.programs[0].robots[ROBOT]

    read = URSCRIPT.read(job.frame, URSCRIPT.render(job))

    rows = read[0].robots[ROBOT]
    assert list(other_rows(URSCRIPT, job, read)) == []
    assert rows.seams == (SEAM,)
    assert (rows.process is None) is (process is None)
    assert rows.process is None or np.array_equal(rows.process, written.process)
    np.testing.assert_allclose(rows.feeds, written.feeds, atol=1e-9)
    executed_programs(job, URSCRIPT, [run_of(job)], read)


def test_the_text_puts_the_tool_where_the_joints_do() -> None:
    """Tool, frame and points taken from the text, without the reader: rotation vectors, in metres."""
    job = seam_job("ur", process=UR_VALVE)
    robot, rows = job.frame.robot(ROBOT), job.programs[0].robots[ROBOT]
    text = URSCRIPT.render(job)[FILE]

    def frame(words: str) -> np.ndarray:
        match = re.search(rf"{words}p\[([^\]]*)\]", text)
        assert match is not None
        numbers = np.array([float(number) for number in match[1].split(",")])
        return pose_from(rotation_exp(numbers[3:]), numbers[:3])

    np.testing.assert_allclose(frame(r"set_tcp\("), robot.tool.X_FT, rtol=0.0, atol=1e-8)
    for point, row in enumerate(range(2, 7), start=1):
        X_WT = tip(robot, rows.q[row])
        np.testing.assert_allclose(frame("part_1 = ") @ frame(f"seam_{point} = "), X_WT, rtol=0.0, atol=1e-8)


def test_delays_that_a_routine_holds_are_not_waited_twice() -> None:
    text = URSCRIPT.render(seam_job("ur", process=GUN))[FILE]

    assert "gun_on(4)\n    movel(" in text
    assert "sleep" not in text


def noticed(job: ExportJob, text: str) -> str:
    """What is said of a changed file: by the reader, in a comparison of rows, or where seams are executed."""
    try:
        read = URSCRIPT.read(job.frame, {FILE: text})
        findings = list(other_rows(URSCRIPT, job, read))
        if not findings:
            executed_programs(job, URSCRIPT, [run_of(job)], read)
    except InputError as error:
        text = str(error)
        assert re.match(r"alpha\.script:\d+: expected ", text), text
        return text
    except NotVerifiedError as error:
        return str(error)
    return "\n".join(findings)


CHANGES: dict[str, tuple[str, str, str]] = {  # what is replaced once, what by, and what is said
    "other feed": ("v=0.008000, r=0.010770", "v=0.009000, r=0.010770", "expected a speed of 8 mm/s, read 9 mm/s"),
    "feed in millimetres": ("v=0.008000", "v=8.000000", "expected a speed of 8 mm/s, read 8000 mm/s"),
    "no feed": ("v=0.008000", "v=0.000000", "a speed above 0"),
    "feed by a time": ("v=0.008000, r=0.010770", "t=1.0, r=0.010770", "a statement that these programs have"),
    "other acceleration": ("a=1.200, v=0.05", "a=2.200, v=0.05", "expected a=1.200"),
    "other tool": ("set_tcp(p[0.000000000", "set_tcp(p[0.000200000", "expected set_tcp(p[0.000000000"),
    "no tool": ("  set_tcp(p", "  # set_tcp(p", "expected set_tcp("),
    "frame off": ("part_1 = p[0.600000000", "part_1 = p[0.600200000", "expected part_1 = p[0.600000000"),
    "frame turned": ("0.098662656, 0.399664824", "0.399664824, 0.098662656", "expected part_1 = p["),
    "point in the base": ("pose_trans(part_1, seam_1)", "seam_1", "a statement that these programs have"),
    "point in another frame": ("pose_trans(part_1, seam_1)", "pose_trans(part_2, seam_1)", "expected points in part_1"),
    "point 0.2 mm off": ("seam_2 = p[0.100000000", "seam_2 = p[0.100200000", "read a pose that is 0.2 mm"),
    "middle of the arc off": ("seam_3 = p[0.150000000", "seam_3 = p[0.150200000", "read a pose that is 0.2 mm"),
    "point turned": ("1.569882990", "1.579882990", "read a pose that is"),
    "joints off": ("j_2 = [-0.439024862", "j_2 = [-0.449024862", "expected joint a1"),
    "points exchanged": ("part_1, seam_1)", "part_1, seam_5)", "used once"),
    "line for the arc": (
        "movec(pose_trans(part_1, seam_3), pose_trans(part_1, seam_4)",
        "movel(pose_trans(part_1, seam_3), pose_trans(part_1, seam_4)",
        "movel with one point",
    ),
    "arc of another mode": ("mode=0", "mode=1", "a statement that these programs have"),
    "joints to a pose": ("movej(j_2,", "movej(seam_1,", "used once"),
    "process blended": ("v=0.050000, r=0.000000", "v=0.050000, r=0.005000", "a stop where a process goes on or off"),
    "larger blend": ("r=0.010770", "r=0.012000", "expected rounding of at most 0.2"),
    "blend beside a seam": ("movej(j_2, a=20.000, v=2.304", "movej(j_2, a=20.000, v=2.304, r=0.0100", "a stop beside"),
    "on and off exchanged": ("set_digital_out(3,True)", "set_digital_out(3,False)", "expected"),
    "never on": ("    set_digital_out(3,True)\n    sleep(0.300)\n", "", "a process that is on before"),
    "never off": ("    sleep(0.200)\n    set_digital_out(3,False)\n", "", "as a stop ends its process"),
    "other output": ("set_digital_out(3,True)", "set_digital_out(4,True)", "a statement that these programs have"),
    "no delay": ("    sleep(0.300)\n", "", "as the cell states them"),
    "halt": ("    sleep(0.300)\n", "    sleep(0.300)\n    halt\n", "a statement that these programs have"),
    "seam twice": ("  seam()\n", "  seam()\n  seam()\n", "a statement that these programs have"),
    "seam left out": ("  seam()\n", "", "routines that are called once"),
    "routine of no task": ("def seam():", "def beam():", "the routine of a task of the robot"),
    "line outside of a routine": (
        "  seam()\n",
        "  movel(pose_trans(part_1, seam_5), a=1.200, v=0.1, r=0.0)\n",
        "routine",
    ),
    "unused point": ("  def seam", "  j_9 = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]\n  def seam", "points that are used"),
    "point twice": ("  j_8 =", "  j_2 =", "another name"),
    "two turns": ("j_8 = [0.200000000", "j_8 = [13.200000000", "within two turns"),
    "fast joints": ("a=20.000, v=2.258", "a=20.000, v=92.258", "a speed above 0 and up to"),
    "fast first row": ("a=0.500, v=0.250", "a=0.500, v=1.250", "to the first row"),
    "no end": ("\nend\n", "\n", "expected"),
}


@pytest.mark.parametrize("name", CHANGES)
def test_changes_of_a_file_are_noticed(name: str) -> None:
    job = seam_job("ur", process=UR_VALVE)
    text = URSCRIPT.render(job)[FILE]
    old, new, words = CHANGES[name]
    assert old in text

    said = noticed(job, text.replace(old, new, 1))

    assert said
    assert words in said


@pytest.mark.parametrize(("form", "kind"), [("krl", "kuka"), ("val3", "staubli"), ("urscript", "ur")])
def test_places_and_speeds_that_no_decimal_meets_come_back(form: str, kind: KindName) -> None:
    rng, dialect = np.random.default_rng(1), DIALECTS[form]
    for _ in range(5):
        job = seam_job(kind, controller=KUKA_ZERO)
        rows = job.programs[0].robots[ROBOT]
        assert rows.X_PT is not None
        assert rows.feeds is not None
        X_PT = rows.X_PT.copy()
        X_PT[2:7, :3, 3] += rng.uniform(-1e-4, 1e-4, (5, 3))
        changed = replace(rows, X_PT=X_PT, feeds=rows.feeds * rng.uniform(0.5, 1.0))
        job = replace(job, programs=(replace(job.programs[0], robots={ROBOT: changed}),))

        assert list(other_rows(dialect, job, dialect.read(job.frame, dialect.render(job)))) == []
