"""Repairs of programs: one change for all phases, which the solve from home to home confirms."""

from pathlib import Path

import numpy as np
import pytest

from cellplan import load_cell, solve
from cellplan.cli.main import run
from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.repair.attempts import Attempt, RemedyKind
from cellplan.jobs.repair.record import effects
from cellplan.jobs.repair.repair import repair
from cellplan.jobs.repair.trial import ATTEMPT, evaluate
from cellplan.search.programs.objective import Objective
from cellplan.study.trial import TrialStatus, Variant

CELL = Path(__file__).resolve().parents[3] / "cells" / "in_turn.yaml"
HOME = "robots.abb.home_deg=[0, -30, 10, 0, 60, 0]"
DEMANDED = 22.0  # [deg] of margin, which joint B2 of the second robot misses while it works
HEIGHT = "robots.kuka.base.z_mm"
REQUEST = LayoutRequest(
    cell=CELL, objective=Objective.CHANGE, margin=DEMANDED, settings=(HOME,), fixed=("reis.start_deg",)
)


def margin_of(height: float, starts: dict[str, object]) -> float:
    """Smallest margin in [deg] of the second robot over all phases, with its base so high."""
    values = {HEIGHT: height, "robots.abb.home_deg": [0, -30, 10, 0, 60, 0], **starts}
    runs = solve(load_cell(CELL).with_values(values), is_reported=False).runs
    joints = (use for phase in runs for use in phase.report.joints if use.robot == "kuka")
    return min(float(np.degrees(use.margin)) for use in joints)


@pytest.mark.slow
def test_the_least_change_of_one_base_keeps_the_demand_in_every_phase_and_half_of_it_does_not() -> None:
    attempt = Attempt(kind=RemedyKind.LAYOUT, robots=("kuka",), addresses=(HEIGHT,))

    outcome = evaluate(REQUEST, Variant(0, {ATTEMPT: attempt}))

    assert outcome.status is TrialStatus.PASSED
    values = dict(outcome.figures["values"])  # type: ignore[call-overload]
    assert set(values) == {HEIGHT, "tasks.circle.start_deg"}  # the tasks of the others begin as they did
    assert values[HEIGHT] < 500.0
    assert margin_of(values[HEIGHT], {"tasks.circle.start_deg": values["tasks.circle.start_deg"]}) >= DEMANDED
    assert margin_of(0.5 * (500.0 + values[HEIGHT]), {"robots.kuka.start_deg": "auto"}) < DEMANDED


@pytest.mark.slow
def test_a_program_is_repaired_by_the_robot_that_misses_the_demand() -> None:
    record = repair(REQUEST).record

    assert record["status"] == "repaired"
    assert [remedy["robots"] for remedy in record["remedies"]] == [["kuka"], ["kuka"]]
    (failed,) = record["failed"]
    assert failed["message"].startswith("work-1: joint kuka/B2 stays 19.03 deg")


@pytest.mark.slow
def test_starts_off_their_tasks_are_sought_anew_and_nothing_else_changes(tmp_path: Path) -> None:
    """As where a base was moved and the starts that the cell states were not."""
    settings = ("robots.kuka.base.z_mm=400",)

    outcome = repair(LayoutRequest(cell=CELL, objective=Objective.CHANGE, settings=settings))

    (remedy,) = outcome.record["remedies"]
    assert (outcome.record["status"], remedy["text"]) == ("repaired", "another start branch of kuka")
    assert set(remedy["settings"]) == {HEIGHT, "tasks.circle.start_deg"}
    assert outcome.best is not None
    assert solve(outcome.best).passed


def test_work_that_cannot_begin_is_one_line_that_leads_to_the_map(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    away = ["--set", "robots.kuka.base.x_mm=9000", "--set", "robots.kuka.start_deg=auto"]

    status = run(["layout", str(CELL), "--repair", "-q", "-o", str(tmp_path / "repair"), *away])

    assert status == 3
    error = capsys.readouterr().err.strip()
    assert error.endswith(
        "begins with tasks that can be followed one by one: cellplan map --robot NAME shows from where"
    )
    assert "\n" not in error


def test_of_several_phases_an_effect_has_the_one_nearest_to_its_limit() -> None:
    speed = {"name": "joint_velocity", "subject": "right/A", "value": 1.2, "limit": 1.0, "unit": "rad/s"}
    after = [{**speed, "value": value} for value in (0.3, 0.9, 0.5)]

    (effect,) = effects({"failed": [speed]}, {"checks": after})

    assert (effect["before"], effect["after"]) == (120.0, 90.0)
