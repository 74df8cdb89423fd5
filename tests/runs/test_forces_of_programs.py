"""Forces in a program from home to home: weights where the part is held, processes where they are on, grips."""

import pytest
from builders.home_to_home import PICK_AND_PLACE

from cellplan import load_cell, solve
from cellplan.measures.forces.wrenches import GRAVITY
from cellplan.model.report.report import Report

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("stored_solutions")]
CHANGES = (
    ("radius_mm: 30, plane: xz}, project: -y}", "{}\n    process: {{feed_mm_s: 120, force: {{newton: [0, 0, -25]}}}}"),
    ("rpy_deg: [180, 0, 0]}", "{}, grip: {{force_n: 900, friction: 0.4, radius_mm: 40, normal: x}}"),
    ("  geometry: {box: {size_mm: [300, 300, 200]}}", "{}\n  mass_kg: 7"),
    ("tool: {xyz_mm: [0, 0, 120]", "tool: {{mass_kg: 3, xyz_mm: [0, 0, 120]"),
)


@pytest.fixture(scope="module")
def reports(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Report]:
    text, folder = PICK_AND_PLACE, tmp_path_factory.mktemp("cell")
    for old, new in CHANGES:
        assert text.count(old) == 1, old
        text = text.replace(old, new.format(old))
    (folder / "cell.yaml").write_text(text, encoding="utf-8")
    return {run.phase.name: run.report for run in solve(load_cell(folder / "cell.yaml")).runs}


def test_the_part_weighs_on_its_holder_in_every_phase_in_which_it_is_held(reports: dict[str, Report]) -> None:
    held = {name: report.forces.holders for name, report in reports.items() if report.forces.holders}

    assert "transfer-1" not in held
    assert {"lift", "work-1", "work-2"} <= held.keys()
    for name, (holder,) in held.items():
        if name != "work-2":
            assert holder.force.size == pytest.approx(7.0 * GRAVITY), name


def test_a_process_loads_both_robots_in_its_phase_alone(reports: dict[str, Report]) -> None:
    loaded = {
        name: {load.robot for load in report.forces.joints if load.by_process.size > 0.0}
        for name, report in reports.items()
    }

    assert {name: robots for name, robots in loaded.items() if robots} == {"work-2": {"holder", "pen"}}
    pen = [load for load in reports["work-2"].forces.joints if load.robot == "pen"]
    assert all(load.by_weight is None for load in pen)


def test_the_grip_is_judged_in_every_phase_in_which_it_holds(reports: dict[str, Report]) -> None:
    judged = {name for name, it in reports.items() if any(check.name == "grip_slip" for check in it.checks)}

    assert judged == {name for name, report in reports.items() if report.forces.holders}
    assert all(use.share < 1.0 for report in reports.values() for use in report.forces.grips)
