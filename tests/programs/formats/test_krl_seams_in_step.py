"""KRL of an arm and its positioner with seams: the part moves while the tool works, all axes in each point."""

import re
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest
from builders.elbow_arm import tip
from builders.seam_jobs import ROBOT
from builders.seams_in_step import HELD, TABLE, job_beside, job_in_step, part_at, run_in_step, shapes, table

from cellplan.errors import InputError, LineRefusedError, NotVerifiedError, raise_findings, refusals
from cellplan.geometry.transforms import inverse, pose_from, rotation_from_rpy
from cellplan.model.report.exported import ExportJob, Moves, RobotRows
from cellplan.programs.elements.escapes import with_register
from cellplan.programs.formats.krl.escape import KRL_ESCAPE
from cellplan.programs.formats.krl.writer import KRL
from cellplan.programs.judgement.compare_rows import other_rows
from cellplan.programs.promises.run_programs import RunPhase, RunProgram, spoilt_by_another_order
from cellplan.programs.seams.executed import executed_programs

EK = "$BASE=EK(MACHINE_DEF[2].ROOT,MACHINE_DEF[2].MECH_TYPE,PART_FRAME_1)"
QUANTUM = np.deg2rad(1e-5)


@pytest.mark.parametrize("number", [None, 7])
def test_seams_and_axes_of_both_come_back(number: int | None) -> None:
    job = job_in_step(number=number)

    files = KRL.render(job)
    (read,) = KRL.read(job.frame, files)

    assert sorted(files) == ["alpha.dat", "alpha.src"]
    assert list(other_rows(KRL, job, (read,))) == []
    np.testing.assert_allclose(read.robots[TABLE].q, HELD, rtol=0.0, atol=2.0 * QUANTUM)
    assert read.robots[ROBOT].seams == job.programs[0].robots[ROBOT].seams
    assert (EK in files["alpha.src"]) is (number is None)
    assert ("MECH_TYPE,BASE_DATA[7])" in files["alpha.src"]) is (number == 7)
    assert "WAIT FOR" not in files["alpha.src"]


def test_the_text_puts_the_tool_where_all_axes_do() -> None:
    """Frame, poses and external axes of the text, without the reader: the flange of the table carries the frame."""
    job = job_in_step()
    robot, rows = job.frame.robot(ROBOT), job.programs[0].robots[ROBOT]
    data = KRL.render(job)["alpha.dat"]

    def values(name: str) -> dict[str, float]:
        match = re.search(rf" {name}={{([^}}]*)}}", data)
        assert match is not None
        return {part.split()[0]: float(part.split()[1]) for part in match[1].split(",")}

    def frame(name: str) -> np.ndarray:
        stated = values(name)
        turn = rotation_from_rpy(np.deg2rad([stated["C"], stated["B"], stated["A"]]))
        return pose_from(turn, np.array([stated[axis] for axis in "XYZ"]) / 1000.0)

    for point, row in enumerate(range(2, 7), start=1):
        stated = values(f"seam_{point}")
        flange = tip(table(), np.deg2rad([stated["E1"], stated["E2"]]))
        X_WT = flange @ frame("PART_FRAME_1") @ frame(f"seam_{point}")
        np.testing.assert_allclose(X_WT, tip(robot, rows.q[row]), rtol=0.0, atol=1e-6)


def executed(job: ExportJob, *, uneven: float = 0.0, is_rounded: bool = True) -> Mapping[str, RobotRows]:
    """The rows of both as the controller executes them."""
    (read,) = KRL.read(job.frame, KRL.render(job))
    if not is_rounded:
        stops = {name: replace(rows, rounding=np.zeros(len(rows))) for name, rows in read.robots.items()}
        read = replace(read, robots=stops)
    (program,) = executed_programs(job, KRL, [run_in_step(job, uneven=uneven)], (read,))
    return program.robots


