"""The problem of a program: its derivatives by differences, and its phases as they are alone."""

from pathlib import Path

import numpy as np
import pytest

from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.trials.prepared import PreparedSearch, prepared
from cellplan.search.programs.measures import MeasureKind, Measures
from cellplan.search.programs.objective import CycleTiming, Demands, Effort, Objective
from cellplan.search.programs.program_problem import ProgramProblem
from cellplan.search.programs.rows import Linear

pytestmark = pytest.mark.slow  # phases of programs stand in quick tests of layouts and of misplaced bases

CELL = Path(__file__).resolve().parents[3] / "cells" / "three_tasks_each.yaml"
STEP = 1e-4  # [-] usual steps of the differences
AWAY = 0.02  # [-] usual steps from the given layout, whose numbers are round


@pytest.fixture(scope="module")
def ready() -> PreparedSearch:
    return prepared(LayoutRequest(cell=CELL))


@pytest.fixture(scope="module")
def problem(ready: PreparedSearch) -> ProgramProblem:
    assert isinstance(ready.coarse, ProgramProblem)
    return ready.coarse


def _away(ready: PreparedSearch, problem: ProgramProblem) -> np.ndarray:
    sides = np.random.default_rng(5).uniform(-1.0, 1.0, len(problem.names))
    return np.clip(problem.given + AWAY * sides * problem.scale, problem.lower + 1e-3, problem.upper - 1e-3)


def test_phases_are_as_they_are_alone(ready: PreparedSearch, problem: ProgramProblem) -> None:
    x = _away(ready, problem)
    point = problem.evaluate(x, ready.given_start)
    assert point is not None
    starts = ready.given_start.reshape(len(problem.phases), -1)
    derivatives = problem.derivatives(point)
    for phase, start, rows in zip(problem.phases, starts, problem.transfers.parts, strict=True):
        alone = phase.evaluate(x, start)
        assert alone is not None
        works = [column for column in range(len(start)) if problem.joint_names(column)[0] in phase.job.moving]
        assert np.array_equal(alone.q[:, works], point.q[rows][:, works])
        assert np.array_equal(phase.derivatives(alone).qd, derivatives.qd[rows])
        assert np.diff(problem.times[rows]).sum() == pytest.approx(float(phase.times[-1]))


def test_the_holder_begins_its_tasks_at_its_start_and_its_moves_at_the_part(
    ready: PreparedSearch, problem: ProgramProblem
) -> None:
    column = problem.names.index("robots.holder.start_deg[0]")
    x = problem.given.copy()
    x[column] += 0.1
    point = problem.evaluate(x, ready.given_start)
    assert point is not None
    moved = point.start - ready.given_start
    by_phase = moved.reshape(len(problem.phases), -1)[:, 0]
    assert by_phase == pytest.approx([0.0, 0.0, 0.1, 0.1, 0.1, 0.0, 0.0], abs=1e-6)


def test_idle_robots_stand_where_their_work_begins_and_transfers_lead_from_there(
    ready: PreparedSearch, problem: ProgramProblem
) -> None:
    point = problem.evaluate(_away(ready, problem), ready.given_start)
    assert point is not None
    columns, parts = ready.cell.columns("left"), problem.transfers.parts
    work = next(place for place, phase in enumerate(problem.phases) if "left" in phase.job.moving)
    begin, end = problem.transfers._ends(point.q, problem.transfers.home)
    assert work > 0
    assert np.all(point.q[: parts[work].start, columns] == point.q[parts[work].start, columns])
    assert np.array_equal(begin[:2, columns], end[:2, columns])  # before the first task it does not move


