"""INFORM: jobs with seams are read back as they were, and every change of a file is noticed."""

import re
from dataclasses import replace

import numpy as np
import pytest
from builders.elbow_arm import tip
from builders.scene_builders import work
from builders.seam_jobs import (
    ARC_AND_WEAVE,
    CONTROLLER,
    PLACES,
    ROBOT,
    SEAM,
    X_WP,
    inform_job,
    joints_at,
    poses,
    run_of,
    seam_job,
)

from cellplan.errors import InputError, NotVerifiedError, refusals
from cellplan.geometry.transforms import pose_from, rotation_exp
from cellplan.model.report.exported import ExportJob, Moves, RobotRows
from cellplan.model.settings.controllers import ControllerEntry
from cellplan.model.task.task import SpacePolylinePath
from cellplan.programs.formats.inform.positions import configuration, joints_of
from cellplan.programs.formats.inform.writer import INFORM
from cellplan.programs.judgement.compare_rows import other_rows
from cellplan.programs.seams.executed import executed_programs
from cellplan.scene.kinematics.screw_chain import ScrewChain

TURNS = np.eye(3)


@pytest.fixture(scope="module")
def job() -> ExportJob:
    return inform_job()


@pytest.fixture(scope="module")
def files(job: ExportJob) -> dict[str, str]:
    return INFORM.render(job)


def test_a_job_and_that_of_its_seam_come_back_as_they_were(job: ExportJob, files: dict[str, str]) -> None:
    written = job.programs[0].robots[ROBOT]

    (program,) = INFORM.read(job.frame, files)

    rows = program.robots[ROBOT]
    assert sorted(files) == ["ALPHA.JBI", "SEAM.JBI"]
    assert list(other_rows(INFORM, job, (program,))) == []
    assert rows.seams == (SEAM,)
    assert np.array_equal(rows.process, written.process)
    np.testing.assert_allclose(rows.feeds, written.feeds, atol=1e-9)
    np.testing.assert_allclose(rows.q[[0, 1, 7]], written.q[[0, 1, 7]], atol=2e-5)
    (executed,) = executed_programs(job, INFORM, [run_of(job)], (program,))
    np.testing.assert_allclose(executed.robots[ROBOT].q[-1], written.q[-1], atol=2e-5)


def test_positions_put_the_tool_where_the_joints_do(job: ExportJob, files: dict[str, str]) -> None:
    """Angles of a position turn about the fixed axes x, y and z of its frame, the first about x."""
    rows, robot = job.programs[0].robots[ROBOT], job.frame.robot(ROBOT)
    positions = {
        name: {
            number: np.array([float(part) for part in fields.split(",")])
            for number, fields in re.findall(r"C(\d{5})=(\S+)", text)
        }
        for name, text in files.items()
    }
    points = dict(re.findall(r"(MOV[JLC] C\d{5})( )", files["SEAM.JBI"]))
    assert len(points) == 7
    for name, X_WC, first, row in (
        ("ALPHA.JBI", np.eye(4), "00000", 0),
        ("SEAM.JBI", X_WP, "00000", 1),
        ("SEAM.JBI", X_WP, "00001", 2),
        ("SEAM.JBI", X_WP, "00002", 3),
        ("SEAM.JBI", X_WP, "00004", 4),
        ("SEAM.JBI", X_WP, "00005", 5),
    ):
        numbers = positions[name][first]
        R = np.eye(3)
        for axis, angle in zip(TURNS, np.deg2rad(numbers[3:]), strict=True):
            R = rotation_exp(angle * axis) @ R
        X = X_WC @ pose_from(R, numbers[:3] / 1000.0)
        np.testing.assert_allclose(X, tip(robot, rows.q[row]), rtol=0.0, atol=1e-5)


def test_a_seam_has_few_statements_and_the_process_stands_at_its_ends(files: dict[str, str]) -> None:
    statements = files["SEAM.JBI"].partition("NOP\r\n")[2].split("\r\n")

    assert [re.sub(r"C\d{5}", "C", line) for line in statements] == [
        statements[0].replace("C00000", "C"),
        "MOVL C V=50.0 PL=0",
        "ARCON ASF#(1)",
        "WVON WEV#(1)",
        "MOVL C V=8.0 PL=1",
        "MOVC C V=8.0 PL=1",
        "MOVC C V=8.0 PL=1",
        "MOVC C V=8.0 PL=0",
        "WVOF",
        "ARCOF AEF#(1)",
        "MOVL C V=50.0 PL=0",
        "END",
        "",
    ]


