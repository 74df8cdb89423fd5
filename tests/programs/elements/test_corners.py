"""Which rows may be rounded, and how zones in millimetres and shares of a segment belong together."""

from dataclasses import replace

import numpy as np
import pytest
from builders.export_jobs import NAMES, arm_on_a_rail, read_back
from builders.rapid_jobs import ABB, multimove_job, part_job
from hypothesis import given, settings
from hypothesis import strategies as st

from cellplan.model.report.exported import ExportJob, ProgramRows, RobotRows
from cellplan.programs.elements.corners import may_round, row_shares
from cellplan.programs.formats.rapid.writer import RAPID
from cellplan.programs.formats.zones import axis_shares, axis_zones, tool_shares, tool_zones
from cellplan.programs.rows.part_targets import with_part_poses
from cellplan.scene.kinematics.screw_chain import ScrewChain

COUNT = 12
TIMES = np.linspace(0.0, 1.1, COUNT)


def rows_of(name: str, **changes: object) -> RobotRows:
    """Twelve rows of one joint that moves all the time."""
    rows = RobotRows(robot=name, q=np.cumsum(np.full((COUNT, 1), 0.1), axis=0), times=TIMES)
    return replace(rows, **changes)  # type: ignore[arg-type]


def stops_of(*robots: RobotRows, in_step: bool = False) -> list[list[int]]:
    """Rows of each robot that may not be rounded."""
    program = ProgramRows(name=None, robots={rows.robot: rows for rows in robots})
    rounds = may_round(program, [list(program.robots)] if in_step else ())
    return [np.flatnonzero(~free).tolist() for free in rounds.values()]


def process(begin: int, end: int) -> np.ndarray:
    """In process from one row to another one."""
    return (np.arange(COUNT) >= begin) & (np.arange(COUNT) < end)


def small_steps(*, seed: int, blend: float = 0.25) -> ExportJob:
    """An arm, an arm on a rail and a positioner in step, whose joints move a little from row to row."""
    job, rng = multimove_job(seed=seed, blend=blend), np.random.default_rng(seed)
    robots = {
        name: replace(rows, q=0.5 * rows.q[:1] + np.cumsum(rng.uniform(-0.01, 0.01, rows.q.shape), axis=0))
        for name, rows in job.programs[0].robots.items()
    }
    return replace(job, programs=(ProgramRows(name=None, robots=robots),))


@pytest.mark.parametrize("in_step", [False, True])
def test_a_row_in_process_may_be_rounded_and_a_switch_of_any_robot_not(in_step: bool) -> None:
    one, other = rows_of("one", process=process(2, 8)), rows_of("other", process=process(5, 11))

    assert stops_of(one, other, in_step=in_step) == [[0, 2, 5, 8, 11]] * 2


def test_a_switch_of_another_robot_counts_by_its_time() -> None:
    """Robots that are not in step have rows of their own: its row 2 is the other one's row 4."""
    other = rows_of("other", process=process(2, 11), times=2.0 * TIMES)

    assert stops_of(rows_of("one"), other)[0] == [0, 4, 11]


def test_marks_stops_of_the_tool_and_rows_at_rest_are_not_rounded() -> None:
    moving = np.ones(COUNT)
    moving[4:6] = 0.0
    still = np.cumsum(moving)[:, None]  # stands from row 3 to row 5
    at_rest = np.ones((COUNT, 1))
    at_rest[8] = 0.0

    assert stops_of(rows_of("one", marks=(2,), stops=(7,))) == [[0, 2, 7, 11]]
    assert stops_of(rows_of("one", q=still)) == [[0, 3, 4, 5, 11]]
    assert stops_of(rows_of("one", qd=at_rest)) == [[0, 8, 11]]


def test_robots_in_step_round_the_same_rows_and_one_that_stands_holds_up_no_other() -> None:
    idle = rows_of("idle", q=np.zeros((COUNT, 1)))
    late = rows_of("late", q=np.cumsum((np.arange(COUNT) > 6).astype(float))[:, None])  # leaves rest at row 6

    assert stops_of(rows_of("one", stops=(3,)), idle, in_step=True) == [[0, 3, 11]] * 2
    assert stops_of(rows_of("one"), idle, late, in_step=True) == [[0, 6, 11]] * 3
    assert stops_of(rows_of("one"), idle)[1] == list(range(COUNT))


@pytest.mark.parametrize("blend", [0.1, 0.25, 0.5])
@pytest.mark.parametrize("seed", range(2))
def test_a_tool_enters_its_zone_within_the_share(seed: int, blend: float) -> None:
    """By other kinematics: no point of both segments beyond the share is nearer to the row than the zone."""
    job = small_steps(seed=seed)
    robot, q = job.frame.robot(NAMES[1]), job.programs[0].robots[NAMES[1]].q
    chain = ScrewChain(robot)

    zones = tool_zones(robot, q, np.full(len(q), blend))

    at = chain.tool_poses(q)[:, :3, 3]
    for row in range(1, len(q) - 1):
        away = []
        for other in (row - 1, row + 1):
            beyond = q[row] + np.linspace(blend, 1.0, 60)[:, None] * (q[other] - q[row])
            away.append(np.linalg.norm(chain.tool_poses(beyond)[:, :3, 3] - at[row], axis=1))
        assert np.min(away) >= zones[row] - 1e-12
        assert np.min(away) == pytest.approx(zones[row], abs=1e-9)
    assert zones[0] == zones[-1] == 0.0


