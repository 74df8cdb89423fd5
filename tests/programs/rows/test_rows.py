"""Rows of a run: as in its tables, with speeds that fit them, the process of its plan, and what thinning keeps."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.home_to_home import PICK_AND_PLACE
from builders.plain_dialect import dialect, job_of, read_back

from cellplan import load_cell, open_gate, solve, write_run
from cellplan.geometry.transforms import inverse
from cellplan.measures.tool_errors import part_poses
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.exported import Promise
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.programs.judgement.judge import judge
from cellplan.programs.judgement.judge_path import schedule_at
from cellplan.programs.rows.rows import essential_rows, full_rows
from cellplan.programs.rows.thin import ThinningLimits, thinned
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.scene.scene import Scene

pytestmark = pytest.mark.usefixtures("stored_solutions")


@pytest.fixture(scope="module")
def run(sound: Path) -> VerifiedRun:
    return open_gate(sound / "run", cell=sound / "cell" / "small.yaml")


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> VerifiedRun:
    """A program from home to home that is played twice."""
    folder = tmp_path_factory.mktemp("home")
    (folder / "cell.yaml").write_text(PICK_AND_PLACE.replace("program:\n", "program:\n  cycles: 2\n"), encoding="utf-8")
    write_run(solve(load_cell(folder / "cell.yaml")), folder / "run")
    return open_gate(folder / "run", cell=folder / "cell.yaml")


def test_rows_are_those_of_the_tables(run: VerifiedRun) -> None:
    (program,) = full_rows(run)

    for name, rows in program.robots.items():
        np.testing.assert_array_equal(rows.q, run.programs[None][name].q)
        np.testing.assert_array_equal(rows.times, run.motion.times)
        assert rows.marks == ()
        assert rows.qd is not None
        assert np.all(rows.qd[[0, -1]] == 0.0)
        inner = (rows.q[2:] - rows.q[:-2]) / (rows.times[2:] - rows.times[:-2])[:, None]
        np.testing.assert_allclose(rows.qd[1:-1], inner, atol=1e-9)


def test_only_the_robot_whose_tool_works_is_in_process(run: VerifiedRun) -> None:
    robots = full_rows(run)[0].robots

    assert robots["right"].process.tolist() == [*[True] * 40, False]  # from each row to the next
    assert not robots["left"].process.any()
    assert not robots["idle"].process.any()


def test_desired_poses_at_the_rows_themselves_are_those_of_the_run(run: VerifiedRun) -> None:
    schedule = run.motions[0].schedule

    at_rows = schedule_at(schedule, schedule.times)

    np.testing.assert_allclose(at_rows.tasks[0].X_PT, schedule.tasks[0].X_PT, atol=1e-15)
    np.testing.assert_allclose(at_rows.tasks[0].travelled, schedule.tasks[0].travelled, atol=1e-15)


def test_desired_poses_between_the_rows_are_where_the_tool_is(run: VerifiedRun) -> None:
    """A step is 25 ms, in which the path of 60 mm bends by less than a tenth of a millimetre off its chord."""
    motion = run.motions[0]
    times = np.linspace(0.0, 1.0, 161)
    q = {
        name: np.stack([np.interp(times, table.times, column) for column in table.q.T], axis=1)
        for name, table in motion.tables.items()
    }
    chains = {robot.name: ScrewChain(robot) for robot in run.cell.robots}
    X_PT = inverse(part_poses(run.cell, chains, q)) @ chains["right"].tool_poses(q["right"])

    result = schedule_at(motion.schedule, times).tasks[0]

    assert np.linalg.norm(result.X_PT[:, :2, 3] - X_PT[:, :2, 3], axis=1).max() < 1e-4
    moved = np.linalg.norm(np.diff(result.X_PT[:, :3, 3], axis=0), axis=1)
    np.testing.assert_allclose(np.diff(result.travelled), moved, atol=1e-5)


def test_a_schedule_without_paths_is_refused(run: VerifiedRun) -> None:
    schedule: Schedule = replace(run.motions[0].schedule, paths=())

    with pytest.raises(ValueError, match="expected paths that are known between the rows"):
        schedule_at(schedule, np.array([0.0, 1.0]))


@pytest.mark.slow
def test_all_phases_and_cycles_of_a_program_are_kept_and_judged(home: VerifiedRun) -> None:
    (program,), (essential,) = full_rows(home), essential_rows(home)
    phases = home.motion.plan.program
    scene, names = Scene.from_cell(home.cell), [robot.name for robot in home.cell.robots]
    limits = ThinningLimits(turn=1e-3, slide=1e-3, tool=1e-4)

    few = thinned(scene, program, groups=[names], limits=limits, essential_rows=essential)

    assert {home.motion.rows(phase).start for phase in phases} <= set(essential.rows)
    assert len(essential.work) == len(phases)
    job = job_of(home, [few], promise=Promise.SEQUENCE_ONLY)
    sparse = dialect(decimals=5, is_thinned=True)
    assert judge(home, sparse, job, read_back(job, decimals=5, with_times=False)).findings == ()


@pytest.mark.slow
def test_a_row_that_is_wrong_in_the_second_cycle_only_is_found(home: VerifiedRun) -> None:
    (program,) = full_rows(home)
    rows = program.robots["pen"]
    worked = np.flatnonzero(rows.process)
    q = rows.q.copy()
    q[worked[-30], 2] += np.deg2rad(1.0)
    job = job_of(home, [replace(program, robots={**program.robots, "pen": replace(rows, q=q)})])

    result = judge(home, dialect(decimals=9), job, read_back(job, decimals=9)).findings

    assert any("position error of task" in finding for finding in result)
