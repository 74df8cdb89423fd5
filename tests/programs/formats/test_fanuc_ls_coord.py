"""TP of an arm and a positioner with seams: points are joints of both, the tool moves relative to the leader."""

import re
from dataclasses import replace

import numpy as np
import pytest
from builders.elbow_arm import tip
from builders.mutations import LANGUAGES, mutations
from builders.seam_jobs import ROBOT, poses
from builders.seams_in_step import HELD, TABLE, fanuc_in_step, part_at, run_in_step, shapes

from cellplan.errors import InputError, LineRefusedError, NotVerifiedError
from cellplan.geometry.transforms import inverse, rotation_vector
from cellplan.model.report.exported import ExportJob, ProgramRows
from cellplan.programs.elements.joints import from_numbers
from cellplan.programs.formats.fanuc_ls.writer import FANUC_LS
from cellplan.programs.judgement.compare_rows import other_rows
from cellplan.programs.seams.executed import executed_programs

MAIN, SEAM = "BOX.ls", "BOX_SEAM.ls"
QUANTUM = np.deg2rad(1e-4)


def instructions(text: str) -> list[str]:
    """What a program does, without remarks."""
    lines = re.sub(r"\r\n +: +", " ", text).split("/MN")[1].split("/POS")[0].splitlines()
    said = [line.partition(":")[2].strip().removesuffix(" ;") for line in lines if line.strip()]
    return [line for line in said if not line.startswith("!")]


def run_of(job: ExportJob) -> ProgramRows:
    """All rows of its run, at its times."""
    run = run_in_step(job)
    return replace(run, robots={name: replace(rows, times=2.0 * rows.times) for name, rows in run.robots.items()})


def finding(job: ExportJob, files: dict[str, str]) -> str:
    """What is said of files: by the reader, in the comparison of rows, or where seams are executed."""
    try:
        read = FANUC_LS.read(job.frame, files)
        said = next(other_rows(FANUC_LS, job, read), "")
        if not said:
            executed_programs(job, FANUC_LS, [run_of(job)], read)
    except (InputError, NotVerifiedError) as error:
        return str(error)
    return said


def test_a_seam_on_a_part_that_moves_is_a_program_of_coordinated_motions() -> None:
    files = FANUC_LS.render(fanuc_in_step())

    frames = ["UFRAME_NUM=0", "UTOOL_NUM=2", "UFRAME_NUM[GP2]=0", "UTOOL_NUM[GP2]=1"]
    assert set(files) == {MAIN, SEAM}
    last = "J P[2] 2000msec FINE"
    assert instructions(files[MAIN]) == [*frames, "J P[1] 10% FINE", "CALL BOX_SEAM", *frames, last]
    assert instructions(files[SEAM]) == [
        *frames,
        "J P[1] 2000msec FINE",
        "L P[2:seam_1] 50mm/sec FINE COORD Weld Start[1,1]",
        "Weave Sine[1]",
        "L P[3:seam_2] 8mm/sec CR10 COORD",
        "C P[4:seam_3] P[5:seam_4] 8mm/sec FINE COORD Weld End[1,1]",
        "Weave End",
        "L P[6:seam_5] 50mm/sec FINE COORD",
    ]
    assert "! COORD: leader GP2 ;" in files[SEAM]


def test_rows_and_axes_of_both_come_back() -> None:
    job = fanuc_in_step()

    (read,) = FANUC_LS.read(job.frame, FANUC_LS.render(job))

    assert list(other_rows(FANUC_LS, job, (read,))) == []
    np.testing.assert_allclose(read.robots[TABLE].q, HELD, rtol=0.0, atol=QUANTUM)
    arm, written = read.robots[ROBOT], job.programs[0].robots[ROBOT]
    np.testing.assert_allclose(arm.q, written.q, rtol=0.0, atol=3.0 * QUANTUM)
    assert arm.seams == written.seams
    np.testing.assert_array_equal(arm.process, written.process)
    np.testing.assert_allclose(arm.durations, [np.nan, 2.0, *[np.nan] * 5, 2.0])
    off = inverse(arm.X_PT[2:7]) @ poses()[1:]
    assert np.abs(off[:, :3, 3]).max() < 1e-5
    assert np.abs(rotation_vector(off[:, :3, :3])).max() < 1e-5


def test_the_joints_of_the_text_put_the_tool_on_the_seam() -> None:
    """Points of both groups, taken without the reader."""
    job = fanuc_in_step()
    robot, text = job.frame.robot(ROBOT), FANUC_LS.render(job)[SEAM]

    points = re.findall(r"(?s)P\[(\d)[^{]*\{\s+GP1:(.*?)GP2:(.*?)\};", text)

    assert [number for number, _, _ in points] == list("123456")
    for (_, arm, held), X in zip(points, poses(), strict=True):
        q, turned = (np.array(re.findall(r"J\d = (\S+) deg", group), dtype=float) for group in (arm, held))
        on_part = inverse(part_at(np.deg2rad(turned))) @ tip(robot, from_numbers(robot, q[None])[0])
        np.testing.assert_allclose(on_part, X, rtol=0.0, atol=1e-5)


