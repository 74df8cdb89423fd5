"""First screen of a report: failed checks by severity, process speeds, what was not judged, the worst instant."""

from dataclasses import replace
from typing import Any

import pytest
from builders.records import phase_record, whole_record

from cellplan.model.report.check_kinds import CHECK_KINDS
from cellplan.model.report.report import Check
from cellplan.model.settings.task import ProcessEntry
from cellplan.report.page.checks import MAX_LISTED, failure_groups
from cellplan.report.page.first_screen import not_judged, process_speeds, worst_instant
from cellplan.report.page.render import report_page
from cellplan.report.page.times import TimeLinks, page_begin


def check(name: str, subject: str, value: float, limit: float = 0.0, at_s: float | None = 1.0) -> Check:
    message = f"{name} of {subject}: {value}"
    return Check(
        name=name, subject=subject, passed=False, value=value, limit=limit, unit="mm", at_s=at_s, message=message
    )


def record_of(run: Any, *checks: Check) -> Any:
    report = replace(run.report, checks=(*run.report.checks, *checks))
    return phase_record(report, cell=run.cell, provenance=run.provenance)


def test_failures_are_grouped_most_severe_first_and_none_is_lost(passed_run: Any) -> None:
    failed = [
        check("position_error", "circle", 0.3, 0.1),
        check("joint_position", "kuka/B2", 36.0, 35.0),
        check("joint_position", "staubli/C4", -158.0, -150.0),
        *(check("collision", f"a - b{k}", value) for k, value in enumerate((0.2, 1.5, 0.4, 0.1))),
    ]

    groups = failure_groups(record_of(passed_run, *failed))

    assert [group["title"] for group in groups] == [
        CHECK_KINDS[name].fails for name in ("collision", "joint_position", "position_error")
    ]
    assert [row["where"] for row in groups[0]["rows"]] == ["a – b1", "a – b2", "a – b0", "a – b3"]
    assert [row["when"] for row in (groups[0]["rows"][0], groups[1]["rows"][0])] == ["from", "at"]
    assert groups[0]["listed"] == MAX_LISTED < len(groups[0]["rows"])
    assert [row["where"] for row in groups[1]["rows"]] == ["staubli/C4", "kuka/B2"]
    assert groups[1]["rows"][0]["amount"] == "8 mm beyond −150 mm"
    assert sorted(row["message"] for group in groups for row in group["rows"]) == sorted(c.message for c in failed)


def test_a_failed_clearance_names_its_pair(passed_run: Any) -> None:
    minimum = passed_run.report.clearance.minima["self"]
    tight = check("clearance", "self", 41.0, 50.0, at_s=minimum.at_s)

    (group,) = failure_groups(record_of(passed_run, tight))

    assert group["rows"][0]["where"] == " – ".join(minimum.pair)
    assert group["rows"][0]["amount"] == "41.0 mm, required 50 mm"


def test_the_worst_instant_is_that_of_the_closest_pair_unless_a_check_fails(passed_run: Any) -> None:
    record = record_of(passed_run)
    closest = worst_instant(record)
    assert closest is not None
    assert closest["at_s"] == record["clearance"]["whole"]["at_s"]
    assert " – ".join(record["clearance"]["whole"]["pair"]) in closest["text"]

    failed = worst_instant(
        record_of(
            passed_run,
            check("position_error", "circle", 0.3, 0.1, at_s=3.0),
            check("collision", "a - b", 1.0, at_s=None),
            check("collision", "a - c", 0.5, at_s=2.0),
        )
    )
    assert failed is not None
    assert (failed["at_s"], failed["text"]) == (2.0, "Collision: a – c")


def test_a_demanded_feed_stands_beside_the_speed_and_a_missed_one_comes_first(passed_run: Any) -> None:
    process = ProcessEntry(feed_mm_s=40.0)
    tasks = tuple(
        replace(task, process=process) if task.name == "rectangle" else task for task in passed_run.cell.tasks
    )
    cell = replace(passed_run.cell, tasks=tasks)

    rows = process_speeds(record_of(passed_run, check("process_feed", "rectangle", 9.0, 5.0)), cell)

    assert [row["task"] for row in rows] == ["rectangle", "circle", "rhombus"]
    assert [row["demanded"] for row in rows] == ["40 mm/s ± 5 %", "", ""]
    assert [row["is_bad"] for row in rows] == [True, False, False]


