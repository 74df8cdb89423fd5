"""Skew across the ends of phases: against places of both programs that are sampled densely."""

import json
from itertools import pairwise

import numpy as np
import pytest
from builders.home_to_home import PICK_AND_PLACE

from cellplan import load_cell, open_gate, solve, write_run
from cellplan.model.report.skew import MOST_SKEW, AllowedSkew, SkewLimit
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.model.task.task import Frame
from cellplan.programs.promises.skew import run_skew
from cellplan.scene.kinematics.screw_chain import ScrewChain

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
                        worst = max(worst, float(off) / scheduled.task.tolerance.position_mm.si)
        assert after.begin == pytest.approx(before.end)
    return worst


def limits_of_ends(run: VerifiedRun) -> list[tuple[str | None, AllowedSkew]]:
    """What the ends of phases allow, where that is less than the phases themselves do, with the phase that ends."""
    return [
        (motion.name, limit)
        for motion in run.motions
        if motion.report.skew is not None
        for pair in motion.report.skew.pairs
        for limit in pair.limits
        if limit.limit is SkewLimit.END
    ]


@pytest.mark.slow
def test_no_tool_is_off_beyond_its_tolerance_across_an_end(run: VerifiedRun) -> None:
    """And three times the skew that is allowed takes one off."""
    limits = limits_of_ends(run)
    least = min((limit for _, limit in limits), key=lambda limit: limit.skew)

    assert 0.0 < least.skew < MOST_SKEW
    assert worst_across(run, least.skew) <= 1.0
    if least.subject.startswith("tool"):
        assert worst_across(run, 3.0 * least.skew) > 1.0


@pytest.mark.slow
def test_a_report_and_an_export_state_one_allowed_skew(run: VerifiedRun) -> None:
    """It is the smallest of all phases and of all their ends."""
    skew = run_skew(run)
    record = json.loads((run.folder / "report.json").read_text(encoding="utf-8"))["skew"]
    reports = [motion.report.skew for motion in run.motions if motion.report.skew is not None]
    limits = [limit.skew for report in reports for pair in report.pairs for limit in pair.limits]

    assert skew is not None
    assert skew.least.allowed == min(limits)
    assert record["allowed_ms"] == pytest.approx(1e3 * min(limits), rel=1e-9)


@pytest.mark.slow
def test_the_end_of_a_phase_counts_only_where_it_allows_less(run: VerifiedRun) -> None:
    """And then it is the least of all limits of its phase, at the last instant of that."""
    for name, end in limits_of_ends(run):
        report = next(motion.report for motion in run.motions if motion.name == name)
        assert report.skew is not None
        assert report.skew.allowed <= end.skew
        assert end.at_s == report.times[-1]
    assert limits_of_ends(run)