def test_the_tool_follows_its_lines_on_the_part() -> None:
    job = fanuc_in_step()
    read = FANUC_LS.read(job.frame, FANUC_LS.render(job))

    (program,) = executed_programs(job, FANUC_LS, [run_of(job)], read)

    arm, turning = program.robots[ROBOT], program.robots[TABLE]
    for first, last, shape in shapes():
        inside = np.flatnonzero((arm.times > 2.0 * first) & (arm.times < 2.0 * last))
        assert len(inside) > 10
        for row in inside:
            on_part = inverse(part_at(turning.q[row])) @ tip(job.frame.robot(ROBOT), arm.q[row])
            share = shape.shares(on_part[None, :3, 3])
            np.testing.assert_allclose(on_part, shape.poses(share)[0], rtol=0.0, atol=1e-5)


CHANGES = {
    "no COORD": (SEAM, "CR10 COORD", "CR10", "expected COORD behind a line or an arc of groups in step"),
    "another leader": (SEAM, "CR10 COORD", "CR10 COORD[2]", "expected COORD behind"),
    "feed": (SEAM, "8mm/sec CR10", "9mm/sec CR10", "expected a speed of 8 mm/s, read 9 mm/s"),
    "corner": (SEAM, "CR10", "CR30", "row 4: expected rounding of at most 0.2"),
    "duration": (MAIN, "J P[2] 2000msec", "J P[2] 2400msec", "row 8: expected a motion of 2 s, read 2.4 s"),
    "first speed": (MAIN, "J P[1] 10%", "J P[1] 20%", "row 1: expected a speed of the joints of 10, read 20"),
    "process": (SEAM, "\r\n    :  Weld End[1,1]", "", "expected after this move, statements of its process"),
    "wait": (
        SEAM,
        "50mm/sec FINE COORD ;\r\n/POS",
        "50mm/sec FINE COORD ;\r\n  99:  WAIT DI[1]=ON ;\r\n/POS",
        "statements of its process",
    ),
    "tool": (SEAM, "UTOOL_NUM=2", "UTOOL_NUM=1", "expected UTOOL_NUM=2 as the cell states it"),
    "joint of the arm": (SEAM, r"(seam_2\"\]\{.*?J1 = )(\S+)", None, "row 4: expected joint"),
    "joint of the table": (SEAM, r"(seam_2\"\]\{.*?GP2:.*?J1 = )(\S+)", None, "'table': row 4: expected joint"),
    "joint within the arc": (SEAM, r"(seam_3\"\]\{.*?J4 = )(\S+)", None, "row 5: expected joint"),
}


@pytest.mark.parametrize("name", CHANGES)
def test_a_change_is_noticed(name: str) -> None:
    job = fanuc_in_step()
    files, (file, old, new, words) = FANUC_LS.render(job), CHANGES[name]
    if new is None:  # a number that is 0.01 more
        changed = re.sub(old, lambda it: f"{it[1]}{float(it[2]) + 0.01:.4f}", files[file], count=1, flags=re.S)
    else:
        changed = files[file].replace(old, new, 1)
    assert changed != files[file]

    assert words in finding(job, files | {file: changed})


@pytest.mark.slow
def test_every_change_of_the_programs_is_noticed() -> None:
    job = fanuc_in_step()
    files = FANUC_LS.render(job)
    changes = list(mutations(files, LANGUAGES["fanuc_ls"]))

    assert len(changes) > 300
    assert [change[:5] for change in changes if not finding(job, files | {change.file: change.text})] == []


def test_another_branch_of_the_arm_is_refused_where_a_line_ends() -> None:
    """The same pose with the wrist turned over: a line does not lead there."""
    job = fanuc_in_step()
    rows = job.programs[0].robots[ROBOT]
    q = rows.q.copy()
    q[3, 3:] += [np.pi, -2.0 * q[3, 4], -np.pi]
    flipped = replace(job.programs[0], robots={**job.programs[0].robots, ROBOT: replace(rows, q=q)})
    job = replace(job, programs=(flipped,))

    assert "expected the joints with which 'alpha' comes there" in finding(job, FANUC_LS.render(job))


def test_a_part_that_no_group_beside_the_arm_holds_is_refused() -> None:
    job = fanuc_in_step()
    part = replace(job.frame.cell.part, held_by=(), X_WP=np.eye(4))
    free = replace(job, frame=replace(job.frame, cell=replace(job.frame.cell, part=part)))

    with pytest.raises(
        LineRefusedError, match=r"expected the holder of the part .* got table; write joints \(--moves j"
    ):
        FANUC_LS.render(free)


def test_a_tool_without_a_number_is_refused() -> None:
    job = fanuc_in_step()
    robots = tuple(
        replace(robot, control=robot.control.model_copy(update={"tool_number": None}))
        for robot in job.frame.cell.robots
    )

    with pytest.raises(InputError, match=r"^robots\.alpha\.controller\.tool_number: expected the number"):
        FANUC_LS.render(replace(job, frame=replace(job.frame, cell=replace(job.frame.cell, robots=robots))))
