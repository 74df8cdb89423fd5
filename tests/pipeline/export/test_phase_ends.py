"""Skew across the ends of phases: against places of both programs that are sampled densely."""

from itertools import pairwise

import numpy as np
import pytest
from builders.home_to_home import PICK_AND_PLACE

from cellplan import load_cell, open_gate, solve, write_run
from cellplan.kinematics.screw_chain import ScrewChain
from cellplan.model.skew import MOST_SKEW
from cellplan.model.task import Frame
from cellplan.model.verified_run import VerifiedRun
from cellplan.pipeline.export.phase_ends import ends_allow
from cellplan.pipeline.export.skew import run_skew

CONTROLLERS = """\
controllers: {a: {kind: other}, b: {kind: other}}
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> VerifiedRun:
    folder = tmp_path_factory.mktemp("ends")
    text = PICK_AND_PLACE.replace("  holder:\n", "  holder:\n    controller: {id: a}\n")
    text = text.replace("  pen:\n", "  pen:\n    controller: {id: b}\n") + CONTROLLERS
    (folder / "cell.yaml").write_text(text, encoding="utf-8")
    write_run(solve(load_cell(folder / "cell.yaml")), folder / "run")
    return open_gate(folder / "run", cell=folder / "cell.yaml")


def worst_across(run: VerifiedRun, skew: float) -> float:
    """Largest position error of the pen, as a share of its tolerance, with one robot across an end of its phases."""
    cell, worst = run.cell, 0.0
    chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
    (tables,) = run.programs.values()
    for place, (before, after) in enumerate(pairwise(run.motion.plan.program)):
        at = tables["pen"].times[run.motion.rows(before).stop - 1]
        ends = [(run.motions[place], -1), (run.motions[place + 1], 0)]
        for early, late in np.random.default_rng(place).uniform(0.0, skew, (60, 2)):
            if early + late > skew:
                continue
            for times in ({"pen": at - early, "holder": at + late}, {"pen": at + early, "holder": at - late}):
                q = {n: [[np.interp(times[n], tables[n].times, c) for c in tables[n].q.T]] for n in times}
                X = {n: chains[n].tool_poses(np.array(q[n]))[0] for n in q}
                for motion, row in ends:
                    for scheduled in motion.schedule.tasks:
                        if scheduled.task.relative_to is not Frame.PART:
                            continue
                        X_PT = np.linalg.inv(X["holder"] @ motion.cell.part.X_CP) @ X["pen"]
                        off = np.linalg.norm(X_PT[:3, 3] - scheduled.X_PT[row, :3, 3])
                        worst = max(worst, float(off) / scheduled.task.tolerance.position)
        assert after.begin == pytest.approx(before.end)
    return worst


@pytest.mark.slow
def test_no_tool_is_off_beyond_its_tolerance_across_an_end(run: VerifiedRun) -> None:
    """And three times the skew that is found takes one off."""
    found = ends_allow(run, "holder", "pen")

    assert found is not None
    assert 0.0 < found[0] < MOST_SKEW
    assert worst_across(run, found[0]) <= 1.0
    assert "end of " in found[1]
    if found[1].startswith("tool"):
        assert worst_across(run, 3.0 * found[0]) > 1.0


@pytest.mark.slow
def test_a_program_allows_no_more_than_the_ends_of_its_phases(run: VerifiedRun) -> None:
    found, skew = ends_allow(run, "holder", "pen"), run_skew(run)

    assert found is not None
    assert skew is not None
    assert skew.least.allowed <= found[0]
    assert ends_allow(run, "holder", "pen", most=0.5 * found[0]) is None
    assert ends_allow(run, "holder", "pen", most=0.0) is None
