"""The record of a rehearsal: printed units, factors of the rounds, the worst trial by name."""

import json
from dataclasses import replace

import numpy as np
import pytest

from cellplan import load_cell
from cellplan.geometry.transforms import pose
from cellplan.jobs.rehearsal.record import rehearsal_record
from cellplan.jobs.rehearsal.result import rehearsal_figures, rehearsal_page
from cellplan.model.cell.cell_errors import CellErrors, Draw, RobotDraw
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.rehearsal import (
    Correction,
    IsoFigures,
    Outcome,
    PathFigures,
    PoseFigures,
    Rehearsal,
    Round,
    RunRehearsal,
    Trial,
)
from cellplan.model.report.report import TaskAccuracy
from cellplan.report.plots.rendering import pictures
from cellplan.report.record.common import Provenance, as_json

N = 5
TIMES = 0.1 * np.arange(N)
PROVENANCE = Provenance(versions={"cellplan": "x"}, digests={})
ISO = IsoFigures(
    poses=(PoseFigures(at_s=0.0, AP_p=1e-3, AP_abc=(0.1, 0.2, 0.3), RP_l=2e-3, RP_abc=(0.4, 0.5, 0.6)),),
    path=PathFigures(AT_p=3e-3, AT_p_at_s=0.2, AT_abc=(0.0, 0.0, 0.0), RT_p=None, RT_p_at_s=None, RT_abc=None),
)


@pytest.fixture(scope="module")
def cell(cells):
    return load_cell(cells / "planar_pair.yaml")


def accuracy(size):
    errors = size * np.array([[3.0, -4.0, 0.0]]) * np.linspace(0.2, 1.0, N)[:, None]
    return TaskAccuracy(
        task="circle",
        robot="right",
        position_error=errors,
        orientation_error=np.zeros((N, 3)),
        path_length=1.0,
        start_s=0.0,
        end_s=0.4,
    )


def trial(size, shares=(8.0, 2.0, 1.0)):
    sample = RobotDraw(
        joint_offsets=np.deg2rad([0.1, 0.2, 0.3]), link_lengths=np.zeros(3), X_base=pose([1e-3, 0, 0]), X_tool=np.eye(4)
    )
    rounds = tuple(
        Round(number=n, position={"circle": 1e-3 * s}, orientation={"circle": 0.0}, share=s, measured_share=s)
        for n, s in enumerate(shares)
    )
    correction = Correction(
        outcome=Outcome.CONVERGED,
        rounds=rounds,
        best=2,
        accuracy=(accuracy(0.1 * size),),
        references=Schedule(times=TIMES, tasks=()),
        q=np.zeros((N, 6)),
    )
    return Trial(
        draw=Draw(robots={"left": sample, "right": sample}, X_grasps={"left": np.eye(4)}),
        before=(accuracy(size),),
        correction=correction,
        in_pass=None,
    )


@pytest.fixture
def rehearsal(cell):
    run = RunRehearsal(
        name=None,
        times=TIMES,
        judged_from={"circle": 0},
        trials=(trial(1e-3), trial(2e-3)),
        before={"circle": ISO},
        after={"circle": ISO},
        corrected=None,
    )
    return Rehearsal(
        cell=cell,
        errors=CellErrors(seed=9, file="/somewhere/else/e.yaml", digest="ab12"),
        runs=(run,),
        checks=(),
        has_feedback=True,
        has_in_pass=False,
    )


def test_errors_come_in_printed_units_with_the_worst_trial_and_instant(rehearsal):
    task = rehearsal_record(rehearsal, provenance=PROVENANCE)["tasks"]["circle"]

    assert task["before"]["max_position_error_mm"] == pytest.approx(10.0)
    assert (task["before"]["max_position_error_at_s"], task["before"]["max_position_error_trial"]) == (0.4, 2)
    assert task["before"]["max_position_error_by_axis_mm"] == pytest.approx({"x": 6.0, "y": 8.0, "z": 0.0})
    assert task["before"]["mean_position_error_mm"] == pytest.approx(4.5)  # 5 and 10 mm times 0.6 on average
    assert task["before"]["rms_position_error_mm"] == pytest.approx(np.sqrt((25 + 100) / 2 * 0.44))
    assert task["after"]["max_position_error_mm"] == pytest.approx(1.0)
    assert task["in_pass"] is None


def test_figures_bear_the_names_of_the_standard(rehearsal):
    figures = rehearsal_record(rehearsal, provenance=PROVENANCE)["tasks"]["circle"]["iso_9283"]["before"]

    assert (figures["AT_p_mm"], figures["RT_p_mm"]) == (3.0, None)
    (pose_figures,) = figures["poses"]
    assert (pose_figures["AP_p_mm"], pose_figures["RP_l_mm"]) == (1.0, 2.0)
    assert pose_figures["RP_c_deg"] == pytest.approx(np.rad2deg(0.6))


def test_rounds_state_the_factor_of_the_contraction(rehearsal):
    correction = rehearsal_record(rehearsal, provenance=PROVENANCE)["runs"][0]["trials"][0]["correction"]

    assert correction["outcome"] == "converged"
    assert [entry["factor"] for entry in correction["rounds"]] == [None, 0.25, 0.5]


def test_draws_are_written_out_with_their_units(rehearsal):
    sample = rehearsal_record(rehearsal, provenance=PROVENANCE)["runs"][0]["trials"][1]["drawn"]

    assert sample["robots"]["left"]["joint_offsets"] == {"A_deg": 0.1, "B_deg": 0.2, "C_deg": 0.3}
    assert sample["robots"]["right"]["base"]["xyz_mm"] == [1.0, 0.0, 0.0]


def test_no_path_of_this_machine_stands_in_the_record(rehearsal):
    text = as_json(rehearsal_record(rehearsal, provenance=PROVENANCE))

    assert json.loads(text)["inputs"]["e.yaml"] == "ab12"
    assert "/somewhere" not in text


def test_the_page_shows_figures_rounds_and_plots_and_needs_no_network(rehearsal):
    plots = pictures(rehearsal_figures(rehearsal))

    page = rehearsal_page(rehearsal_record(rehearsal, provenance=PROVENANCE), cell=rehearsal.cell, plots=plots)

    assert set(plots) == {
        f"{name}_circle.svg" for name in ("before", "after", "envelope_before", "envelope_after", "rounds")
    }
    assert page.count("<figure") == 5
    assert "AT<sub>p</sub>" in page
    assert "trial 1: converged; round 2 is kept" in page
    assert 'src="' not in page


def test_a_hostile_name_stays_text(rehearsal):
    hostile = replace(rehearsal, cell=replace(rehearsal.cell, name="<script>alert(1)</script>"))

    assert "<script>alert" not in rehearsal_page(
        rehearsal_record(hostile, provenance=PROVENANCE), cell=hostile.cell, plots={}
    )
