"""Every method in every nasty situation: finite joints that are judged honestly, or a refusal that names the cause."""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from builders.ik_edge_cases import SITUATIONS, Situation, tool_on_part

from cellplan.checks.verify import verify
from cellplan.errors import InputError, NoSolutionError
from cellplan.files.run.joint_tables import parse_table
from cellplan.model.solver import MethodName
from cellplan.planning.euler.integrate import integrate_schedule
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.runs.solve import render_program
from cellplan.scene.scene import Scene

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")
METHODS = get_args(MethodName)
LONG = {  # where the best-first search visits thousands of joint positions; the other methods are quick in them
    "stretched arm moved across",
    "stretched arm pulled beyond its reach",
    "step a hundred times too long",
    "two robots, part at rest",
    "two robots, weights from 1e-6 to 1e6",
}
CASES = [
    pytest.param(
        name,
        method,
        marks=pytest.mark.slow if (row + column) % 3 or (method == "heuristic_search" and name in LONG) else (),
        id=f"{name}-{method}",
    )
    for row, name in enumerate(SITUATIONS)
    for column, method in enumerate(METHODS)
]  # a third of them is quick, of each method and of each situation
WRITTEN = 2e-9  # [m] by which written tables may differ from the motion: twelve decimals of a degree, arms of a few m
CAUSES = ("singular", "limits", "half a turn", "from its grasp", "from task", "joint speed", "rotations", "search")


def test_every_long_search_is_a_situation():
    assert set(SITUATIONS) >= LONG


@pytest.mark.parametrize(("name", "method"), CASES)
def test_finite_joints_honestly_judged_or_a_refusal_that_names_the_cause(name, method):
    situation = SITUATIONS[name]()
    cell = replace(situation.cell, solver=situation.cell.solver.changed(method=method))
    refusal, motion = "", None
    try:
        motion = integrate_schedule(MotionTask(cell, situation.schedule, situation.moving, situation.start))
    except (NoSolutionError, InputError) as error:
        refusal = str(error)
    if motion is None:
        assert len(refusal.splitlines()) == 1
        assert "nan" not in refusal.split()
        assert any(cause in refusal for cause in CAUSES), refusal
        return

    assert np.all(np.isfinite(motion.q))
    assert motion.slack is not None
    assert np.all(np.isfinite(motion.slack))
    assert motion.iterations is not None
    assert np.all(np.isfinite(motion.iterations))
    assert_nobody_else_moved(situation, motion.q)
    assert_judged_honestly(replace(situation, cell=cell), motion)


def assert_nobody_else_moved(situation: Situation, q) -> None:
    cell = situation.cell
    for robot in cell.robots:
        if robot.name not in situation.moving:
            assert np.ptp(q[:, cell.columns(robot.name)], axis=0).max() == 0.0
    for lock in cell.motion.locked:
        column = cell.columns(lock.robot).start + cell.robot(lock.robot).model.joint_names.index(lock.joint)
        assert np.ptp(q[situation.schedule.times >= lock.from_s - 1e-12, column]) == 0.0


def assert_judged_honestly(situation: Situation, motion) -> None:
    """The report of the written tables says what closed forms say of the joints."""
    cell, schedule = situation.cell, situation.schedule
    texts = render_program(cell, motion).tables
    tables = [parse_table(text, robot) for robot, text in texts.items()]
    assert "nan" not in "".join(texts.values())
    report = verify(Scene.from_cell(cell), schedule, tables, moving=situation.moving)

    verdicts = {(check.name, check.subject): check for check in report.checks}
    assert not any(np.isnan([check.value, check.limit]).any() for check in report.checks)
    for scheduled in schedule.tasks:
        task = scheduled.task
        X_PT = tool_on_part(cell, task.robot, motion.q)
        axes = [axis for axis in task.axes if axis < 3]
        errors = np.linalg.norm((scheduled.X_PT[:, :3, 3] - X_PT[:, :3, 3])[:, axes], axis=1)
        worst = errors[schedule.times >= task.settle - 1e-12].max()
        check = next(c for (name, subject), c in verdicts.items() if name == "position_error" and task.name in subject)
        assert check.value == pytest.approx(1e3 * worst, abs=1e3 * WRITTEN)
        assert check.passed == (check.value <= check.limit)
    speeds = np.abs(np.diff(motion.q, axis=0)).max(axis=0) / schedule.step
    tops = np.concatenate([robot.model.velocity for robot in cell.robots])
    if np.any(speeds > 1.001 * tops):
        assert not report.passed