def test_joints_follow_from_a_pose_and_its_configuration(job: ExportJob) -> None:
    robot = job.frame.robot(ROBOT)
    rng = np.random.default_rng(3)
    q = rng.uniform(0.9 * np.maximum(robot.model.lower, -np.pi), 0.9 * np.minimum(robot.model.upper, np.pi), (200, 6))
    poses, stated = ScrewChain(robot).tool_poses(q), configuration(robot, q)
    again = [joints_of(robot, X, row) for X, row in zip(poses, stated, strict=True)]

    off = [np.inf if other is None else np.abs(other - one).max() for one, other in zip(q, again, strict=True)]

    assert len({tuple(row) for row in stated.tolist()}) == 8
    assert max(off) < 1e-6


CHANGES = {
    "feed": ("SEAM.JBI", "C00002 V=8.0", "C00002 V=9.0"),
    "user frame": ("SEAM.JBI", "///USER 2", "///USER 3"),
    "frame of the job": ("SEAM.JBI", "///FRAME USER 2", "///FRAME USER 3"),
    "tool": ("SEAM.JBI", "///TOOL 1", "///TOOL 2"),
    "wrist": ("SEAM.JBI", "///RCONF 1,", "///RCONF 0,"),
    "elbow": ("SEAM.JBI", r"(///RCONF \d),0", r"\1,1"),
    "half turn": ("SEAM.JBI", r"(///RCONF \d,\d,\d),0", r"\1,1"),
    "point 0.2 mm off": ("SEAM.JBI", r"C00002=100\.000", "C00002=100.200"),
    "on and off": ("SEAM.JBI", r"ARCON ASF#\(1\)", "ARCOF AEF#(1)"),
    "weave that never ends": ("SEAM.JBI", "WVOF\r\n", ""),
    "no weave": ("SEAM.JBI", r"WVON WEV#\(1\)\r\n", ""),
    "another weave": ("SEAM.JBI", r"WEV#\(1\)", "WEV#(2)"),
    "another condition": ("SEAM.JBI", r"ASF#\(1\)", "ASF#(2)"),
    "rounded end": ("SEAM.JBI", r"(MOVC C00005 V=8\.0) PL=0", r"\1 PL=1"),
    "stop within": ("SEAM.JBI", r"(MOVL C00002 V=8\.0) PL=1", r"\1 PL=0"),
    "larger level": ("SEAM.JBI", r"(MOVL C00002 V=8\.0) PL=1", r"\1 PL=8"),
    "number of positions": ("SEAM.JBI", "///NPOS 7", "///NPOS 6"),
    "no end": ("SEAM.JBI", "END\r\n", ""),
    "position used twice": ("SEAM.JBI", "MOVL C00002", "MOVL C00001"),
    "line for an arc": ("SEAM.JBI", "MOVC C00004", "MOVL C00004"),
    "joints for a line": ("SEAM.JBI", r"MOVL C00006 V=50\.0", "MOVJ C00006 VJ=50.00"),
    "another job": ("ALPHA.JBI", "CALL JOB:SEAM", "CALL JOB:BEAM"),
    "no call": ("ALPHA.JBI", "CALL JOB:SEAM\r\n", ""),
    "a jump": ("ALPHA.JBI", "CALL JOB:SEAM\r\n", "JUMP *A\r\nCALL JOB:SEAM\r\n"),
    "first motion rounded": ("ALPHA.JBI", r"(MOVJ C00000 VJ=10\.00) PL=0", r"\1 PL=1"),
    "home": ("ALPHA.JBI", r"C00000=(-?\d+)\.(\d)", r"C00000=\1.9\2"),
    "pulses": ("ALPHA.JBI", "///POSTYPE ROBOT", "///POSTYPE PULSE"),
    "another group": ("SEAM.JBI", "///GROUP1 RB1", "///GROUP1 RB2"),
    "a name": ("SEAM.JBI", "//NAME SEAM", "//NAME BEAM"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_change_of_a_file_is_noticed(change: str, job: ExportJob, files: dict[str, str]) -> None:
    name, pattern, repl = CHANGES[change]
    text, count = re.subn(pattern, repl, files[name], count=1)
    assert count == 1
    assert text != files[name]

    try:
        read = INFORM.read(job.frame, files | {name: text})
        finding = next(other_rows(INFORM, job, read), "")
        if not finding:
            executed_programs(job, INFORM, [run_of(job)], read)
    except (InputError, NotVerifiedError) as error:
        finding = str(error)

    assert finding


@pytest.mark.parametrize(
    ("stated", "message"),
    [
        (
            {"tool_number": None},
            "robots.alpha.controller.tool_number: expected the number of its tool on the controller",
        ),
        ({"tool_number": 64}, "robots.alpha.controller.tool_number: expected the number of its tool on the controller"),
    ],
)
def test_numbers_that_are_missing_are_named(stated: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as error:
        INFORM.render(inform_job(**stated))
    assert "robots.alpha.controller.tool_number: expected the number of its tool on the controller" in str(error.value)
    assert message in str(error.value)


def small_corner(levels: tuple[float, ...]) -> ExportJob:
    """The job whose corner may be rounded within 10.77 mm of it, on a controller with some position levels in [mm]."""
    job = seam_job("yaskawa", process=ARC_AND_WEAVE, control={"tool_number": 1, "frames": (2,)}, number=2)
    entry = job.frame.cell.controllers[CONTROLLER]
    stated = ControllerEntry.model_validate(entry.model_dump(exclude_unset=True) | {"position_levels_mm": levels})
    cell = replace(job.frame.cell, controllers={CONTROLLER: stated})
    return replace(job, frame=replace(job.frame, cell=cell))


@pytest.mark.parametrize(
    ("kind", "levels", "message"),
    [
        ("kuka", (1.0,), "unexpected key, it applies to kind yaskawa only, got kuka"),
        ("yaskawa", (1.0, 1.0), "expected rising distances above 0, got"),
        ("yaskawa", (0.0, 1.0), "expected rising distances above 0, got"),
    ],
)
def test_levels_that_do_not_rise_are_refused(kind: str, levels: tuple[float, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ControllerEntry.model_validate({"kind": kind, "position_levels_mm": levels})


@pytest.mark.parametrize(("levels", "cure"), [((), "state position_levels_mm"), ((20.0, 30.0), "allow more")])
def test_a_corner_that_no_known_level_rounds_so_little_is_refused(levels: tuple[float, ...], cure: str) -> None:
    with pytest.raises(NotVerifiedError, match=f"task 'seam': row 4: a corner in process.* {cure}"):
        INFORM.render(small_corner(levels))


@pytest.mark.parametrize(("moves", "is_needed"), [(Moves.LINEAR, True), (Moves.AUTO, False)])
def test_a_closed_path_in_process_needs_levels_before_anything_is_computed(moves: Moves, is_needed: bool) -> None:
    """With lines where they can be it may be written by joints."""
    for path, is_closed in ((work(ROBOT).path, True), (SpacePolylinePath(points=PLACES[1:4], is_closed=False), False)):
        for levels in ((), (1.0,)):
            frame = small_corner(levels).frame
            cell = replace(frame.cell, tasks=(replace(frame.cell.tasks[0], path=path),))
            findings = list(refusals(*INFORM.demands(replace(frame, cell=cell, moves=moves), int)))
            assert len(findings) == (is_needed and is_closed and not levels)
            assert all("box.position_levels_mm: expected the distances of PL=1" in str(it) for it in findings)


@pytest.mark.parametrize(("levels", "level"), [((1.0, 2.0, 5.0), 3), ((2.5, 10.7, 10.8), 2), ((10.0,), 1)])
def test_a_corner_takes_the_largest_level_that_rounds_no_more_than_it_may(
    levels: tuple[float, ...], level: int
) -> None:
    """The smaller neighbour of the corner is the chord of 54 mm to the point of the arc; a fifth of it may be cut."""
    job = small_corner(levels)
    files = INFORM.render(job)

    (program,) = INFORM.read(job.frame, files)

    assert re.findall(r"MOVL C00002 V=8\.0 PL=(\d)", files["SEAM.JBI"]) == [str(level)]
    assert list(other_rows(INFORM, job, (program,))) == []
    rows = program.robots[ROBOT]
    assert rows.rounding is not None
    chord = np.linalg.norm(np.subtract(PLACES[3], PLACES[2]))
    assert rows.rounding[3] * chord == pytest.approx(levels[level - 1] / 1000.0, rel=1e-4)
    assert list(executed_programs(job, INFORM, [run_of(job)], (program,)))


@pytest.mark.parametrize(("level", "message"), [("3", "rounding of at most"), ("4", "a position level of at most 3")])
def test_a_larger_level_is_noticed(level: str, message: str) -> None:
    job = small_corner((1.0, 5.0, 20.0))
    files = INFORM.render(job)
    changed, count = re.subn(r"(C0000[23] V=8\.0) PL=2", rf"\1 PL={level}", files["SEAM.JBI"])
    assert count == 2

    try:
        finding = next(other_rows(INFORM, job, INFORM.read(job.frame, files | {"SEAM.JBI": changed})), "")
    except InputError as error:
        finding = str(error)

    assert message in finding


def ring_job(*, bulge: float = 0.0, pause: bool = False) -> ExportJob:
    """A ring in three arcs: the last may lead through a point outside, by so much in [m], the middle one be idle."""
    job = inform_job()
    rows, robot = job.programs[0].robots[ROBOT], job.frame.robot(ROBOT)
    angles = np.arange(7) * np.pi / 3.0
    radii = 0.05 + np.array([0.0, 0.0, 0.0, 0.0, 0.0, bulge, 0.0])
    places = np.column_stack([0.1 + radii * np.cos(angles), radii * np.sin(angles), np.zeros(7)])
    X = np.repeat(poses()[:1], 9, axis=0)
    X[:, :3, 3] = [(0.15, 0.0, 0.1), *places, (0.15, 0.0, 0.1)]
    X_PT = np.concatenate([np.full((2, 4, 4), np.nan), X[1:], np.full((1, 4, 4), np.nan)])
    process = np.array([False, False, *[True] * 6, False, False, False])
    process[4:6] = not pause
    ring = RobotRows(
        robot=ROBOT,
        q=np.array([rows.q[0], *(joints_at(robot, one) for one in X), rows.q[0]]),
        times=np.arange(11.0),
        process=process,
        rounding=np.zeros(11) if pause else np.isin(np.arange(11), (4, 6)) * 0.5,
        X_PT=X_PT,
        feeds=np.array([np.nan, np.nan, 0.05, *[0.008] * 6, 0.05, np.nan]),
        middles=np.isin(np.arange(11), (3, 5, 7)),
        seams=(replace(SEAM, last=9),),
    )
    return replace(job, programs=(replace(job.programs[0], robots={ROBOT: ring}),))


@pytest.mark.parametrize(
    ("changes", "moves"),
    [
        ({}, "J L CC CC CC C L"),
        ({"bulge": 1e-5}, "J L CCCCC LCCC L"),
        ({"pause": True}, "J L CCC LCCC LCCC L"),
    ],
    ids=str,
)
def test_arcs_of_one_circle_share_their_points(changes: dict[str, float], moves: str) -> None:
    job = ring_job(**changes)  # type: ignore[arg-type]
    files = INFORM.render(job)

    read = INFORM.read(job.frame, files)

    assert "".join(re.findall(r"MOV([JLC])", files["SEAM.JBI"])) == moves.replace(" ", "")
    assert list(other_rows(INFORM, job, read)) == []


@pytest.mark.parametrize(
    ("pattern", "repl", "words"),
    [
        (r"(C00005=-?\d+\.\d\d)\d", r"\g<1>9", "MOVL between arcs of two circles"),
        (r"(MOVC C00005 V=)8\.0", r"\g<1>9.0", "at the speed of its start"),
        (r"(MOVC C00005 V=8\.0) PL=1", r"\1 PL=2", "a point of an arc with PL=1"),
        (r"(MOVC C00004 .*\r\n)", r"\1TIMER T=0.10\r\n", "MOVC to where the tool is"),
        (r"(MOVC C0000[78] .*\r\n)+", "", "MOVC to where the tool is|each position used"),
    ],
)
def test_a_change_of_a_ring_is_noticed(pattern: str, repl: str, words: str) -> None:
    job = ring_job()
    files = INFORM.render(job)
    text, count = re.subn(pattern, repl, files["SEAM.JBI"], count=1)
    assert (count, text == files["SEAM.JBI"]) == (1, False)

    with pytest.raises(InputError, match=words):
        INFORM.read(job.frame, files | {"SEAM.JBI": text})
