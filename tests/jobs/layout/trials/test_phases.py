"""The phases of a program that a search knows: its transfers as a plan of the given layout has them."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from builders.home_to_home import PICK_AND_PLACE

from cellplan.jobs.layout.given_layout import given_program
from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.trials.prepared import PreparedSearch, prepared
from cellplan.planning.sequence.stages import program_stages
from cellplan.planning.transfer.straight_time import straight_steps
from cellplan.runs.plan.retiming import transfer_retimer
from cellplan.runs.plan.sequence import via_points
from cellplan.search.programs.measures import Measures
from cellplan.search.programs.objective import Effort
from cellplan.search.programs.program_problem import ProgramProblem
from cellplan.search.programs.transfers import NORM

SERVICE = "    service: {at: [30, -80, -100, 20, 80, 90], takes_s: 2, every: {seams: 1}}\n"
VIA = "    via: {before: [service], after: [[0, -80, -110, 20, 80, 90]]}\n"


def _ready(folder: Path, text: str) -> PreparedSearch:
    path = folder / "cell.yaml"
    path.write_text(text)
    return prepared(LayoutRequest(cell=path))


@pytest.fixture(scope="module")
def ready(tmp_path_factory: pytest.TempPathFactory) -> PreparedSearch:
    text = PICK_AND_PLACE.replace("part:\n", f"{SERVICE}part:\n", 1).replace("environment:\n", f"{VIA}environment:\n")
    return _ready(tmp_path_factory.mktemp("via"), f"{text}  transfer: {{speed_percent: 50, tcp_mm_s: 250}}\n")


def test_transfers_pass_their_via_points_at_the_speeds_that_are_stated(ready: PreparedSearch) -> None:
    problem, phases = ready.problem(9), ready.phases
    assert phases is not None
    assert isinstance(problem, ProgramProblem)
    point = problem.evaluate(problem.given, ready.given_start)
    assert point is not None
    cell, retimer, true, number = phases.work.cell, transfer_retimer(phases.work.scenes.held), 0.0, 0
    home = np.concatenate([robot.home for robot in cell.robots if robot.home is not None])
    stages, last = program_stages(cell), home
    for place, stage in enumerate(stages):
        if stage.phase.tasks:
            last, number = point.q[problem.transfers.parts[number].stop - 1], number + 1
        elif stage.dwell is None:
            is_last = number == len(problem.transfers.parts)
            goal = home if is_last else point.q[problem.transfers.parts[number].start]
            passed = via_points(stages, place, (last, goal), home)
            moves = [(a, b) for (a, _), (b, _) in pairwise(passed)]
            true += sum(straight_steps(a, b, retimer.bounds, retimer.step) * retimer.step for a, b in moves)
            true += sum(stays for _, stays in passed)

    times, _ = problem.transfers._straight(point.x, point.q)

    straight = times.sum() + problem.transfers.stays.sum()
    assert problem.transfers.stays.sum() == 2.0
    assert len(problem.transfers.of) > len(problem.transfers.detours)
    assert straight == pytest.approx(true, abs=len(times) * retimer.step, rel=12 ** (1.0 / NORM) - 1.0)


def test_derivatives_of_transfers_over_via_points_are_differences(ready: PreparedSearch) -> None:
    problem = ready.problem(9)
    assert isinstance(problem, ProgramProblem)
    rng = np.random.default_rng(2)
    x = problem.given + 0.02 * problem.scale * rng.uniform(-1.0, 1.0, len(problem.given))
    point = problem.evaluate(x, ready.given_start)
    assert point is not None
    transfers, by = problem.transfers, problem.derivatives(point).q
    sides = [
        transfers.seconds(x + side * dx, point.q + side * (by @ dx))
        for dx in 1e-5 * np.diag(problem.scale)
        for side in (1.0, -1.0)
    ]

    result = transfers.derivatives(x, point.q, by) * problem.scale

    differences = (np.array(sides[0::2]) - np.array(sides[1::2])) / 2e-5
    assert np.abs(differences).max() > 0.0
    np.testing.assert_allclose(result, differences, atol=0.02 * np.abs(differences).max())


def test_detours_of_a_planned_program_are_those_of_whole_transfers(ready: PreparedSearch) -> None:
    problem = ready.problem(9)
    assert isinstance(problem, ProgramProblem)
    point = problem.evaluate(problem.given, ready.given_start)
    assert point is not None
    transfers = problem.transfers
    times, shares = transfers._straight(point.x, point.q)
    seconds = np.bincount(transfers.of, times * (1.0 + 2.0 * shares)) + transfers.stays

    learned = transfers.learned(point.x, point.q, seconds.tolist())

    assert learned.seconds(point.x, point.q) == pytest.approx(seconds.sum())


@pytest.mark.slow
def test_the_work_of_a_retimed_program_takes_about_as_long_as_its_estimate(tmp_path: Path) -> None:
    path = tmp_path / "cell.yaml"
    path.write_text(PICK_AND_PLACE)
    ready = prepared(LayoutRequest(cell=path, settings=("motion.timing=fastest", "motion.step_s=0.004")))
    problem = ready.coarse
    assert isinstance(problem, ProgramProblem)
    point = problem.evaluate(problem.given, ready.given_start)
    assert point is not None
    measures = Measures.of(problem, point, ready.demands(), Effort(keys=3))
    runs = given_program(ready).solution.runs

    estimate = measures.cycle - problem.transfers.seconds(point.x, point.q)

    true = sum(run.report.cycle_time for run in runs if run.phase.tasks)
    assert estimate == pytest.approx(true, rel=0.1)
