"""Exports of two holders that carry one part: their grasps are judged on written rows, and no order of them is free."""

from dataclasses import replace

import numpy as np
import pytest
from builders.plain_dialect import dialect, job_of, read_back

from cellplan import VerifiedRun, load_cell, open_gate, solve, write_run
from cellplan.errors import NotVerifiedError
from cellplan.geometry.transforms import Array
from cellplan.model.report.exported import ProgramRows, Promise, RobotRows
from cellplan.model.report.verified_run import ACCESS_TOKEN
from cellplan.model.settings.controllers import ControllerEntry, KindName, RobotControlEntry
from cellplan.programs.export.choice import Choice
from cellplan.programs.export.program import exported
from cellplan.programs.formats.krl.writer import KRL
from cellplan.programs.formats.rapid.writer import RAPID
from cellplan.programs.judgement.judge import Judgement, judge
from cellplan.programs.promises.promises import choose_promise
from cellplan.programs.promises.skew import ClockPair, RunSkew
from cellplan.programs.rows.resample import lead_time, resampled
from cellplan.programs.rows.rows import full_rows

pytestmark = pytest.mark.usefixtures("stored_solutions")
HOLDERS = ("left", "right")
CELL = """\
cellplan: 1
name: plate
robots:
  left: {model: planar_3r, base: {xyz_mm: [0, 0, 500]}, tool: {xyz_mm: [0, 0, 40]}, start_deg: auto}
  right:
    model: planar_3r
    base: {xyz_mm: [1900, 0, 500], rpy_deg: [0, 0, 180]}
    tool: {xyz_mm: [0, 0, 40]}
    start_deg: auto
part:
  geometry: {box: {size_mm: [600, 200, 10]}}
  held_by:
    - {robot: left, at: {xyz_mm: [-250, 0, 5], rpy_deg: [180, 0, 0]}}
    - {robot: right, at: {xyz_mm: [250, 0, 5], rpy_deg: [180, 0, 180]}, axes: [x, y, rz]}
tasks:
  carry:
    robot: left
    relative_to: world
    path: {circle: {radius_mm: 60, center_mm: [650, 0], plane: xy}}
    tool_axis: -z
    axes: [x, y, rz]
    tolerance: {position_mm: 0.5, orientation_deg: 0.1}
motion: {mode: simultaneous, duration_s: 3, step_s: 0.01, time_law: quintic}
checks: {closure_mm: 0.05, closure_deg: 0.02}
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> VerifiedRun:
    folder = tmp_path_factory.mktemp("plate")
    (folder / "cell.yaml").write_text(CELL, encoding="utf-8")
    write_run(solve(load_cell(folder / "cell.yaml")), folder / "run")
    return open_gate(folder / "run", cell=folder / "cell.yaml")


def wrist_turned(rows: RobotRows, row: int, angle: float) -> RobotRows:
    """The last joint of a robot elsewhere in one row, by an angle in [rad]."""
    q = rows.q.copy()
    q[row, -1] += angle
    return replace(rows, q=q)


def judged(run: VerifiedRun, angle: float) -> Judgement:
    """The right holder's wrist turned in one row before the rows are written."""
    (full,) = full_rows(run)
    robots = {**full.robots, "right": wrist_turned(full.robots["right"], 150, angle)}
    job = job_of(run, (replace(full, robots=robots),))
    return judge(run, dialect(decimals=9), job, read_back(job, decimals=9))


def planar(run: VerifiedRun, robot: str, q: Array) -> tuple[Array, Array]:
    """Tool tip in the world in [m], shape (N, 2), and its heading in [rad], shape (N,): link by link."""
    placed = run.cell.robot(robot)
    at = [placed.model.axes[link].point_B[:2] for link in range(3)]
    tip = (placed.model.X_BF @ placed.tool.X_FT)[:2, 3]
    R, t = placed.X_WB[:2, :2], placed.X_WB[:2, 3]
    heading, place = np.cumsum(q, axis=1), np.tile(at[0], (len(q), 1))
    for joint, step in enumerate(np.diff([*at, tip], axis=0)):
        c, s = np.cos(heading[:, joint]), np.sin(heading[:, joint])
        place = place + np.stack([c * step[0] - s * step[1], s * step[0] + c * step[1]], axis=1)
    return place @ R.T + t, heading[:, -1] + np.arctan2(R[1, 0], R[0, 0])


def grip_errors(run: VerifiedRun, left: Array, right: Array) -> tuple[Array, Array]:
    """How far the right tool is from its place on the plate in [mm] and [deg], shape (N,) each."""
    (one, turn), (other, heading) = planar(run, "left", left), planar(run, "right", right)
    c, s = np.cos(turn), np.sin(turn)
    shift = other - one
    seen = np.stack([c * shift[:, 0] + s * shift[:, 1], -s * shift[:, 0] + c * shift[:, 1]], axis=1)
    off = (heading - turn - np.pi + np.pi) % (2.0 * np.pi) - np.pi
    return 1e3 * np.linalg.norm(seen - np.array([0.5, 0.0]), axis=1), np.rad2deg(np.abs(off))


def of_grip(judgement: Judgement, unit: str) -> float:
    """Largest deviation of the right holder on the part."""
    return next(
        deviation.largest
        for deviation in judgement.deviations
        if deviation.subject == "'right' on the part" and deviation.unit == unit
    )


@pytest.mark.slow
def test_the_grip_keeps_its_place_in_all_rows_of_a_run(run: VerifiedRun) -> None:
    (full,) = full_rows(run)

    mm, deg = grip_errors(run, *(full.robots[name].q for name in HOLDERS))

    assert judged(run, 0.0).findings == ()
    assert max(mm) < 0.05
    assert max(deg) < 0.02
    assert float(np.ptp(full.robots["left"].q, axis=0).max()) > 0.1  # the plate moves


