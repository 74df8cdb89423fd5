"""The picture of a run: the instant that decides its verdict, what is marked there, and how little rounding changes."""

from dataclasses import replace

import numpy as np
import pytest
from builders.records import phase_record, whole_record
from builders.two_phases import PAIR

from cellplan import Solution, load_cell, solve
from cellplan.model.report.report import Check, Report
from cellplan.report.page.first_screen import worst_instant as worst_page_instant
from cellplan.report.record.common import Provenance
from cellplan.report.still.picture import StillPicture
from cellplan.runs.drawings.instant import worst_instant
from cellplan.runs.drawings.picture import (
    MARKED,
    STILL,
    materials,
    phase_drawings,
    program_drawings,
    still_picture,
)
from cellplan.runs.gate.compare_drawings import foreign_piece, is_same_drawing

pytestmark = pytest.mark.usefixtures("stored_solutions")


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> Solution:
    """Two arms that work on one plate in turns."""
    file = tmp_path_factory.mktemp("still") / "pair.yaml"
    file.write_text(PAIR, encoding="utf-8")
    return solve(load_cell(file))


def failed(name: str, subject: str, *, value: float = 2.0, at_s: float | None = 1.0) -> Check:
    return Check(name=name, subject=subject, passed=False, value=value, limit=1.0, unit="mm", at_s=at_s, message="told")


def with_checks(solution: Solution, *checks: Check) -> Report:
    return replace(solution.runs[0].report, checks=checks)


def picture_of(solution: Solution, report: Report) -> StillPicture:
    return still_picture(solution.cell, solution.runs[0].schedule, report)


def test_the_instant_of_a_sound_run_is_that_of_the_smallest_clearance_of_its_report(solved: Solution) -> None:
    for run in solved.runs:
        record = phase_record(run.report, cell=solved.cell, provenance=Provenance(versions={}, digests={}))
        whole = record["clearance"]["whole"]

        instant = worst_instant(run.report, solved.cell)

        assert (instant.at_s, list(instant.bodies)) == (whole["at_s"], whole["pair"])
        shown = still_picture(solved.cell, run.schedule, run.report)
        np.testing.assert_allclose(1e3 * shown.mark, whole["points_mm"], atol=1e-9)
        distance = 1e3 * float(np.linalg.norm(shown.mark[1] - shown.mark[0]))
        assert distance == pytest.approx(whole["minimum_mm"], abs=0.11)  # how exact a smallest distance is
        assert not shown.is_bad


def test_the_nearest_points_lie_on_the_bodies_that_are_drawn(solved: Solution) -> None:
    run = solved.runs[0]
    shown = picture_of(solved, run.report)
    pair = dict(zip(worst_instant(run.report, solved.cell).bodies, shown.mark, strict=True))

    for solid in shown.solids:
        if solid.name in pair:
            from cellplan.scene.collision.bodies import prepare

            p_S = solid.X_WS[:3, :3].T @ (pair[solid.name] - solid.X_WS[:3, 3])
            body = prepare(solid.name, solid.shape)
            assert np.linalg.norm(p_S - body.centre) <= body.radius + 1e-6


@pytest.mark.parametrize(
    ("checks", "expected"),
    [
        ([failed("position_error", "first"), failed("joint_position", "left/q2")], "joint_position"),
        ([failed("clearance", "part"), failed("collision", "left/A - right/A")], "collision"),
        ([failed("payload", "left", at_s=None), failed("position_error", "first")], "position_error"),
    ],
)
def test_the_gravest_failure_with_an_instant_decides(solved: Solution, checks: list[Check], expected: str) -> None:
    instant = worst_instant(with_checks(solved, *checks), solved.cell)

    assert instant.check is not None
    assert instant.check.name == expected


def test_of_one_kind_the_largest_excess_decides(solved: Solution) -> None:
    small, large = (
        failed("joint_position", "left/q1", value=1.1),
        failed("joint_position", "left/q2", value=3.0, at_s=0.5),
    )

    assert worst_instant(with_checks(solved, small, large), solved.cell).at_s == 0.5


def test_bodies_that_touch_are_marked_and_the_other_robot_is_muted(solved: Solution) -> None:
    shown = picture_of(solved, with_checks(solved, failed("collision", "left/A - part")))

    materials = {solid.name: solid.material for solid in shown.solids}
    assert {materials["left/A"], materials["part"]} == {MARKED, f"{MARKED}-2"}
    assert materials["right/A"] == "muted right"
    assert materials["left/B"] == "robot left"
    assert shown.title == "Collision at 1.000 s of first"
    assert shown.is_bad


def test_a_failure_without_an_instant_does_not_make_the_smallest_clearance_look_failed(solved: Solution) -> None:
    told = failed("payload", "left", at_s=None)
    shown = picture_of(solved, with_checks(solved, told))

    assert shown.title.startswith("Smallest clearance")
    assert told.message in shown.notes
    assert not shown.is_bad
    assert not [solid.name for solid in shown.solids if solid.material.startswith(MARKED)]