@pytest.mark.parametrize(("make", "uneven"), [(job_in_step, 0.0), (job_in_step, 0.02), (job_beside, 0.02)])
def test_tool_and_table_are_where_the_language_puts_them(make: Callable[[], ExportJob], uneven: float) -> None:
    """The table moves evenly with the way of the tool on the part, whatever it did in the run."""
    job = make()
    robots = executed(job, uneven=uneven)
    arm, turning = robots[ROBOT], robots[TABLE]

    assert np.array_equal(arm.times, turning.times)
    for first, last, shape in shapes():
        inside = np.flatnonzero((arm.times > first) & (arm.times < last))
        assert len(inside) > 10
        for row in inside:
            on_part = inverse(part_at(turning.q[row])) @ tip(job.frame.robot(ROBOT), arm.q[row])
            share = shape.shares(on_part[None, :3, 3])
            np.testing.assert_allclose(on_part, shape.poses(share)[0], rtol=0.0, atol=2e-7)
            even = HELD[first] + share * (HELD[last] - HELD[first])
            np.testing.assert_allclose(turning.q[row], even, rtol=0.0, atol=3.0 * QUANTUM)


def test_the_tube_of_a_corner_holds_what_the_table_may_cut() -> None:
    """A parabola between both motions of the table is inside its tube, and the arm has room to follow it."""
    job = job_in_step()
    robots = executed(job)
    arm, turning = robots[ROBOT], robots[TABLE]
    lengths = [shape.length for _, _, shape in shapes()[1:3]]
    radius = arm_radius(job)
    rates = [(HELD[3] - HELD[2]) / lengths[0], (HELD[5] - HELD[3]) / lengths[1]]
    cut = 0.25 * radius * np.abs(rates[1] - rates[0])  # in the middle of a parabola

    steps = np.flatnonzero(turning.tube[:, 4:].max(axis=1) > 0.0)
    assert np.all(turning.tube[steps, 4:] >= 2.0 * cut - 1e-9)
    assert np.all(np.abs(turning.times[steps] - 3.0) < 0.5)
    stopped = executed(job, is_rounded=False)[ROBOT].tube
    near = np.flatnonzero(np.abs(arm.times[1:] - 3.0) < 0.05)
    assert np.all(arm.tube[near, 4:].max(axis=1) > stopped[near, 4:].max(axis=1))


def arm_radius(job: ExportJob) -> float:
    """Distance in [m] within which the corner between line and arc is rounded."""
    match = re.search(r"\$APO\.CDIS=([\d.]+)", KRL.render(job)["alpha.src"])
    assert match is not None
    return float(match[1]) / 1000.0


def test_a_table_that_would_be_too_fast_is_refused() -> None:
    job = job_in_step()
    (read,) = KRL.read(job.frame, KRL.render(job))
    model = table().model
    slow = replace(model, joints=tuple(replace(joint, velocity=0.003) for joint in model.joints))
    robots = tuple(replace(one, model=slow) if one.name == TABLE else one for one in job.frame.cell.robots)
    slowed = replace(job, frame=replace(job.frame, cell=replace(job.frame.cell, robots=robots)))

    with pytest.raises(NotVerifiedError, match=r"of 'table' would move at .* deg/s at 50 mm/s, allowed 0.1719"):
        executed_programs(slowed, KRL, [run_in_step(job)], (read,))


CHANGES = {
    "machine": ("alpha.src", "MACHINE_DEF[2].ROOT", "MACHINE_DEF[3].ROOT", "MACHINE_DEF[2].MECH_TYPE,PART_FRAME_1) as"),
    "fixed base": ("alpha.src", EK, "$BASE=PART_FRAME_1", "PART_FRAME_1) as the cell states it, got '$BASE=PART"),
    "no base": ("alpha.src", f"{EK}\r\n", "", "expected EK(MACHINE_DEF[2]"),
    "no axes": ("alpha.src", "$ACT_EX_AX=2\r\n", "", "behind $BASE and $VEL.CP"),
    "other axes": ("alpha.src", "$ACT_EX_AX=2", "$ACT_EX_AX=1", "expected $ACT_EX_AX=2 as the cell states it"),
    "axes of a joint point": (
        "alpha.dat",
        "E1 0.00000,E2 0.00000",
        "E1 0.01000,E2 0.00000",
        "'table': row 1: expected",
    ),
    "axes of a pose": ("alpha.dat", "E1 0.57296", "E1 0.58296", "robot 'table': row 3: expected joint"),
    "another axis": ("alpha.dat", "E2 -2.86479,E3 0.00000", "E2 -2.86479,E3 1.00000", "external axes that the robot"),
    "frame on the flange": ("alpha.dat", "PART_FRAME_1={X ", "PART_FRAME_1={X 1", "expected PART_FRAME_1 as the cell"),
    "wait": ("alpha.src", "LIN seam_1", "WAIT FOR $IN[1]\r\nLIN seam_1", "a statement that these programs have"),
}