@pytest.mark.parametrize("angle", [1e-5, 1e-4, -1e-4])
def test_a_turned_wrist_is_the_deviation_of_the_grip(run: VerifiedRun, angle: float) -> None:
    """Its tool turns by the angle about the axis of its wrist, and no other figure has to be known."""
    placed = run.cell.robot("right")
    reach = np.linalg.norm((placed.model.X_BF @ placed.tool.X_FT)[:2, 3] - placed.model.axes[2].point_B[:2])

    judgement = judged(run, angle)

    assert of_grip(judgement, "deg") == pytest.approx(np.rad2deg(abs(angle)), rel=1e-3)
    assert of_grip(judgement, "mm") == pytest.approx(2e3 * reach * np.sin(abs(angle) / 2.0), rel=1e-3)


def test_rows_that_strain_the_part_beyond_the_demand_are_refused(run: VerifiedRun) -> None:
    """0.02 deg are allowed: half of it is written, twice it is not."""
    half, twice = (judged(run, np.deg2rad(angle)).findings for angle in (0.005, 0.04))

    assert not any("on the part" in finding for finding in half)
    assert any("orientation" in finding and "'right' on the part" in finding for finding in twice)


def test_the_grip_is_judged_between_rows_of_different_cycles(run: VerifiedRun) -> None:
    """Straight lines of joints between rows: what the cycles cost by brute force is what is reported, and no less."""
    (full,) = full_rows(run)
    cycles = {"left": 0.004, "right": 0.036}
    program = resampled(run.cell, full, cycles)
    job = job_of(run, (program,))

    judgement = judge(run, dialect(decimals=9), job, read_back(job, decimals=9), lead=lead_time(cycles))

    times = np.linspace(0.5, 2.5, 4001)
    played = [at_times(program, name, times) for name in HOLDERS]
    mm, _ = grip_errors(run, *played)
    assert max(mm) > 0.002  # they do cost something
    assert of_grip(judgement, "mm") == pytest.approx(max(mm), rel=0.05, abs=1e-4)


def at_times(program: ProgramRows, robot: str, times: Array) -> Array:
    """Positions of a robot on straight lines between its rows, shape (N, n)."""
    rows = program.robots[robot]
    assert rows.times is not None
    return np.stack([np.interp(times, rows.times, column) for column in rows.q.T], axis=1)


def on_controllers(run: VerifiedRun, kind: KindName, **of: str) -> VerifiedRun:
    placed = tuple(replace(robot, control=RobotControlEntry(id=of[robot.name])) for robot in run.cell.robots)
    controllers = {name: ControllerEntry(kind=kind) for name in of.values()}
    return replace(run, cell=replace(run.cell, robots=placed, controllers=controllers), token=ACCESS_TOKEN)


@pytest.mark.parametrize("robots", [HOLDERS, ("left",), ("right",)])
@pytest.mark.parametrize("form", [KRL, RAPID])
def test_holders_that_move_are_never_free_in_their_order(run: VerifiedRun, form, robots: tuple[str, ...]) -> None:
    """Whichever of them is exported, although no tool is in process on the part."""
    apart = on_controllers(run, "kuka", left="a", right="b")

    with pytest.raises(NotVerifiedError) as refusal:
        choose_promise(apart, form, robots)

    first, *details = refusal.value.findings
    assert first.startswith(f"{form.name}: not sequence only: phase 'all tasks', ")
    assert first.endswith("the holders left and right move the part: another order strains it")
    *reasons, cure = details
    assert [line.startswith("  not synchronised: ") for line in reasons] == [True] * (form is RAPID)
    assert cure.startswith("  cure: ")


def test_holders_of_one_controller_may_be_in_step(run: VerifiedRun) -> None:
    one = on_controllers(run, "abb", left="a", right="a")

    assert choose_promise(one, RAPID, HOLDERS).promise is Promise.SYNCHRONISED
    with pytest.raises(NotVerifiedError, match="rapid: not sequence only"):
        choose_promise(one, RAPID, ("right",))


def test_holders_whose_clocks_are_too_far_apart_are_not_timed(run: VerifiedRun) -> None:
    apart = on_controllers(run, "other", left="a", right="b")
    skew = RunSkew(
        pairs=(ClockPair(first="left", second="right", allowed=1e-4, stated=2e-4, reason="grip"),), cycle=3.0
    )

    with pytest.raises(NotVerifiedError, match=r"the stated skew of 0\.2 ms is more than the allowed 0\.1 ms"):
        choose_promise(apart, dialect(), HOLDERS, skew=skew)


def test_holders_of_different_cycles_are_named_where_they_strain_the_part(run: VerifiedRun) -> None:
    """0.005 mm between rows of 4 and 36 ms; with the demand below it the refusal says which keys differ."""
    apart = on_controllers(run, "other", left="a", right="b")
    cycles = {"left": 0.004, "right": 0.036}
    robots = tuple(
        replace(robot, control=robot.control.changed(cycle_ms=1e3 * cycles[robot.name]))
        for robot in apart.cell.robots
        if robot.control is not None
    )
    strict = apart.cell.checks.changed(closure_mm=0.001)
    strained = replace(apart, cell=replace(apart.cell, robots=robots, checks=strict), token=ACCESS_TOKEN)

    with pytest.raises(NotVerifiedError) as refusal:
        exported(strained, "stream", Choice())

    first, *_, detail = refusal.value.findings
    assert first.startswith("stream: closure position error of 'right' on the part: ")
    assert detail.startswith("  cycle_ms: 4 ms of left and 36 ms of right: holders of one part that share a cycle ")
