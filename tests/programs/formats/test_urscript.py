"""URScript programs: radians within two turns, servoj at the cycle, movej with handshakes, and a way back."""

import re
from dataclasses import replace

import numpy as np
import pytest
from builders.export_jobs import arm_on_a_rail, job_of
from builders.stream_jobs import is_within_limits, largest_error, round_trip, smooth_program, ur_cell, with_latency

from cellplan.errors import InputError
from cellplan.model.cell.cell import Cell
from cellplan.model.report.exported import ExportJob, ProgramRows, Promise
from cellplan.model.settings.controllers import HandshakeEntry
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.elements.frames import carried_poses
from cellplan.programs.formats.urscript.reader import read_urscript
from cellplan.programs.formats.urscript.rows import blend_radii, move_acceleration, move_speeds
from cellplan.programs.formats.urscript.writer import render_urscript
from cellplan.programs.formats.zones import tool_tips
from cellplan.scene.kinematics.screw_chain import ScrewChain

URSCRIPT = DIALECTS["urscript"]
HALF = 0.5e-9 + 1e-15  # [rad]
JOINTS = re.compile(r"\[([^\]]*)\]")


def timed(*, seed: int = 0, cycle: float = 0.008, cell: Cell | None = None, **changes: object) -> ExportJob:
    source = ur_cell(seed=seed, cycle=cycle) if cell is None else cell
    return job_of(source, smooth_program(source, seed=seed, cycle=cycle, end=0.8), promise=Promise.TIMED, **changes)


def sequence(
    *,
    marks: tuple[int, ...] = (0, 4, 8, 8),
    seed: int = 0,
    robots: int = 2,
    cell: Cell | None = None,
    **changes: object,
) -> ExportJob:
    source = ur_cell(robots=robots, seed=seed) if cell is None else cell
    program = smooth_program(source, seed=seed, cycle=0.1, end=1.6)
    rows = {name: replace(robot, marks=marks) for name, robot in program.robots.items()}
    return job_of(source, ProgramRows(name=None, robots=rows), promise=Promise.SEQUENCE_ONLY, **changes)


def joints_in(text: str) -> np.ndarray:
    """All joint positions in a program, in the order of its lines."""
    code = "\n".join(line for line in text.splitlines() if not line.startswith("#"))
    return np.array([[float(number) for number in match.split(",")] for match in JOINTS.findall(code)])


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("promise", [Promise.TIMED, Promise.SEQUENCE_ONLY])
def test_positions_come_back_within_half_of_the_last_decimal(seed: int, promise: Promise) -> None:
    job = timed(seed=seed) if promise is Promise.TIMED else sequence(seed=seed, blend=0.1 * seed)

    _, (read,) = round_trip(URSCRIPT, job)

    for name, rows in read.robots.items():
        mine = job.programs[0].robots[name]
        assert largest_error(job, [read], name).max() <= 2.0 * HALF
        assert is_within_limits(job.frame.robot(name), rows.q)
        assert rows.marks == mine.marks
        if promise is Promise.TIMED:
            assert np.allclose(rows.times, mine.times, rtol=0.0, atol=1e-12)  # type: ignore[arg-type]
        else:
            assert rows.times is None


def test_a_timed_program_moves_to_its_first_row_follows_and_stops() -> None:
    job = timed(cycle=0.002)
    model, q = job.frame.robot("alpha").model, job.programs[0].robots["alpha"].q
    assert model.controller is not None

    lines = [line.strip() for line in render_urscript(job)["alpha.script"].splitlines() if not line.startswith("#")]

    assert lines[0] == "def alpha():"
    assert lines[1].startswith("movej([")
    assert all(line.startswith("servoj([") for line in lines[2:-2])
    assert all(line.endswith("], a=0, v=0, t=0.002, lookahead_time=0.100, gain=300)") for line in lines[2:-2])
    assert re.fullmatch(r"stopj\([0-9.]+\)", lines[-2])
    assert lines[-1] == "end"
    shown = joints_in("\n".join(lines))
    assert len(shown) == len(q)
    assert np.abs(shown - (model.controller.sign * q + model.controller.zero)).max() <= 2.0 * HALF
    assert np.abs(shown).max() <= 2.0 * np.pi


