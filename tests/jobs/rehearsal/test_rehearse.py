"""Rehearsals of the planar pair and of the four robots: closed forms, convergence, noise, repeatability."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from cellplan import load_cell, rehearse, solve
from cellplan.checks.real_cell import worst_share
from cellplan.errors import InputError
from cellplan.model.cell.cell_errors import CellErrors
from cellplan.model.report.rehearsal import Outcome
from cellplan.model.settings.cell_errors import MeasurementEntry, PoseErrorEntry, RobotErrorsEntry, ShiftSpreadEntry
from cellplan.model.settings.task import ToleranceEntry
from cellplan.runs.overrides import with_overrides
from cellplan.scene.kinematics.screw_chain import ScrewChain

pytestmark = pytest.mark.usefixtures("stored_solutions")

TOLERANCE = ToleranceEntry(position_mm=0.1, orientation_deg=0.01)
SMALL = CellErrors(
    robots={
        "left": RobotErrorsEntry(joint_offsets_deg={"B": 0.05}),
        "right": RobotErrorsEntry(link_lengths_mm={"C": 0.5}, base=PoseErrorEntry(xyz_mm=(1.0, 0.0, 0.0))),
    }
)


@pytest.fixture(scope="module")
def pair(cells):
    """The planar pair on a clock of 50 ms, with a tolerance that this coarse clock can keep."""
    cell = load_cell(cells / "planar_pair.yaml")
    task = replace(cell.task("circle"), tolerance=TOLERANCE)
    motion = replace(cell.motion, step=0.05)
    solver = cell.solver.changed(gain_per_s=10.0, integrator="euler")  # as the corrected passes are planned
    solved = solve(replace(cell, tasks=(task,), motion=motion, solver=solver))
    return solved.cell


def largest(errors):
    return float(np.linalg.norm(errors.position_error, axis=1).max())


@pytest.mark.slow
def test_an_exact_cell_shows_the_errors_of_the_program_and_nothing_else(pair):
    (run,) = rehearse(pair, CellErrors()).runs

    (planned,) = solve(pair).runs[0].report.accuracy
    (before,) = run.trials[0].before
    np.testing.assert_allclose(before.position_error, planned.position_error, atol=1e-14)  # rounding


def test_one_joint_offset_displaces_the_tool_by_lever_times_angle(pair):
    offset = 1e-5
    stated = CellErrors(robots={"right": RobotErrorsEntry(joint_offsets_deg={"A": np.degrees(offset)})})

    (run,) = rehearse(pair, stated).runs

    q = solve(pair).runs[0].report.q["right"]
    arm = pair.robot("right")
    levers = np.linalg.norm((ScrewChain(arm).tool_poses(q)[:, :3, 3] - arm.X_WB[:3, 3])[:, :2], axis=1)
    planned = solve(pair).runs[0].report.accuracy[0].position_error
    shift = run.trials[0].before[0].position_error - planned
    np.testing.assert_allclose(np.linalg.norm(shift, axis=1), levers * offset, rtol=1e-9)  # the chord is offset^2 short


def test_feedback_brings_the_planar_pair_within_tolerance_pass_by_pass(pair):
    made = rehearse(pair, SMALL, feedback=True, in_pass=True)

    (run,) = made.runs
    (trial,) = run.trials
    correction = trial.correction
    shares = [entry.share for entry in correction.rounds]
    assert correction.outcome is Outcome.CONVERGED
    assert shares[0] > 10.0
    assert all(now < 0.1 * last for last, now in pairwise(shares))  # a contraction
    assert largest(trial.final[0]) < 0.1 * largest(trial.before[0])
    assert made.passed
    assert largest(trial.in_pass[0]) < 0.1 * largest(trial.before[0])


def test_the_corrected_program_is_released_for_one_real_cell_and_says_so(pair):
    made = rehearse(pair, SMALL, feedback=True)

    (run,) = made.runs
    assert made.is_released
    text = run.corrected.program.tables["left"]
    assert "# verdict: passed\n" in text
    assert "# remark: corrected for measured errors, round " in text
    assert {check.name for check in run.corrected.report.checks} >= {"joint_position", "joint_velocity", "collision"}


def test_no_program_is_released_for_many_real_cells(pair):
    spread = RobotErrorsEntry(base=PoseErrorEntry(xyz_mm=(ShiftSpreadEntry(normal=0.5), 0.0, 0.0)))
    made = rehearse(pair, CellErrors(robots={"right": spread}, trials=2), feedback=True)

    (run,) = made.runs
    assert made.passed
    assert (made.is_released, run.corrected) == (False, None)
    assert [trial.correction.outcome for trial in run.trials] == [Outcome.CONVERGED] * 2
    assert run.after["circle"].path.RT_p < 0.1 * run.before["circle"].path.RT_p


def test_noise_bounds_what_feedback_can_reach(pair):
    """The last correction puts one measurement's noise onto the part: its largest of all samples stays."""
    sigma = 2e-6
    made = rehearse(pair, replace(SMALL, measurement=MeasurementEntry(position_noise_mm=1e3 * sigma)), feedback=True)

    (trial,) = made.runs[0].trials
    error = trial.final[0].position_error[:, :2]
    assert error.std() == pytest.approx(sigma, rel=0.15)  # 241 samples, two components, and what is left to learn
    assert trial.correction.outcome is Outcome.CONVERGED