def test_beside_another_controller_both_wait_for_its_arm_and_nothing_else_changes() -> None:
    job, alone = job_beside(), KRL.render(job_in_step())
    files = KRL.render(job)
    (read,) = KRL.read(job.frame, files)

    assert list(other_rows(KRL, job, (read,))) == []
    assert read.robots[TABLE].marks == read.robots[ROBOT].marks == (0, 5, 7)
    wait = "WAIT FOR $IN[101]\r\n$OUT[10]=TRUE\r\nWAIT FOR NOT $IN[101]\r\n$OUT[10]=FALSE\r\n"
    assert files["alpha.src"].count(wait) == 3
    assert files["alpha.src"].replace(wait, "").replace("$OUT[10]=FALSE\r\n", "") == alone["alpha.src"]
    assert files["alpha.dat"] == alone["alpha.dat"]
    without = KRL.read(job.frame, files | {"alpha.src": files["alpha.src"].replace(wait, "", 1)})
    assert "expected waits at rows [0, 5, 7], read [5, 7]" in "".join(other_rows(KRL, job, without))


def test_the_part_may_move_under_a_tool_that_moves_in_step_and_under_no_other() -> None:
    job = job_beside()
    cell, rows = job.frame.cell, run_in_step(job)
    times = rows.robots[ROBOT].times
    assert times is not None
    q = np.hstack([rows.robots[TABLE].q, rows.robots[ROBOT].q, np.zeros((len(times), 6))])
    phase = RunPhase(name="work", place=0, first=0, last=len(times) - 1)
    inside = (times > 1.5) & (times < 5.5)
    program = RunProgram(name=None, times=times, q=q, phases=(phase,), process={cell.tasks[0].name: inside})

    assert list(spoilt_by_another_order(cell, program)) == []
    of_other = replace(cell, tasks=(replace(cell.tasks[0], robot="beta"),))
    assert "the part moves while the tool of 'beta' is in process" in next(spoilt_by_another_order(of_other, program))


@pytest.mark.parametrize(
    ("form", "words"), [("arm", "--robot: expected 'table' too"), ("escape", "--escape: expected")]
)
def test_an_arm_without_its_positioner_and_escapes_of_both_are_refused(form: str, words: str) -> None:
    job = job_beside()
    frame = replace(job.frame, robots=(ROBOT,)) if form == "arm" else job.frame
    dialect = KRL if form == "arm" else with_register(KRL, KRL_ESCAPE)

    with pytest.raises(InputError, match=words):
        raise_findings(refusals(*dialect.demands(frame, int)))


@pytest.mark.parametrize("name", CHANGES)
def test_a_change_is_noticed(name: str) -> None:
    job = job_in_step()
    files, (file, old, new, words) = KRL.render(job), CHANGES[name]
    assert old in files[file]
    try:
        read = KRL.read(job.frame, files | {file: files[file].replace(old, new, 1)})
        text = "\n".join(other_rows(KRL, job, read))
    except InputError as error:
        text = str(error)
        assert re.match(r"alpha\.(src|dat):\d+: expected ", text), text

    assert words in text


def test_a_positioner_without_a_number_is_refused_where_it_moves_the_frame() -> None:
    job = job_in_step()
    control = table().control
    assert control is not None
    unknown = replace(table(), control=control.model_copy(update={"machine": None}))
    robots = tuple(unknown if one.name == TABLE else one for one in job.frame.cell.robots)
    frame = replace(job.frame, cell=replace(job.frame.cell, robots=robots))

    with pytest.raises(InputError, match=r"^robots\.table\.controller\.machine: expected its number in MACHINE_DEF"):
        KRL.render(replace(job, frame=frame))
    with pytest.raises(LineRefusedError) as refused:  # for which tasks move by joints where moves are chosen
        KRL.render(replace(job, frame=replace(frame, moves=Moves.AUTO)))
    assert refused.value.task == "seam"
    assert refused.value.reason.startswith("robots.table.controller.machine: expected its number")
    in_joints = replace(frame, moves=Moves.JOINTS)
    assert "MACHINE_DEF" not in "".join(KRL.render(replace(job, frame=in_joints)).values())
