"""Where a solved motion asks for more than its nodes do, and how a finish adds nodes there."""

from pathlib import Path

import numpy as np
import pytest

from cellplan import load_cell
from cellplan.jobs.fastest.timed_program import Law, TimedProgram
from cellplan.jobs.layout.finish.cycles import distances_missed_at, exceeded_at, load_of, margins_missed_at, time_of
from cellplan.model.progress import silent

CELLS = Path(__file__).resolve().parents[4] / "cells"
SPAN = 10.0  # [s] on the clock of the nodes


@pytest.fixture(scope="module")
def program() -> TimedProgram:
    cell = load_cell(CELLS / "planar_pair.yaml").with_values({"motion.duration_s": 2, "motion.step_s": 0.01})
    return TimedProgram.solved(cell, Law.AS_WRITTEN, {}, task=None, progress=silent).certified(silent)


def test_the_peak_of_a_motion_is_where_its_checks_have_it(program: TimedProgram) -> None:
    assert exceeded_at(program, 1.01 * time_of(program), SPAN) == ()

    highest = exceeded_at(program, 0.99 * time_of(program), SPAN)

    uses = [use for run in program.solution.runs for use in run.report.joints]
    shares = [use.peak_velocity / use.velocity_limit for use in uses]
    assert load_of(program) == pytest.approx(max(shares))  # speeds decide
    at = uses[int(np.argmax(shares))].peak_velocity_at_s * SPAN / program.cycle
    assert min(abs(at - time) for time in highest) < 0.02 * SPAN


def test_margins_and_distances_are_missed_where_the_report_has_them(program: TimedProgram) -> None:
    [run] = program.solution.runs
    least = min((use for use in run.report.joints if use.is_revolute), key=lambda use: use.margin)
    scale = SPAN / program.cycle
    assert margins_missed_at(program, 1.001 * least.margin, SPAN) == pytest.approx((least.margin_at_s * scale,))
    assert margins_missed_at(program, 0.999 * least.margin, SPAN) == ()
    assert distances_missed_at(program, SPAN, within_robot=False) == ()