def test_noise_above_the_tolerance_stalls(pair):
    made = rehearse(pair, replace(SMALL, measurement=MeasurementEntry(position_noise_mm=0.2)), feedback=True, rounds=6)

    (trial,) = made.runs[0].trials
    assert trial.correction.outcome is Outcome.STALLED
    assert not made.passed
    assert made.checks[0].message.startswith("true position error of task 'circle' after correction: ")


def test_used_up_rounds_are_reported(pair):
    (trial,) = rehearse(pair, SMALL, feedback=True, rounds=1).runs[0].trials

    assert trial.correction.outcome is Outcome.UNFINISHED
    assert [entry.number for entry in trial.correction.rounds] == [0, 1]


def test_errors_that_lead_the_arms_away_diverge_and_the_solved_program_is_kept(pair):
    far = RobotErrorsEntry(joint_offsets_deg={"A": 45.0, "B": -45.0})
    made = rehearse(pair, CellErrors(robots={"right": far, "left": far}), feedback=True, in_pass=True)

    (trial,) = made.runs[0].trials
    assert trial.correction.outcome is Outcome.DIVERGED
    assert trial.correction.best == 0
    assert not made.passed
    assert np.isfinite(worst_share(pair, trial.final, made.runs[0].judged_from))


def test_a_normal_shift_of_one_base_repeats_as_its_distribution_says(pair):
    """Folded normal distribution: RP_l = RT_p = sigma (sqrt(2/pi) + 3 sqrt(1 - 2/pi)) for shifts along one line."""
    sigma, trials = 3e-4, 200
    spread = RobotErrorsEntry(base=PoseErrorEntry(xyz_mm=(0.0, ShiftSpreadEntry(normal=1e3 * sigma), 0.0)))
    (run,) = rehearse(pair, CellErrors(robots={"right": spread}, trials=trials)).runs

    figures = run.before["circle"]
    expected = sigma * (np.sqrt(2 / np.pi) + 3 * np.sqrt(1 - 2 / np.pi))
    shifts = np.array([trial.draw.robots["right"].X_base[1, 3] for trial in run.trials])
    assert figures.poses[0].RP_l == pytest.approx(expected, rel=0.2)  # 4 / sqrt(2 * 200)
    assert figures.path.RT_p == pytest.approx(figures.poses[0].RP_l, rel=1e-6)  # the same shift at every instant
    assert figures.poses[0].AP_p == pytest.approx(abs(shifts.mean()), abs=1e-7)  # the start is solved to less


def test_fixed_errors_make_one_trial_however_many_are_asked_for(pair):
    (run,) = rehearse(pair, replace(SMALL, trials=50)).runs

    assert len(run.trials) == 1


@pytest.mark.slow
def test_the_same_seed_gives_the_same_numbers_and_another_seed_others(pair):
    spread = RobotErrorsEntry(base=PoseErrorEntry(xyz_mm=(ShiftSpreadEntry(normal=0.5), 0.0, 0.0)))
    noise = MeasurementEntry(position_noise_mm=1e-3)
    stated = CellErrors(robots={"right": spread}, measurement=noise, trials=2, seed=5)

    def errors(of):
        return np.stack(
            [trial.final[0].position_error for trial in rehearse(pair, of, feedback=True, rounds=1).runs[0].trials]
        )

    np.testing.assert_array_equal(errors(stated), errors(stated))
    assert not np.array_equal(errors(stated), errors(replace(stated, seed=6)))


def test_more_trials_than_can_be_kept_are_refused(pair):
    spread = RobotErrorsEntry(base=PoseErrorEntry(xyz_mm=(ShiftSpreadEntry(normal=0.5), 0.0, 0.0)))

    with pytest.raises(InputError, match=r"^e: trials: expected at most 16597 for this cell \(241 samples "):
        rehearse(pair, CellErrors(robots={"right": spread}, trials=20_000, file="e"))


def test_no_rounds_are_refused(pair):
    with pytest.raises(InputError, match=r"^--rounds: expected a whole number of at least 1, got 0$"):
        rehearse(pair, SMALL, feedback=True, rounds=0)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["simultaneous", "pairwise"])
def test_feedback_brings_the_four_robots_within_tolerance(cells, mode):
    cell = with_overrides(load_cell(cells / "four_robots.yaml"), mode=mode)
    stated = CellErrors(
        robots={
            "kuka": RobotErrorsEntry(joint_offsets_deg={"A2": 0.02}),
            "reis": RobotErrorsEntry(base=PoseErrorEntry(rpy_deg=(0.03, 0.0, 0.0))),
            "staubli": RobotErrorsEntry(link_lengths_mm={"C4": 0.3}),
        },
        grasps={"reis": PoseErrorEntry(xyz_mm=(0.3, 0.0, 0.0))},
    )

    made = rehearse(cell, stated, feedback=True)

    assert made.is_released
    for run in made.runs:
        (trial,) = run.trials
        assert worst_share(cell, trial.before, run.judged_from) > 1.0
        assert worst_share(cell, trial.final, run.judged_from) < 0.02  # far within tolerance: where rounds end