@given(seed=st.integers(0, 10_000), blend=st.sampled_from([0.1, 0.25, 0.5]))
@settings(max_examples=4)
def test_the_share_of_a_zone_is_that_from_which_it_was_made(seed: int, blend: float) -> None:
    job = small_steps(seed=seed % 50)
    robot, q = job.frame.robot(NAMES[0]), job.programs[0].robots[NAMES[0]].q
    shares = np.full(len(q), blend)

    read_shares = tool_shares(robot, q, tool_zones(robot, q, shares))

    np.testing.assert_allclose(read_shares[1:-1], blend, atol=1e-6)
    larger = tool_shares(robot, q, 1.2 * tool_zones(robot, q, shares))
    assert np.all(larger[1:-1] >= min(1.1 * blend, 0.5))


def test_an_axis_without_a_tool_is_rounded_by_its_zone_over_its_way() -> None:
    job = small_steps(seed=1)
    robot, q = job.frame.robot(NAMES[2]), job.programs[0].robots[NAMES[2]].q
    travels = np.degrees(np.abs(np.diff(q, axis=0)))
    least = np.minimum(travels[:-1].max(axis=1), travels[1:].max(axis=1))

    zones = axis_zones(robot, q, 0.2)
    shares = axis_shares(robot, q, zones, zones)

    np.testing.assert_allclose(zones[1:-1], 0.2 * least, rtol=1e-12)
    smallest = np.minimum(travels[:-1], travels[1:]).min(axis=1)
    np.testing.assert_allclose(shares[1:-1], np.minimum(zones[1:-1] / smallest, 0.5), rtol=1e-12)


@pytest.mark.parametrize("decimals", [2, 4])
@pytest.mark.parametrize("seed", range(3))
def test_a_reader_finds_the_share_of_each_row_in_its_zone(seed: int, decimals: int) -> None:
    """The scale of zones has ten sizes to the decade: no share is larger than it may be, or less than 0.79 of it."""
    job = small_steps(seed=seed)
    cell = job.frame.cell
    robots = tuple(replace(robot, control=robot.control.changed(decimals=decimals)) for robot in cell.robots)
    job = replace(job, frame=replace(job.frame, cell=replace(cell, robots=robots)))

    read = read_back(RAPID, job)[0].robots

    allowed = row_shares(job, job.programs[0])
    for name in NAMES[:2]:
        rounded = read[name].rounding > 0.0
        assert np.count_nonzero(rounded) > 10
        assert np.all(rounded <= (allowed[name] > 0.0))
        assert np.all(read[name].rounding <= allowed[name] + 1e-6)
        assert np.all(read[name].rounding[rounded] >= 0.78 * 0.25)
    assert len({tuple((rows.rounding > 0.0).tolist()) for rows in read.values()}) == 1


def test_targets_on_the_part_are_rounded_within_the_share_of_their_way() -> None:
    job = part_job(seed=3, step=0.02, blend=0.25)
    job = replace(job, programs=with_part_poses(job.frame, job.programs))

    read = read_back(RAPID, job)[0].robots

    for name in NAMES[:2]:
        at_part = np.isfinite(read[name].q).all(axis=1) == np.False_
        rounded = read[name].rounding
        assert np.count_nonzero(rounded[at_part]) > 0
        assert np.all(rounded <= 0.25 * (1.0 + 1e-3))
        ends = np.flatnonzero(np.diff(at_part.astype(int)))
        assert np.all(rounded[[*ends, *(ends + 1)]] == 0.0)


def test_a_larger_zone_is_read_as_a_larger_share() -> None:
    job = small_steps(seed=2)
    files = RAPID.render(job)
    text = files[f"{NAMES[0]}.mod"]
    name = text.split("CONST zonedata ")[1].split(" ")[0]

    wide = {**files, f"{NAMES[0]}.mod": text.replace(f",{name},", ",z200,")}

    before, after = (RAPID.read(job.frame, entry)[0].robots[NAMES[0]].rounding for entry in (files, wide))
    assert np.all(after[before != after] == 0.5)
    assert np.any(before != after)


def test_a_rail_moves_its_tool_too() -> None:
    """A rail that slides 10 mm carries the tool by 10 mm: a quarter is a zone of 2.5 mm."""
    job = arm_on_a_rail(ABB, rows=5)
    robot, q = job.frame.robot(NAMES[0]), np.repeat(job.programs[0].robots[NAMES[0]].q[:1], 5, axis=0)
    q[:, 0] = 0.010 * np.arange(5)

    np.testing.assert_allclose(tool_zones(robot, q, np.full(5, 0.25)), [0.0, 2.5e-3, 2.5e-3, 2.5e-3, 0.0], atol=1e-12)