@pytest.mark.parametrize(
    ("latency_ms", "expected"), [(30.0, "0.030"), (50.0, "0.050"), (200.0, "0.200"), (500.0, "0.200"), (100.0, "0.100")]
)
def test_the_lookahead_time_is_the_latency_that_is_stated(latency_ms: float, expected: str) -> None:
    text = render_urscript(timed(cell=with_latency(ur_cell(), latency_ms)))["alpha.script"]

    assert set(re.findall(r"lookahead_time=([0-9.]+)", text)) == {expected}


@pytest.mark.parametrize(("latency_ms", "got"), [(None, "none"), (0.0, "0"), (20.0, "20")])
def test_servoj_without_a_latency_is_refused(latency_ms: float | None, got: str) -> None:
    with pytest.raises(InputError, match=rf"^controllers\.alpha_controller\.latency_ms: .* got {got}$"):
        render_urscript(timed(cell=with_latency(ur_cell(), latency_ms)))


def test_other_cycles_are_refused() -> None:
    with pytest.raises(
        InputError, match=r"^robots\.alpha\.controller\.cycle_ms: expected 2 \(e-Series\) or 8 \(CB3\), got 4"
    ):
        render_urscript(timed(cycle=0.004))


@pytest.mark.slow
def test_long_programs_have_several_routines_and_say_that_nobody_has_tried_one() -> None:
    cell = ur_cell(cycle=0.002)
    long = job_of(cell, smooth_program(cell, cycle=0.002, end=60.0), promise=Promise.TIMED)

    files = render_urscript(long)

    text = files["alpha.script"]
    assert "# 30001 rows: no program of more than 25000 has been tried on a controller" in text
    assert re.findall(r"^  (?:def )?(page_[0-9]{3})\(\):?$", text, re.MULTILINE) == ["page_001", "page_002"] * 2
    (read,) = read_urscript(long.frame, files)
    assert np.allclose(read.robots["alpha"].q, long.programs[0].robots["alpha"].q, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("kind", ["timed", "sequence"])
def test_routines_hold_the_rows_of_the_whole_program(kind: str) -> None:
    whole, split = (timed(), timed(split=40)) if kind == "timed" else (sequence(), sequence(split=3))

    files = render_urscript(split)

    (read,), (expected,) = read_urscript(split.frame, files), read_urscript(whole.frame, render_urscript(whole))
    assert "def page_002():" in files["alpha.script"]
    assert "tried on a controller" not in files["alpha.script"]
    assert np.array_equal(read.robots["alpha"].q, expected.robots["alpha"].q)
    assert read.robots["alpha"].marks == expected.robots["alpha"].marks


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("  page_002()\n", "", r"alpha\.script:[0-9]+: expected page_002\(\)"),
        ("  page_001()\n  page_002()\n", "  page_002()\n  page_001()\n", r"expected page_001\(\)|expected page_002"),
        ("def page_002", "def page_003", r"alpha\.script:[0-9]+: expected def page_002\(\):"),
    ],
)
def test_routines_that_are_not_called_in_their_order_are_refused(old: str, new: str, reason: str) -> None:
    job = timed(split=40)
    text = render_urscript(job)["alpha.script"]

    with pytest.raises(InputError, match=reason):
        read_urscript(job.frame, {"alpha.script": text.replace(old, new)})


def test_a_routine_with_more_rows_than_it_may_hold_is_refused() -> None:
    text = render_urscript(timed(split=40))["alpha.script"]

    with pytest.raises(InputError, match=r"alpha\.script:[0-9]+: expected 39 rows at most in a routine, got 40"):
        read_urscript(timed(split=39).frame, {"alpha.script": text})


