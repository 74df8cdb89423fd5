"""Forces in the record, on the page and on the terminal: units, the worst of several phases, and silence."""

from dataclasses import replace
from typing import Any

import pytest
from builders.records import phase_record, whole_record

from cellplan.model.report.forces import ForceReport, GripUse, HolderLoad, InternalLoad, JointLoad
from cellplan.model.robot.base_reaction import PeakLoad
from cellplan.report.page.render import report_page
from cellplan.report.text.forces import force_rows

TURNING = JointLoad(
    robot="kuka",
    joint="B2",
    is_revolute=True,
    total=PeakLoad(40.0, 1.0),
    moving=PeakLoad(42.0, 1.75),
    by_process=PeakLoad(19.0, 0.5),
    by_weight=PeakLoad(41.0, 0.0),
    limit=800.0,
    by_closure=12.5,
)
SLIDING = replace(TURNING, joint="rail", is_revolute=False, total=PeakLoad(7.0, 2.0), limit=None, by_closure=None)
INTERNAL = InternalLoad(force=PeakLoad(0.25, 1.5), moment=PeakLoad(0.0, 0.0), force_at_error=13.0, moment_at_error=5.5)
HOLDER = HolderLoad(robot="reis", force=PeakLoad(60.0, 0.1), moment=PeakLoad(3.0, 0.2), internal=INTERNAL)
GRIP = GripUse(robot="reis", share=0.16, at_s=1.25, tangential=44.0, torsion=1.5, normal=2.0, across=3.33)
FORCES = ForceReport(joints=(TURNING, SLIDING), holders=(HOLDER,), grips=(GRIP,), length=0.7)


def with_forces(run: Any, forces: ForceReport = FORCES) -> Any:
    return phase_record(replace(run.report, forces=forces), cell=run.cell, provenance=run.provenance)


def test_the_record_has_every_figure_in_its_unit(passed_run: Any) -> None:
    forces = with_forces(passed_run)["forces"]

    assert forces["joints"]["kuka"]["B2"] == {
        "unit": "Nm",
        "torque": 40.0,
        "torque_at_s": 1.0,
        "moving": 42.0,
        "moving_at_s": 1.75,
        "by_process": 19.0,
        "by_process_at_s": 0.5,
        "by_weight": 41.0,
        "by_weight_at_s": 0.0,
        "limit": 800.0,
        "by_closure": 12.5,
    }
    assert forces["joints"]["kuka"]["rail"]["unit"] == "N"
    assert forces["holders"]["reis"]["internal"]["force_at_error_n"] == 13.0
    assert forces["grips"]["reis"]["share"] == 0.16
    assert forces["sharing_length_mm"] == pytest.approx(700.0)


def test_several_phases_have_the_worst_of_each_with_its_phase(passed_run: Any) -> None:
    hard = replace(TURNING, total=PeakLoad(50.0, 0.25), by_process=PeakLoad(0.0, 0.0))
    slides = replace(GRIP, share=1.2, tangential=300.0)
    later = ForceReport(joints=(hard,), holders=(HOLDER,), grips=(slides,), length=0.7)
    reports = {"work": replace(passed_run.report, forces=FORCES), "place": replace(passed_run.report, forces=later)}

    forces = whole_record(reports, cell=passed_run.cell, provenance=passed_run.provenance)["forces"]

    joint, grip = forces["joints"]["kuka"]["B2"], forces["grips"]["reis"]
    assert (joint["torque"], joint["torque_at_s"], joint["torque_phase"]) == (50.0, 0.25, "place")
    assert (joint["by_process"], joint["by_process_phase"]) == (19.0, "work")
    assert (grip["share"], grip["share_phase"], grip["tangential_n"]) == (1.2, "place", 300.0)
    assert forces["joints"]["kuka"]["rail"]["torque_phase"] == "work"


def test_the_terminal_has_the_worst_joint_the_internal_force_and_each_grip(passed_run: Any) -> None:
    rows = list(force_rows(with_forces(passed_run)["forces"]))

    assert rows == [
        (
            "largest torque by loads",
            "40 Nm",
            "kuka B2 at 1.000 s; at most 19 by processes, 41 by weights; links not counted",
        ),
        (
            "largest joint force by loads",
            "7 N",
            "kuka rail at 2.000 s; at most 19 by processes, 41 by weights; links not counted",
        ),
        (
            "internal force",
            "0.25 N, 0 Nm",
            "reis, by the closure errors of the tables; 13 N, 5.5 Nm at most by the stated errors",
        ),
        ("friction of a grip", "16.0 % used", "reis at 1.250 s, 3.33 Nm across its normal not judged"),
    ]


def test_weights_that_are_not_stated_are_no_weights_of_zero(passed_run: Any) -> None:
    forces = with_forces(passed_run, ForceReport(joints=(replace(TURNING, by_weight=None),)))["forces"]

    assert forces["joints"]["kuka"]["B2"]["by_weight"] is None
    assert "at most 19 by processes, weights not stated; links" in next(force_rows(forces))[2]


def test_the_page_has_a_section_only_where_something_is_stated(passed_run: Any) -> None:
    page = report_page(with_forces(passed_run), cell=passed_run.cell, plots={})
    silent = report_page(with_forces(passed_run, ForceReport()), cell=passed_run.cell, plots={})

    assert '<h2 id="forces">Forces</h2>' in page
    assert "moments weighed by 700 mm" in page
    assert "kuka B2" in page
    assert "<td>16.0 %</td>" in page
    assert 'id="forces"' not in silent
    assert list(force_rows(None)) == list(force_rows(with_forces(passed_run, ForceReport())["forces"])) == []
