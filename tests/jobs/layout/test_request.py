"""Options of a layout search: quantities with units, keys that may change, and one located line for what is wrong."""

from pathlib import Path

import pytest

from cellplan import CellplanError, LayoutRequest
from cellplan.cli.improve.layout_search import read_angle, read_length, read_misplacement, read_time
from cellplan.cli.main import run
from cellplan.jobs.layout.trials.searched import searched_cell, written_vary
from cellplan.search.programs.objective import Objective

CELLS = Path(__file__).resolve().parents[3] / "cells"
PAIR = CELLS / "planar_pair.yaml"
FOUR = CELLS / "find_a_layout.yaml"


@pytest.mark.parametrize(
    ("read", "text", "value"),
    [
        (read_length, "10mm", 10.0),
        (read_length, "2 cm", 20.0),
        (read_length, "3", 3.0),
        (read_angle, "0.5rad", 28.64788975654116),
        (read_time, "2min", 120.0),
        (read_misplacement, "1cm,1deg", (10.0, 1.0)),
        (read_misplacement, "0.5, 0.2", (0.5, 0.2)),
    ],
)
def test_a_quantity_is_read_with_its_unit(read, text, value):  # type: ignore[no-untyped-def]
    assert read("--x", text) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ["--budget", "soon"],
            "error: --budget: expected a time such as 60s or 10min (s, min, h), got 'soon'",
        ),
        (
            ["--workers", "2", "--scheduler", "tcp://127.0.0.1:1"],
            "error: --workers: unexpected beside --scheduler, whose workers do the work; leave one of them out",
        ),
        (["--budget", "0"], "error: --budget: expected a time above 0 such as 60s or 10min, got '0'"),
        (["--clearance", "-1mm"], "error: --clearance: expected a length such as 10mm (mm, cm, m), got '-1mm'"),
        (["--margin", "15mm"], "error: --margin: expected an angle such as 15deg (deg, rad), got '15mm'"),
        (
            ["--misplacement", "10mm"],
            "error: --misplacement: expected a length and an angle such as 10mm,1deg, got '10mm'",
        ),
        (
            ["--misplacement", "1deg,10mm"],
            "error: --misplacement: expected a length such as 10mm (mm, cm, m), got '1deg'",
        ),
        (
            ["--misplacement", "10mm,0deg"],
            "error: --misplacement: expected a length and an angle above 0 such as 10mm,1deg, got '10mm,0deg'",
        ),
        (
            ["--misplacement", "10mm,1deg", "--timing", "retimed"],
            "error: --misplacement: expected a motion by the time laws, got --timing retimed: leave one of them out",
        ),
        (
            ["--objective", "cicle"],
            "error: --objective: expected one of conforming, cycle, clearance, change, got 'cicle', did you mean "
            "'cycle'?",
        ),
        (
            ["--duration", "4"],
            "error: --duration: expected no duration where the shortest cycle is sought; add --objective conforming, "
            "clearance or change",
        ),
        (
            ["--try", str(PAIR)],
            f"error: --try {PAIR}: expected the robots of the cell (reis, kuka, abb, staubli), got left, right",
        ),
        (
            ["--vary", "kuka.base={x_mm: [5, "],
            "--vary kuka.base:2: not valid YAML: did not find expected node content",
        ),
        (
            ["--fix", "kuka.basis"],
            "error: --fix: expected a key that may change (abb.base, abb.base.x_mm, abb.base.y_mm, abb.base.yaw_deg, "
            "abb.base.z_mm, abb.tool, abb.tool.length_mm, abb.tool.roll_deg, abb.tool.tilt_deg, kuka.base, "
            "kuka.base.x_mm, kuka.base.y_mm, kuka.base.yaw_deg, kuka.base.z_mm, kuka.tool, kuka.tool.length_mm, "
            "kuka.tool.roll_deg, kuka.tool.tilt_deg, reis.start_deg, staubli.base, staubli.base.x_mm, "
            "staubli.base.y_mm, staubli.base.yaw_deg, staubli.base.z_mm, staubli.tool, staubli.tool.length_mm, "
            "staubli.tool.roll_deg, staubli.tool.tilt_deg), got 'kuka.basis', did you mean 'kuka.base'?",
        ),
    ],
)
def test_a_wrong_option_is_one_line(
    options: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status = run(["layout", str(FOUR), "-q", "-o", str(tmp_path / "out"), *options])

    assert status == 2
    assert capsys.readouterr().err.splitlines() == [message]
    assert not (tmp_path / "out").exists()


def test_an_unknown_key_that_is_to_change_is_located() -> None:
    request = LayoutRequest(cell=FOUR, vary=("kuka.bose={x_mm: [0, 1]}",))

    with pytest.raises(CellplanError, match=r"find_a_layout\.yaml.*layout\.vary.*kuka\.bose"):
        searched_cell(request)


def test_keys_are_added_and_fixed() -> None:
    request = LayoutRequest(
        cell=FOUR,
        objective=Objective.CONFORMING,
        margin=7.0,
        vary=("robots.reis.weights", "kuka.base={z_mm: [0, 600]}"),
        fixed=("abb.base", "staubli.base.z_mm", "kuka.tool"),
    )

    cell = searched_cell(request)

    vary = written_vary(cell)
    assert vary["kuka.base"] == {"z_mm": (0, 600)}
    assert vary["reis.weights"] is True
    assert set(vary["staubli.base"]) == {"x_mm", "y_mm", "yaw_deg"}
    assert {"abb.base", "kuka.tool"}.isdisjoint(vary)
    assert cell.origin.changes["layout.margin_deg"] == 7.0


def test_a_margin_that_leaves_no_room_is_refused() -> None:
    with pytest.raises(
        CellplanError, match=r"layout\.margin_deg: expected less than \S+, half of the range of \S+ of "
    ):
        searched_cell(LayoutRequest(cell=FOUR, margin=179.0))