def test_few_decimals_are_refused_in_a_timed_program_only() -> None:
    cell = ur_cell(decimals=4)

    with pytest.raises(
        InputError, match=r"^robots\.alpha\.controller\.decimals: expected 8 or more, of a radian, got 4"
    ):
        render_urscript(timed(cell=cell))
    text = render_urscript(sequence(cell=cell, marks=()))["alpha.script"]
    assert re.search(r"movej\(\[-?[0-9]\.[0-9]{4},", text)


def test_positions_within_two_turns_are_written() -> None:
    """A last joint that may turn on: one turn and a half either way."""
    job = timed(cell=ur_cell())
    rows = job.programs[0].robots["alpha"]
    robot = job.frame.cell.robots[0]
    joints = (*robot.model.joints[:5], replace(robot.model.joints[5], lower=-10.0, upper=10.0))
    cell = replace(job.frame.cell, robots=(replace(robot, model=replace(robot.model, joints=joints)),))
    q = rows.q.copy()
    q[:, 5] = np.linspace(-9.4, 9.4, len(q))
    turning = job_of(cell, ProgramRows(name=None, robots={"alpha": replace(rows, q=q)}), promise=Promise.TIMED)

    (read,) = read_urscript(turning.frame, render_urscript(turning))

    assert np.allclose(read.robots["alpha"].q, q, rtol=0.0, atol=1e-9)


def test_positions_beyond_two_turns_are_refused() -> None:
    cell = ur_cell()
    model = cell.robots[0].model
    joints = (*model.joints[:5], replace(model.joints[5], lower=-20.0, upper=20.0))
    turning = replace(cell, robots=(replace(cell.robots[0], model=replace(model, joints=joints)),))
    rows = timed(cell=cell).programs[0].robots["alpha"]
    q = rows.q.copy()
    q[40, 5] = 4.0 * np.pi + 1e-8
    program = ProgramRows(name=None, robots={"alpha": replace(rows, q=q)})
    beyond = job_of(turning, program, promise=Promise.TIMED)

    reason = r"^robot 'alpha', row 40: expected joint a6 within two turns, got 12\.566371 rad"
    with pytest.raises(InputError, match=reason):
        render_urscript(beyond)


def test_robots_with_other_joints_are_refused() -> None:
    job = arm_on_a_rail("ur")

    with pytest.raises(InputError, match=r"^robots\.alpha: expected 6 turning joints for urscript, got 7 joints"):
        render_urscript(job)


def test_robots_meet_at_marks_in_whatever_order_they_come() -> None:
    """Two interpreters run the instructions of both programs in all kinds of turns; neither leaves a mark alone."""
    job = sequence()
    files = render_urscript(job)
    programs = {name: [line.strip() for line in files[f"{name}.script"].splitlines()] for name in ("alpha", "beta")}
    for seed in range(5):
        rng = np.random.default_rng(seed)
        lowered = {
            name: next(k for k, line in enumerate(lines) if "digital" in line) for name, lines in programs.items()
        }
        assert all(programs[name][line].endswith(", False)") for name, line in lowered.items())
        place, passed = {name: line + 1 for name, line in lowered.items()}, dict.fromkeys(programs, 0)
        outputs = dict.fromkeys(programs, False)
        for _ in range(4000):
            name = ("alpha", "beta")[int(rng.random() < rng.random())]
            other = "beta" if name == "alpha" else "alpha"
            if place[name] < len(programs[name]):
                line = programs[name][place[name]]
                passed[name] += line.startswith("movej")
                place[name] = step(line, place[name], name, outputs=outputs, heard=outputs[other])
            for one, two in (("alpha", "beta"), ("beta", "alpha")):
                if passed[one] > 9:
                    assert passed[two] >= 9  # row 8 is reached by both before one leaves it
                if passed[one] > 5:
                    assert passed[two] >= 5
                if passed[one] > 1:
                    assert passed[two] >= 1
        assert place == {name: len(lines) for name, lines in programs.items()}


