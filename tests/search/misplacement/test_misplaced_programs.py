"""Displaced bases of a program: its corners one by one and as scenarios, and their derivatives by differences."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from builders.home_to_home import PICK_AND_PLACE

from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.trials.prepared import prepared, values_of
from cellplan.model.settings.layout import MisplacementEntry
from cellplan.planning.sequence.stages import program_stages
from cellplan.runs.plan.sequence import plan_work
from cellplan.search.misplacement.corners import judged
from cellplan.search.misplacement.displacements import BaseDisplacements
from cellplan.search.misplacement.guarded import GuardedProgram, guarded
from cellplan.search.misplacement.robust import scenarios_of, worst
from cellplan.search.programs.measures import Measures
from cellplan.search.programs.objective import Effort, Objective

EFFORT = Effort(keys=3)


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> SimpleNamespace:
    path: Path = tmp_path_factory.mktemp("program") / "cell.yaml"
    path.write_text(PICK_AND_PLACE)
    ready = prepared(LayoutRequest(cell=path, objective=Objective.CYCLE))
    base = guarded(ready.problem(9))
    assert isinstance(base, GuardedProgram)
    of = BaseDisplacements.of(
        ready.variables, ready.variables.given, MisplacementEntry(position_mm=2.0, orientation_deg=0.2)
    )
    problem = base.of_variables(of)
    point = problem.evaluate(of.given, ready.given_start)
    assert point is not None
    d = np.where(np.arange(2 * len(of.names)).reshape(2, -1) % 3, 1.0, -1.0) * of.amounts
    return SimpleNamespace(ready=ready, base=base, of=of, problem=problem, point=point, d=d, demands=ready.demands())


def test_without_displacement_a_program_is_as_it_was(program: SimpleNamespace) -> None:
    given = program.base.evaluate(program.of.x, program.ready.given_start)

    assert given is not None
    assert np.allclose(given.q, program.point.q, rtol=0.0, atol=1e-12)
    before, after = (
        problem.transfers.seconds(at.x, at.q)
        for problem, at in ((program.base, given), (program.problem, program.point))
    )
    assert before == pytest.approx(after, rel=1e-12)


def test_a_displaced_base_reaches_the_part_on_its_table_as_a_plan_does(program: SimpleNamespace) -> None:
    [point] = program.problem.points(program.d[:1], program.point.start)

    cell = program.of.cell(program.d[0], values_of(program.ready, program.of.x, point.start))

    planned = plan_work(cell)
    rows = program.problem.transfers.parts
    assert len(planned.stages) == len(rows)
    assert any(stage.place is not None for stage in program_stages(cell))
    for part, stage in zip(rows, planned.stages, strict=True):
        works = np.concatenate([np.arange(24)[cell.columns(name)] for name in stage.stage.phase.moving])
        np.testing.assert_allclose(point.q[part][[0, -1]][:, works], stage.motion.q[[0, -1]][:, works], atol=2e-3)


def test_scenarios_of_a_program_are_its_displaced_layouts(program: SimpleNamespace) -> None:
    d = np.concatenate([np.zeros_like(program.d[:1]), program.d])
    problem, demands = scenarios_of(program.base, program.of, d), program.demands
    corners = judged(program.problem, d, program.point.start, demands, EFFORT)

    point = problem.evaluate(program.of.x, program.point.start)

    assert point is not None
    measures = Measures.of(problem, point, replace(demands, singular=None), EFFORT)
    beyond = np.maximum(measures.lower.value.max(axis=0), measures.upper.value.max(axis=0))
    np.testing.assert_allclose(-beyond, np.min([corner.margins for corner in corners], axis=0), atol=1e-9)
    assert measures.cycle == pytest.approx(corners[0].cycle, rel=1e-9)  # that of the layout in place
    unit, step = problem.scale * np.where(np.arange(len(point.x)) % 2, 1.0, -0.5), 1e-4
    by = problem.derivatives(point)
    again = problem.evaluate(point.x, point.start, replace(point, rates=by.rates))
    firsts = np.concatenate(
        [np.arange(part.start, part.start + (part.stop - part.start) // len(d)) for part in problem.transfers.parts]
    )
    near = replace(point, **{name: getattr(point, name)[firsts] for name in ("q", "qd", "qdd")}, rates=by.rates[firsts])
    alone = program.base.evaluate(point.x, point.start, near)
    assert again is not None
    assert alone is not None
    np.testing.assert_allclose(again.q[firsts], alone.q, atol=1e-9)
    sides = [problem.evaluate(point.x + side * step * unit, point.start, again) for side in (1.0, -1.0)]
    by = problem.derivatives(again)
    differences = (sides[0].q - sides[1].q) / (2.0 * step)
    np.testing.assert_allclose(by.q @ unit, differences, atol=5e-3 * np.abs(differences).max())


def test_what_displacements_take_from_a_program_is_the_sum_of_differences(program: SimpleNamespace) -> None:
    problem, step = guarded(program.ready.problem(129)).of_variables(program.of), 0.3  # good to 2nd order of a step
    point = problem.evaluate(program.of.given, program.point.start)

    result = worst(problem, point, program.demands, EFFORT)

    q = np.zeros_like(point.q)
    for unit in np.diag(problem.upper):
        forward, back = (problem.evaluate(side * step * unit, point.start, point) for side in (1.0, -1.0))
        q += np.abs(forward.q - back.q) / (2.0 * step)
    np.testing.assert_allclose(result.margins, q, atol=2e-3 * q.max())
    assert len(result.distances) == len(problem.is_arm)
    assert problem.pair_names(len(problem.is_arm) - 1)[1] == "a singular configuration"
