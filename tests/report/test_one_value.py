"""The same figure has one value wherever it is printed: terminal, page, 3-D page, picture, tables."""

from dataclasses import replace
from typing import Any

import pytest
from builders.records import phase_record

from cellplan.jobs.compare.result import ROWS
from cellplan.jobs.view.run_scene import _facts
from cellplan.model.cell.cell import Mode
from cellplan.model.report.report import verdict
from cellplan.report.page.figures import key_figures, phase_errors
from cellplan.report.page.render import MODES, report_page
from cellplan.report.record.figures import SHOWN, page_cells, terminal_table
from cellplan.report.record.numbers import plain, seconds
from cellplan.report.text.run import figure_lines, motion_text
from cellplan.runs.drawings.instant import heading, worst_instant


@pytest.fixture
def odd(passed_run: Any) -> Any:
    """A run whose figures look different in every other rounding."""
    report = passed_run.report
    minima = {
        kind: replace(value, minimum=None if value.minimum is None else 9.9989e-3)
        for kind, value in report.clearance.minima.items()
    }
    joints = tuple(replace(use, margin=min(use.margin, 0.2552)) for use in report.joints)
    clearance = replace(report.clearance, minima=minima)
    times = 131.3584 / report.times[-1] * report.times
    return replace(passed_run, report=replace(report, times=times, clearance=clearance, joints=joints))


def record_of(run: Any) -> Any:
    return phase_record(run.report, cell=run.cell, provenance=run.provenance)


def test_duration_clearance_margin_and_speed_are_the_same_on_terminal_and_pages(odd: Any) -> None:
    record = record_of(odd)
    cards = {entry["label"]: f"{entry['value']} {entry['unit']}" for entry in key_figures(record)}
    lines = {line.strip().split("  ")[0]: line for line in figure_lines(record, "the report")}
    facts = dict(_facts(record))

    assert cards["Cycle time"] == facts["cycle"] == "131.358 s"
    assert "131.358 s" in motion_text(record)
    assert cards["Smallest clearance"] == "9.9 mm"
    assert " 9.9 mm, certified" in lines["smallest clearance"]
    assert facts["smallest clearance"].startswith("9.9 mm, certified")
    assert "smallest clearance 9.9 mm" in verdict([odd.report])
    assert heading(worst_instant(odd.report, odd.cell), odd.report)[0].startswith("Smallest clearance 9.9 mm")
    assert cards["Smallest joint margin"] == "14.6 deg"
    assert " 14.6 deg " in lines["smallest joint margin"]
    speed = cards["Highest joint speed"].removesuffix(" of limit")
    assert f" {speed} of its limit" in lines["largest joint speed"]


@pytest.mark.parametrize("value", [0.03333, 0.99961, 1.0, 9.9989, 131.3584, None])
@pytest.mark.parametrize("key", SHOWN)
def test_columns_of_figures_are_the_same_on_terminal_and_page(key: str, value: float | None) -> None:
    (_, text), *_ = page_cells([key], {key: value})

    shown = terminal_table([key], [{key: value}], "")[1].strip()

    assert shown == plain(text).removesuffix(" %")


def test_a_comparison_prints_the_same_figures(odd: Any) -> None:
    rows = dict(ROWS)
    figures = {"cycle_time_s": 131.3584, "min_clearance_mm": 9.9989, "min_clearance_certified": True}

    assert rows["cycle time, s"](figures) == seconds(131.3584) == "131.358"
    assert rows["smallest clearance, mm"](figures) == "9.9"


def test_the_pairs_that_are_not_checked_in_full_have_one_number(odd: Any) -> None:
    links = [{"pair": ["kuka/B1", "kuka/B2"], "reason": "neighbours"}, {"pair": ["abb/A1", "abb/A2"], "reason": "x"}]
    grip = {"kind": "grip", "bodies": ["abb/tool", "part"], "reason": "holds the part"}
    gripped = {"pair": ["part", "abb/tool"], "reason": "holds the part"}
    record = {**record_of(odd), "left_out": [grip], "exclusions": [*links, gripped]}

    page = report_page(record, cell=odd.cell, plots={})
    lines = figure_lines(record, "the report")

    assert any(line.strip().startswith("not checked in full: 1 pair (1 grip)") for line in lines)
    assert "2 further pairs of links of one robot, by reason" in page
    assert "1 pair with reduced checks" in page
    assert "3 pairs" not in page
    assert "3 have reduced" not in page


def test_every_mode_has_words_of_its_own_on_the_page() -> None:
    assert set(MODES) == {str(mode) for mode in Mode}
    assert all(words not in MODES for words in MODES.values())


def test_the_table_of_phases_has_the_errors_of_all_operators_between_the_rows_too() -> None:
    def task(robot: str, at_rows: float, between: float) -> dict[str, Any]:
        errors = {
            f"max_{name}_error{where}_{unit}": value
            for name, unit in (("position", "mm"), ("orientation", "deg"))
            for where, value in (("", at_rows), ("_between_rows", between))
        }
        keys = [f"max_{name}_error{where}" for name in ("position", "orientation") for where in ("", "_between_rows")]
        times = {f"{key}_at_s": 1.5 for key in keys} | {f"{key}_phase": "work-1" for key in keys}
        limits = {"position_mm": 0.1, "orientation_deg": 0.1, "between_rows_mm": 0.1, "between_rows_deg": 0.1}
        return {"robot": robot, "tolerance": limits, **errors, **times}

    record = {"tasks": {"seam": task("left", 2e-8, 0.004), "edge": task("right", 3e-8, 0.002)}}

    ((phase, (position, orientation)),) = phase_errors(record).items()

    assert phase == "work-1"
    assert [(entry["value"], entry["where"]) for entry in (position, orientation)] == [("0.004", "seam (left)")] * 2
    assert not position["is_bad"]
