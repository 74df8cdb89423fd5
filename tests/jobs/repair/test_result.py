"""Advice as text, line by line, and as a page."""

from pathlib import Path
from typing import Any

from cellplan.jobs.repair.result import advice_lines, advice_page

CHECK = {
    "name": "joint_velocity",
    "subject": "right/A",
    "passed": False,
    "value": 216.0,
    "limit": 180.0,
    "unit": "deg/s",
    "at_s": 0.5,
    "message": "joint right/A exceeds its velocity limit: 216 deg/s at 0.500 s (120 % of its limit 180 deg/s)",
}
EFFECT = {
    "check": "joint_velocity",
    "subject": "right/A",
    "before": 120.0,
    "after": 96.0,
    "unit": "%",
    "text": "right A velocity 120 % -> 96 % of its limit",
}
REMEDY = {
    "kind": "layout",
    "text": "move right 120 mm +y",
    "robots": ["right"],
    "cost": 1.2,
    "settings": {"robots.right.base.y_mm": 420.0, "environment.column": None},
    "options": ["robots.right.base.y_mm=420.0", "environment.column=null"],
    "effects": [EFFECT],
    "cycle_s": 1.0,
    "smallest_margin_deg": 12.39,
    "smallest_clearance_mm": 7.0,
    "solves": 1,
}


def tried(text: str, reason: str) -> dict[str, Any]:
    return {"kind": "spin", "text": text, "robots": ["right"], "reason": reason}


def record(**changes: Any) -> dict[str, Any]:
    return {
        "schema": "cellplan.advice/1",
        "cell": "pair",
        "file": "my pair.yaml",
        "status": "repaired",
        "duration_s": 1.0,
        "required_clearance_mm": 5.0,
        "required_margin_deg": 2.0,
        "failed": [CHECK],
        "no_motion": "",
        "remedies": [REMEDY],
        "tried": [tried("spin of the tool of right", "too fast"), tried("a", "too near"), tried("b", "too fast")],
        "remarks": ["environment.column is the pedestal of 'right' here"],
        "files": {},
        "seed": 0,
        "inputs": {"my pair.yaml": "00"},
        "versions": {"cellplan": "0"},
        **changes,
    }


def test_a_repaired_cell() -> None:
    assert advice_lines(record(), Path("out"), Path("my pair.yaml")) == [
        "pair: REPAIRED: move right 120 mm +y",
        "  as given (at 1 s, clearance 5 mm, margins 2 deg): 1 check fails",
        f"    {CHECK['message']}",
        "  remedies, each solved and verified; a cost of 1 stands for 100 mm, 10 deg or a tenth more time",
        "    1. move right 120 mm +y (cost 1.20)",
        "       right A velocity 120 % -> 96 % of its limit",
        "       cycle 1 s, smallest margin 12.3 deg, smallest clearance 7.0 mm",
        "       cellplan solve 'my pair.yaml' --set robots.right.base.y_mm=420.0 --set environment.column=null",
        "  no remedy",
        "    spin of the tool of right; b: too fast",
        "    a: too near",
        "  environment.column is the pedestal of 'right' here",
        "next: cellplan solve out/best.yaml -o out-run",
        "report: out/advice.html",
    ]


def test_a_cell_that_passes() -> None:
    given = record(status="passes", failed=[], remedies=[], tried=[], remarks=[], required_margin_deg=0.0)
    assert advice_lines(given, Path("out"), Path("pair.yaml")) == [
        "pair: PASSES as it is given: nothing to repair",
        "  at 1 s, clearance 5 mm",
        "report: out/advice.html",
    ]


def test_a_cell_without_motion_or_remedy() -> None:
    given = record(status="no_motion", failed=[], no_motion="out of reach", remedies=[], remarks=[])
    assert advice_lines(given, Path("out"), Path("pair.yaml"))[:3] == [
        "pair: NO MOTION, and no remedy was found",
        "  as given (at 1 s, clearance 5 mm, margins 2 deg): no motion: out of reach",
        "  no remedy",
    ]
    assert (
        advice_lines(record(status="no_remedy", remedies=[]), Path("out"), Path("p"))[0] == "pair: NO REMEDY was found"
    )


def test_the_page_shows_what_the_record_holds() -> None:
    page = advice_page(record())
    for text in (CHECK["message"], EFFECT["text"], "environment.column=null", "too near", "REPAIRED"):
        assert str(text).replace(">", "&gt;").replace("'", "&#39;") in page