def test_a_robot_called_like_a_colour_leaves_the_colours_of_other_things_alone(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    file = tmp_path_factory.mktemp("names") / "pair.yaml"
    file.write_text(PAIR.replace("left", MARKED).replace("right", "thing"), encoding="utf-8")
    usual = file.with_name("usual.yaml")
    usual.write_text(PAIR, encoding="utf-8")

    assert {name: colour for name, colour in materials(load_cell(usual)).items() if " " not in name} == {
        name: colour for name, colour in materials(load_cell(file)).items() if " " not in name
    }


def test_a_joint_beyond_its_limit_marks_the_link_that_it_moves(solved: Solution) -> None:
    joint = solved.cell.robot("left").model.joint_names[1]
    shown = picture_of(solved, with_checks(solved, failed("joint_position", f"left/{joint}")))

    marked = [solid for solid in shown.solids if solid.material == MARKED]
    assert [solid.name for solid in marked] == list(shown.marked)
    assert all(name.startswith("left/") for name in shown.marked)
    assert len(shown.mark) == 1


def test_a_tool_off_its_path_is_marked_at_its_tip(solved: Solution) -> None:
    from cellplan.scene.kinematics.screw_chain import ScrewChain

    report = with_checks(solved, failed("position_error", "first"))
    shown = picture_of(solved, report)

    row = int(np.searchsorted(report.times, 1.0))
    tip = ScrewChain(solved.cell.robot("left")).tool_poses(report.q["left"][row : row + 1])[0, :3, 3]
    np.testing.assert_allclose(shown.mark, tip[None], atol=1e-9)
    assert shown.marked == ("left/tool",)


def test_of_several_phases_the_worst_one_is_shown(solved: Solution) -> None:
    first, second = solved.runs
    bad = replace(second, report=replace(second.report, checks=(failed("joint_position", "right/q1"),)))

    whole = program_drawings(solved.cell, [first, bad])

    assert whole[STILL] == phase_drawings(bad)[STILL]
    smallest = min(
        (first, second), key=lambda phase: min(m.minimum or 1.0 for m in phase.report.clearance.minima.values())
    )
    assert program_drawings(solved.cell, [first, second])[STILL] == phase_drawings(smallest)[STILL]


@pytest.mark.parametrize("seed", range(3))
def test_the_noise_of_the_arithmetic_does_not_change_a_drawing(solved: Solution, seed: int) -> None:
    rng = np.random.default_rng(seed)
    for phase in solved.runs:
        noisy = {name: q + rng.uniform(-1e-12, 1e-12, q.shape) for name, q in phase.report.q.items()}
        others = phase_drawings(replace(phase, report=replace(phase.report, q=noisy)))

        for name, text in phase_drawings(phase).items():
            assert is_same_drawing(others[name], text)
            assert foreign_piece(others[name], text) is None


@pytest.mark.parametrize("nearer", [1.0, 1.0 - 1e-15, 0.9])
def test_the_picture_of_a_program_is_of_the_phase_that_its_report_names(solved: Solution, nearer: float) -> None:
    """Phases that are alike but for the noise of the arithmetic, and one that comes nearer."""
    first = solved.runs[0].report
    minima = {
        kind: replace(minimum, minimum=None if minimum.minimum is None else nearer * minimum.minimum)
        for kind, minimum in first.clearance.minima.items()
    }
    second = replace(first, phase="second", clearance=replace(first.clearance, minima=minima))
    one, other = solved.runs
    reports = {"first": first, "second": second}
    record = whole_record(reports, cell=solved.cell, provenance=Provenance(versions={}, digests={}))

    picture = program_drawings(solved.cell, [replace(one, report=first), replace(other, report=second)])[STILL]

    shown = worst_page_instant(record)
    assert shown is not None
    assert shown["phase"] == ("second" if nearer == 0.9 else "first")
    assert f"at {shown['at_s']:.3f} s of {shown['phase']}" in picture


def test_a_failure_without_a_time_does_not_choose_the_phase_of_the_picture(solved: Solution) -> None:
    first, second = (run.report for run in solved.runs)
    timeless = replace(first, checks=(failed("payload", "left", at_s=None),))
    timed = replace(second, checks=(failed("joint_acceleration_assumed", "right/J1", at_s=0.5),))
    one, other = solved.runs
    reports = {"first": timeless, "second": timed}
    record = whole_record(reports, cell=solved.cell, provenance=Provenance(versions={}, digests={}))

    picture = program_drawings(solved.cell, [replace(one, report=timeless), replace(other, report=timed)])[STILL]

    shown = worst_page_instant(record)
    assert shown is not None
    assert (shown["phase"], shown["at_s"]) == ("second", 0.5)
    assert "at 0.500 s of second" in picture
