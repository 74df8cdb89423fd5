"""The grasp and the spins of a program: robots stand as a plan has them in every phase, and derivatives are exact."""

from pathlib import Path

import numpy as np
import pytest
from builders.home_to_home import PICK_AND_PLACE

from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.trials.prepared import PreparedSearch, prepared, values_of
from cellplan.runs.plan.sequence import plan_work
from cellplan.search.programs.measures import MeasureKind, Measures
from cellplan.search.programs.objective import Effort, Objective
from cellplan.search.programs.program_problem import ProgramProblem
from cellplan.search.programs.rows import Linear

GRASP = "'part.held_by[0].at': {x_mm: [-40, 40], z_mm: [60, 140], yaw_deg: [-20, 20]}"
SPINS = "tasks.seam.spin_deg: [-30, 30], tasks.ring.spin_deg: [-30, 30]"
EFFORT = Effort(keys=3)
CHANGE = np.array([0.01, 0.015, 0.1, 0.15, -0.25])  # [m] and [rad]


@pytest.fixture(scope="module")
def ready(tmp_path_factory: pytest.TempPathFactory) -> PreparedSearch:
    path: Path = tmp_path_factory.mktemp("grasp") / "cell.yaml"
    path.write_text(f"{PICK_AND_PLACE}layout: {{vary: {{{GRASP}, {SPINS}}}}}\n")
    return prepared(LayoutRequest(cell=path, objective=Objective.CYCLE))


@pytest.fixture(scope="module")
def problem(ready: PreparedSearch) -> ProgramProblem:
    assert isinstance(ready.coarse, ProgramProblem)
    return ready.coarse


@pytest.mark.slow
def test_another_grasp_moves_the_holder_as_a_plan_does(ready: PreparedSearch, problem: ProgramProblem) -> None:
    x = problem.given + CHANGE
    point = problem.evaluate(x, ready.given_start)
    assert point is not None

    cell = ready.variables.given_cell.with_values(values_of(ready, x, point.start))

    assert np.abs(point.start - ready.given_start).max() > 0.02
    parts = problem.transfers.parts
    for rows, planned in zip(parts, plan_work(cell).stages, strict=True):
        for name in planned.stage.phase.moving:
            columns, ends = cell.columns(name), [rows.start, rows.stop - 1]
            np.testing.assert_allclose(point.q[ends][:, columns], planned.motion.q[[0, -1]][:, columns], atol=1e-3)


def test_distances_have_the_derivatives_of_their_differences(ready: PreparedSearch, problem: ProgramProblem) -> None:
    demands, x, step = ready.demands(), problem.given + CHANGE, 1e-4
    point = problem.evaluate(x, ready.given_start)
    assert point is not None
    linear = Linear.of(problem, Measures.of(problem, point, demands, EFFORT))
    [rows] = [
        rows
        for rows in linear.rows(demands, EFFORT.reserve, np.ones(len(x)))
        if rows.kind is MeasureKind.DISTANCE and not rows.aim
    ]
    measured = []
    for dx in step * np.diag(problem.scale):
        for side in (1.0, -1.0):
            there = problem.evaluate(x + side * dx, point.start, point)
            assert there is not None
            measured.append(Measures.of(problem, there, demands, EFFORT).values(rows.kind, rows.subjects, rows.nodes))

    differences = (np.array(measured[0::2]) - np.array(measured[1::2])).T / (2.0 * step) / rows.units[:, None]

    known = np.isfinite(differences).all(axis=1)
    assert known.sum() > 5
    assert np.abs(differences[known]).max() > 0.1
    np.testing.assert_allclose(rows.gradients[known], differences[known], atol=0.02 * np.abs(differences[known]).max())


def test_a_spin_turns_the_tool_of_its_task_alone(ready: PreparedSearch, problem: ProgramProblem) -> None:
    spin = problem.names.index("tasks.ring.spin_deg")
    point = problem.evaluate(problem.given, ready.given_start)
    assert point is not None

    by = problem.derivatives(point).q[..., spin]

    turns = [float(np.abs(by[rows]).max()) for rows in problem.transfers.parts]
    names = [phase.variables.tasks for phase in problem.phases]
    assert [turn > 0.1 for turn in turns] == ["ring" in tasks for tasks in names]