def test_what_was_not_judged_leads_to_its_full_lines(passed_run: Any) -> None:
    record = record_of(passed_run)
    lines = record["rests_on"]["lines"]

    result = not_judged(record)

    assert lines
    assert {text for text, place in result if place == "#unstated"} == {line.partition(":")[0] for line in lines}


def test_pairs_that_someone_excluded_are_named_and_the_others_counted(passed_run: Any) -> None:
    def entry(kind: str, *bodies: str) -> dict[str, Any]:
        return {"kind": kind, "bodies": bodies, "reason": "because"}

    record = record_of(passed_run)
    left_out = [
        entry("grip", "a", "part"),
        entry("excluded", "b", "c"),
        entry("mounted", "d", "e"),
        entry("grip", "f", "g"),
    ]

    texts = [text for text, place in not_judged({**record, "left_out": left_out}) if place == "#left-out"]

    assert texts == [
        "not checked in full, excluded by the cell: b - c (because)",
        "3 pairs with reduced checks (2 grip, 1 mounted on each other)",
    ]
    assert ("every pair was checked in full", "#left-out") in not_judged({**record, "left_out": []})


@pytest.mark.parametrize("begin", [0.0, 4.98])
def test_a_time_of_a_page_leads_to_that_of_the_program(begin: float) -> None:
    at = TimeLinks("../view.html", begin)

    link = at(1.6264, 0.5)

    assert link.at == pytest.approx(2.1264, abs=1e-4)
    assert link.address == f"../view.html#t={round(begin + 2.1264, 4)}"
    assert "1.626</a>" in link.__html__()
    assert (at(None), at(1.0, None)) == ("–", "1.000")


def test_figures_of_a_program_know_from_which_phase_they_count(pairwise_runs: Any) -> None:
    first = pairwise_runs["circle"]
    reports = {name: run.report for name, run in pairwise_runs.items()}
    record = whole_record(reports, cell=first.cell, provenance=first.provenance)

    rows = [row for group in failure_groups(record) for row in group["rows"]]

    assert page_begin(record) == 0.0
    assert {row["phase"] for row in rows} <= set(reports)
    assert all(row["message"] for row in rows)


def test_a_picture_is_shown_even_if_nothing_has_a_time(passed_run: Any) -> None:
    record = record_of(passed_run)
    nowhere = {
        kind: {**value, "minimum_mm": None, "pair": None, "at_s": None} for kind, value in record["clearance"].items()
    }
    record = {**record, "clearance": nowhere}
    still = '<?xml version="1.0"?><svg viewBox="0 0 4 3"><title>picture</title></svg>'

    page = report_page(record, cell=passed_run.cell, plots={}, still=still)

    assert worst_instant(record) is None
    assert page.count("<title>picture</title>") == 1
    assert "<?xml" not in page
    assert "picture" not in report_page(record, cell=passed_run.cell, plots={}).split("<main")[1]


def test_a_skew_that_is_more_than_allowed_and_a_touch_at_a_stop_stand_on_the_first_screen(passed_run: Any) -> None:
    record = record_of(passed_run)
    pair = {"robots": ["a", "b"], "allowed_ms": 0.5, "stated_ms": 4.0}
    stop = {"robots": ["a", "b"], "distance_mm": 0.0, "bodies": ["a/tool", "part"]}
    demand = {"name": "stop_clearance"}

    more = {*not_judged({**record, "skew": {"pairs": [pair]}, "stops": {"distances": [stop]}})} - {*not_judged(record)}
    stated = {**pair, "stated_ms": 0.5}
    apart = {**stop, "distance_mm": 1.0}
    judged = {**record, "checks": [*record["checks"], demand]}

    assert more == {
        ("stated skew of a and b, 4 ms, of which 0.5 ms are allowed", "#skew"),
        ("when one robot stops, a/tool and part touch; nothing is demanded of stops", "#stops"),
    }
    assert not_judged({**record, "skew": {"pairs": [stated]}, "stops": {"distances": [apart]}}) == not_judged(record)
    assert not_judged({**judged, "stops": {"distances": [stop]}}) == not_judged(record)
