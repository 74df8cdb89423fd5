"""Motions of many layouts against the accurate mode, and what a batch must not change."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from cellplan.files.cell.load import load_cell
from cellplan.planning.layout_screening import Candidates, screen_layouts
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import schedule_tasks
from cellplan.search.kernel.derivatives import differentiate
from cellplan.search.kernel.figures import MotionFigures
from cellplan.search.kernel.job import Job, Layouts
from cellplan.search.kernel.run import Motions, run, run_near
from cellplan.search.kernel.screws import Directions

CELL = Path(__file__).resolve().parents[3] / "cells" / "four_robots.yaml"
NODES = 97


@pytest.fixture(scope="module")
def motions(reference: SimpleNamespace) -> Motions:
    return run(reference.job, reference.layouts)


def test_speeds_and_margins_are_those_of_the_accurate_mode(reference: SimpleNamespace, motions: Motions) -> None:
    layouts = reference.layouts
    candidates = Candidates(X_WB=layouts.X_WB, X_FT=layouts.X_FT, start=layouts.start)
    exact = screen_layouts(reference.cell, reference.schedule, candidates, moving=reference.moving, accuracy=1e-7)

    assert exact.is_followed.sum() > 6
    np.testing.assert_array_equal(motions.is_followed, exact.is_followed)
    followed, figures = exact.is_followed, MotionFigures.of(reference.job, motions)
    fastest, expected = figures.speeds.value[followed].max(axis=1), exact.speed_ratios[followed].max(axis=1)
    np.testing.assert_allclose(fastest, expected, rtol=0.005)
    np.testing.assert_allclose(figures.margins[followed], exact.margins[followed], atol=np.radians(0.1))
    fastest = (np.abs(motions.qd[followed]) / reference.job.limits.velocity).max(axis=(1, 2))
    np.testing.assert_allclose(fastest, expected, rtol=0.005)  # at the nodes themselves as well


def test_tools_are_on_their_paths_and_move_as_desired(reference: SimpleNamespace, motions: Motions) -> None:
    job, number = reference.job, int(np.flatnonzero(motions.is_followed)[0])
    placement = reference.layouts.of_places(slice(number, number + 1)).placement(job)
    q, qd, step = motions.q[number].T, motions.qd[number].T, 1e-6
    assert np.abs(job.tasks.errors(q, job.X, placement)).max() < 2e-5
    ahead, behind = (job.tasks.errors(q + sign * step * qd, job.X, placement) for sign in (1.0, -1.0))
    np.testing.assert_allclose((behind - ahead) / (2.0 * step), job.V, atol=2e-3)


def test_a_candidate_moves_alone_as_it_does_among_others(reference: SimpleNamespace, motions: Motions) -> None:
    alone = run(reference.job, reference.layouts.of_places(slice(7, 9)))
    np.testing.assert_allclose(alone.q, motions.q[7:9], atol=1e-9)
    np.testing.assert_allclose(alone.qd, motions.qd[7:9], atol=1e-9)


def test_a_candidate_out_of_reach_is_lost_and_leaves_the_others_alone(
    reference: SimpleNamespace, motions: Motions
) -> None:
    few = reference.layouts.of_places(slice(0, 3))
    X_WB = few.X_WB.copy()
    X_WB[1, 2, 0, 3] += 20.0
    result = run(reference.job, Layouts(X_WB=X_WB, X_FT=few.X_FT, start=few.start, weights=few.weights))
    assert result.lost_at[1] == -np.inf
    followed = motions.is_followed[[0, 2]]
    np.testing.assert_array_equal(result.is_followed[[0, 2]], followed)
    np.testing.assert_allclose(result.q[[0, 2]][followed], motions.q[[0, 2]][followed], atol=1e-9)


def test_larger_weights_of_the_positioner_make_it_move_less(reference: SimpleNamespace, motions: Motions) -> None:
    number = int(np.flatnonzero(motions.is_followed)[0])
    few = reference.layouts.of_places(slice(number, number + 1))
    weights = few.weights.copy()
    weights[:, :6] = 10.0
    result = run(reference.job, Layouts(X_WB=few.X_WB, X_FT=few.X_FT, start=few.start, weights=weights))
    assert result.is_followed.all()
    norms = [np.linalg.norm(qd[:, :6]) for qd in (result.qd[0], motions.qd[number])]
    assert norms[0] < 0.7 * norms[1]


def test_all_nodes_at_once_settle_near_the_motion_and_the_lost_are_run_again(
    reference: SimpleNamespace, motions: Motions
) -> None:
    number = int(np.flatnonzero(motions.is_followed)[0])
    layouts = reference.layouts.of_places(np.array([number, number]))
    given = motions.q[[number, number]] + 1e-3
    given[1] += 2.0
    result = run_near(reference.job, layouts, given)
    assert result.is_followed.all()
    np.testing.assert_allclose(result.q[0], motions.q[number], atol=3e-3)
    np.testing.assert_allclose(result.q[1], motions.q[number], atol=3e-3)
    speed = np.abs(motions.qd[number]).max()
    np.testing.assert_allclose(result.qd[0], motions.qd[number], atol=0.005 * speed)


def test_rates_change_the_way_to_a_motion_but_not_the_motion(reference: SimpleNamespace, motions: Motions) -> None:
    number, job = int(np.flatnonzero(motions.is_followed)[0]), reference.job
    alone = reference.layouts.of_places(slice(number, number + 1))
    q, qd = (np.ascontiguousarray(part[number]) for part in (motions.q, motions.qd))
    rates = differentiate(job, alone, q, qd, Directions.none(job, 1)).rates
    given = (q + 0.01)[None]
    np.testing.assert_allclose(run_near(job, alone, given, rates).q, run_near(job, alone, given).q, atol=1e-6)


def test_rules_are_exact_for_polynomials(reference: SimpleNamespace) -> None:
    job: Job = reference.job
    t = job.times
    np.testing.assert_allclose(job.integral @ t**3, t**4 / 4.0, atol=1e-10)
    np.testing.assert_allclose(job.rates @ t**2, 2.0 * t, atol=1e-10)
    for node in range(2, len(t) - 1):
        predicted = job.steps[node] @ (t[[node, node - 1, node - 2]] ** 2)
        assert predicted == pytest.approx((t[node + 1] ** 3 - t[node] ** 3) / 3.0, abs=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"weights": -1.0}, "positive weights"),
        ({"start": np.nan}, "not finite"),
        ({"X_FT": None}, "expected X_WB and X_FT"),
    ],
)
def test_layouts_that_do_not_belong_together_are_refused(
    reference: SimpleNamespace, change: dict[str, float | None], message: str
) -> None:
    few = reference.layouts.of_places(slice(0, 2))
    parts = {name: getattr(few, name) for name in ("X_WB", "X_FT", "start", "weights")}
    ((name, value),) = change.items()
    parts[name] = parts[name][:1] if value is None else np.full_like(parts[name], value)
    with pytest.raises(ValueError, match=message):
        Layouts(**parts)


def test_a_desired_twist_that_jumps_within_the_motion_is_followed_from_either_side() -> None:
    cell = load_cell(CELL).with_values({"tasks.circle.time_law": "constant", "tasks.circle.duration_s": 2.0})
    schedule = schedule_tasks(cell, [build_toolpath(task, cell.part) for task in cell.tasks])
    moving = [robot.name for robot in cell.robots]
    start = np.concatenate([robot.start for robot in cell.robots if robot.start is not None])
    job, layouts = Job.of(cell, schedule, moving=moving, nodes=NODES), Layouts.of([cell], start[None])

    result = run(job, layouts)

    exact = screen_layouts(cell, schedule, Candidates.of([cell], start[None]), moving=moving, accuracy=1e-7)
    (jump,) = job.times[np.append(np.diff(job.times) == 0.0, False)]
    assert jump == pytest.approx(2.0, abs=1e-9)
    assert result.is_followed.all()
    fastest = (np.abs(result.qd[0]) / job.limits.velocity).max()
    assert fastest == pytest.approx(exact.speed_ratios.max(), rel=0.005)