def step(line: str, place: int, name: str, *, outputs: dict[str, bool], heard: bool) -> int:
    """Run one instruction; a loop that goes on stays where it is."""
    if line.startswith("set_standard_digital_out"):
        outputs[name] = line.endswith("True)")
    if line.startswith("while not"):
        return place + 3 if heard else place
    if line.startswith("while"):
        return place if heard else place + 3
    return place + 1


def test_a_robot_stands_still_at_marks_ends_and_switches_of_the_process() -> None:
    job = sequence(blend=0.5, marks=(3, 11))
    rows = job.programs[0].robots["alpha"]
    assert rows.process is not None

    text = render_urscript(job)["alpha.script"]

    blended = [", r=" in line for line in text.splitlines() if line.strip().startswith("movej")]
    switches = 1 + np.flatnonzero(np.diff(rows.process.astype(int)))
    stops = {0, 3, 11, len(rows) - 1, *switches.tolist()}
    assert any(blended)
    assert {row for row, is_blended in enumerate(blended) if is_blended} & stops == set()


@pytest.mark.parametrize("blend", [0.1, 0.25, 0.5])
def test_a_blend_begins_no_earlier_than_its_share_of_a_segment(blend: float) -> None:
    job = sequence(marks=(), blend=blend)
    robot, rows = job.frame.robot("alpha"), job.programs[0].robots["alpha"]
    chain = ScrewChain(robot)

    def tips(q: np.ndarray) -> np.ndarray:
        return chain.tool_poses(q)[:, :3, 3]

    radii = blend_radii(robot, rows, blend)

    assert np.count_nonzero(radii) > 3
    for row in np.flatnonzero(radii).tolist():
        for other in (row - 1, row + 1):
            shares = np.linspace(blend, 0.6, 50)[:, None]
            away = tips(rows.q[row] + shares * (rows.q[other] - rows.q[row])) - tips(rows.q[row : row + 1])
            assert np.linalg.norm(away, axis=1).min() >= radii[row]
    chords = np.linalg.norm(np.diff(tips(rows.q), axis=0), axis=1)
    assert np.all(radii[:-1] + radii[1:] <= chords + 1e-12)


def test_a_larger_radius_is_read_as_a_larger_share() -> None:
    job = sequence(marks=(), blend=0.25)
    files = URSCRIPT.render(job)

    wide = {path: re.sub(r"r=[\d.]+", "r=9.0000", text) for path, text in files.items()}

    before, after = (URSCRIPT.read(job.frame, entry)[0].robots["alpha"].rounding for entry in (files, wide))
    radii = blend_radii(job.frame.robot("alpha"), job.programs[0].robots["alpha"], 0.25)
    np.testing.assert_array_equal(before > 0.0, radii > 0.0)
    assert np.all(before <= 0.25)
    np.testing.assert_array_equal(after, 0.5 * (before > 0.0))


def test_tool_tips_are_those_of_the_kinematics() -> None:
    rng = np.random.default_rng(3)
    robot = ur_cell().robots[0]
    q = rng.uniform(-3.0, 3.0, (50, 6))

    assert np.abs(tool_tips(robot, q) - ScrewChain(robot).tool_poses(q)[:, :3, 3]).max() <= 1e-12
    poses = robot.X_WB @ carried_poses(robot, q, robot.tool.X_FT)
    assert np.abs(poses - ScrewChain(robot).tool_poses(q)).max() <= 1e-12


def test_moves_are_no_faster_than_joints_and_plan() -> None:
    job = sequence(marks=(), seed=2)
    robot, rows = job.frame.robot("alpha"), job.programs[0].robots["alpha"]
    assert rows.times is not None
    limits = np.array([joint.velocity for joint in robot.model.joints])

    speeds = move_speeds(robot, rows)

    travel = np.abs(np.diff(rows.q, axis=0))
    for k in range(len(rows) - 1):
        if travel[k].max() > 0.0:
            duration = travel[k].max() / speeds[k + 1]
            assert np.all(travel[k] / duration <= limits + 1e-9)
            assert duration >= rows.times[k + 1] - rows.times[k] - 1e-9 or speeds[k + 1] <= 0.0101
    assert 0.0 < move_acceleration(robot) <= limits.max() / 0.15