@pytest.mark.parametrize("timing", list(CycleTiming))
def test_rows_are_the_derivatives_of_what_is_measured(
    ready: PreparedSearch, problem: ProgramProblem, timing: CycleTiming
) -> None:
    count, effort, joints = len(problem.names), Effort(), ready.cell.joint_count
    is_written = timing is CycleTiming.LAWS
    demands = Demands(
        objective=Objective.CYCLE,
        margin=np.full(joints, 0.2),
        timing=timing,
        duration=0.01 * ready.duration if is_written else None,  # so that all speeds count
    )
    point = problem.evaluate(_away(ready, problem), ready.given_start)
    assert point is not None
    here = Measures.of(problem, point, demands, effort)
    squares = 0 if here.pace is None else len(here.pace.inner)
    rows = Linear.of(problem, here).rows(demands, effort.reserve, np.full(count + squares, 1.0))
    z = np.random.default_rng(1).uniform(-1.0, 1.0, count)
    sides = []
    for sign in (1.0, -1.0):
        there = problem.evaluate(point.x + sign * STEP * z * problem.scale, point.start)
        assert there is not None
        sides.append(Measures.of(problem, there, demands, effort))
    for row in rows:
        if (
            not len(row.subjects)
            or row.kind is MeasureKind.CYCLE
            or (here.pace is not None and row.kind is not MeasureKind.DISTANCE)
        ):
            continue  # of transfers, see below; the squares of a retimed motion are unknowns of their own
        after, before = (side.values(row.kind, row.subjects, row.nodes) for side in sides)
        seen = (after - before) / (2.0 * STEP * row.units)
        is_seen = ~np.isnan(seen)
        errors = np.abs(seen - row.gradients[:, :count] @ z)[is_seen]
        assert np.quantile(errors, 0.9) <= 0.02 * np.abs(seen[is_seen]).max()


def test_times_of_transfers_have_their_derivatives(ready: PreparedSearch, problem: ProgramProblem) -> None:
    point = problem.evaluate(_away(ready, problem), ready.given_start)
    assert point is not None
    exact = problem.transfers.derivatives(point.x, point.q, problem.derivatives(point).q) * problem.scale
    now, known = problem.transfers.seconds(point.x, point.q), 0
    for column, by in enumerate(exact.tolist()):
        slopes = []
        for sign in (1.0, -1.0):
            x = point.x + sign * STEP * problem.scale * (np.arange(len(exact)) == column)
            there = problem.evaluate(x, point.start)
            assert there is not None
            slopes.append(sign * (problem.transfers.seconds(there.x, there.q) - now) / STEP)
        if np.ptp(slopes) <= 0.02 * np.abs(exact).max():  # another face may be the nearest
            known += 1
            assert by == pytest.approx(np.mean(slopes), abs=0.01 * np.abs(exact).max())
    assert known >= len(exact) - 1


def test_a_planned_program_shows_the_detours_of_its_transfers(ready: PreparedSearch, problem: ProgramProblem) -> None:
    point = problem.evaluate(problem.given, ready.given_start)
    assert point is not None
    straight, shares = problem.transfers._straight(point.x, point.q)
    is_blocked = shares > 0.0
    seconds = np.where(is_blocked, 1.5 * straight, straight)

    learned = problem.transfers.learned(point.x, point.q, seconds)

    assert 0 < is_blocked.sum() < len(straight)
    assert learned.seconds(point.x, point.q) == pytest.approx(seconds.sum())
    assert np.array_equal(learned.detours[~is_blocked], problem.transfers.detours[~is_blocked])


def test_pairs_of_all_phases_have_their_names(ready: PreparedSearch, problem: ProgramProblem) -> None:
    point = problem.evaluate(problem.given, ready.given_start)
    assert point is not None
    distances = problem.distances(point, np.arange(len(problem.times)), 0.2)
    worst = int(distances.values.argmin())
    rows = next(
        place for place, part in enumerate(problem.transfers.parts) if part.start <= distances.nodes[worst] < part.stop
    )
    phase = problem.phases[rows]
    alone = phase.distances(problem._of_phase(point, rows), np.arange(len(phase.times)), 0.2)
    assert distances.values[worst] == pytest.approx(alone.values.min(), abs=1e-12)
    assert problem.pair_names(int(distances.pairs[worst])) == phase.pair_names(int(alone.pairs[alone.values.argmin()]))