def test_signals_that_are_no_standard_ones_are_refused() -> None:
    cell = ur_cell(robots=2)
    alpha, beta = cell.robots
    for shake, key in (
        (HandshakeEntry.model_construct(output="DO_1", inputs={"beta": "1"}), "output"),
        (HandshakeEntry.model_construct(output="8", inputs={"beta": "1"}), "output"),
        (HandshakeEntry.model_construct(output="1", inputs={"beta": "-1"}), r"inputs\.beta"),
        (HandshakeEntry.model_construct(output="1", inputs={"beta": "01"}), r"inputs\.beta"),
    ):
        other = replace(alpha, control=alpha.control.changed(handshake=shake))  # type: ignore[type-var]
        with pytest.raises(
            InputError, match=rf"^robots\.alpha\.controller\.handshake\.{key}: expected a standard digital"
        ):
            render_urscript(sequence(cell=replace(cell, robots=(other, beta))))


def test_a_robot_alone_waits_for_none() -> None:
    job = sequence(robots=1)

    files, (read,) = round_trip(URSCRIPT, job)

    assert "digital" not in files["alpha.script"]
    assert read.robots["alpha"].marks == ()


def test_names_and_notes_cannot_break_out() -> None:
    cell = ur_cell()
    cell = replace(cell, robots=(replace(cell.robots[0], name="end"),))
    programs = [smooth_program(cell, cycle=0.1, end=0.8, name=name) for name in ("9-a", "9_a", "movej")]
    job = job_of(cell, *programs, notes=("end\nmovej(", "größe # “x”"))

    files, read = round_trip(URSCRIPT, job)

    assert list(files) == [f"{name}/end.script" for name in ("9-a", "9_a", "movej")]
    names = [re.search(r"^def ([A-Za-z][A-Za-z0-9_]*)\(\):$", text, re.MULTILINE)[1] for text in files.values()]  # type: ignore[index]
    assert len({name.lower() for name in names}) == 3
    assert "end" not in names
    assert all(letter == "\n" or " " <= letter <= "~" for text in files.values() for letter in text)
    assert len(read) == 3


def test_same_job_same_text() -> None:
    assert render_urscript(sequence(seed=3, blend=0.25)) == render_urscript(sequence(seed=3, blend=0.25))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        *(("\n", "\n\n"), ("\n", "  # x\n"), ("(", " ( "), (", ", " ,")),
        *(("  ", "\t"), ("=", " = "), ("while ", "while   "), ("\n", "\r\n")),
    ],
)
@pytest.mark.parametrize("promise", [Promise.TIMED, Promise.SEQUENCE_ONLY])
def test_harmless_variants_are_read(old: str, new: str, promise: Promise) -> None:
    job = timed() if promise is Promise.TIMED else sequence(blend=0.25)
    files = render_urscript(job)
    (same,) = read_urscript(job.frame, files)

    (read,) = read_urscript(job.frame, {path: text.replace(old, new) for path, text in files.items()})

    assert all(np.array_equal(read.robots[name].q, rows.q) for name, rows in same.robots.items())


@pytest.mark.slow
def test_a_hundred_thousand_rows_keep_all_limits() -> None:
    for seed in range(5):
        cell = ur_cell(seed=seed, cycle=0.002)
        job = job_of(cell, smooth_program(cell, seed=seed, cycle=0.002, end=48.0, rests=(16.0,)), promise=Promise.TIMED)

        _, (read,) = round_trip(URSCRIPT, job)

        assert is_within_limits(cell.robots[0], read.robots["alpha"].q)
        assert largest_error(job, [read], "alpha").max() <= 2.0 * HALF
