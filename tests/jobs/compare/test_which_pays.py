"""Sentences on made-up comparisons: what pays, what it costs, ties, failures and reservations."""

from typing import Any

from cellplan.jobs.compare.which_pays import sentences

EVEN = {
    "cycle_time_s": 4.0,
    "positioner_load_s": 1.0,
    "positioner_phase_load_s": 1.0,
    "operator_load_s": 3.0,
    "operator_work_load_s": 3.0,
    "work_velocity_ratio": 0.5,
    "work_acceleration_ratio": 0.4,
    "min_margin_deg": 20.0,
    "min_clearance_mm": 12.0,
    "failed_checks": 0,
    "failed": [],
    "not_in_program": [],
    "proof": "solved",
}


def variant(name: str, *, status: str = "passed", reason: str = "", **figures: Any) -> dict[str, Any]:
    return {"name": name, "status": status, "reason": reason, "figures": {**EVEN, **figures}}


def without_motion(name: str, status: str) -> dict[str, Any]:
    return {"name": name, "status": status, "reason": "kuka: no start posture", "figures": {}}


def test_the_fastest_pays_and_every_figure_that_is_worse_is_its_cost() -> None:
    fast = variant(
        "fast", positioner_load_s=2.0, positioner_phase_load_s=2.0, min_margin_deg=10.0, min_clearance_mm=15.0
    )
    slow = variant("slow", cycle_time_s=9.6)
    assert sentences([slow, fast])[0] == (
        "fast is 2.4 times as fast as slow (4 s and 9.6 s). The price: load of the positioner 2 instead of 1 s; "
        "load of the positioner in its hardest phase 2 instead of 1 s; smallest joint margin 10.0 instead of 20.0 deg."
    )


def test_a_variant_that_is_faster_and_nowhere_worse_costs_nothing_that_is_compared() -> None:
    first, *_ = sentences([variant("fast"), variant("slow", cycle_time_s=4.1)])
    assert first == (
        "fast is 1.02 times as fast as slow (4 s and 4.1 s), and each load, peak, margin and clearance is no worse."
    )


def test_differences_below_one_percent_are_no_costs() -> None:
    first, *_ = sentences([variant("fast", work_velocity_ratio=0.504), variant("slow", cycle_time_s=8.0)])
    assert "price" not in first


def test_a_tie_names_what_each_one_costs() -> None:
    one, other = variant("one", operator_load_s=4.0), variant("other", min_clearance_mm=8.0)
    assert sentences([one, other])[0] == (
        "one and other take the same time (4 s). Worse in one: load of the operators 4 instead of 3 s. "
        "Worse in other: smallest clearance 8.0 instead of 12.0 mm."
    )


def test_a_tie_in_everything_is_said_to_be_one() -> None:
    assert sentences([variant("one"), variant("other")])[0] == (
        "one and other take the same time (4 s), and each load, peak, margin and clearance is the same."
    )


def test_moves_that_a_program_leaves_out_weaken_the_claim() -> None:
    left_out = {"not_in_program": ["moves to and from home"]}
    slower, *_, note = sentences([variant("fast"), variant("slow", cycle_time_s=8.0, **left_out)])
    assert slower.startswith("fast is at least 2 times as fast as slow (4 s and 8 s)")
    assert note == "Without moves that no program holds, such as those to and from the homes: slow."
    faster, *_ = sentences([variant("fast", **left_out), variant("slow", cycle_time_s=8.0)])
    assert faster.startswith("fast is faster than slow (4 s and 8 s), but its program leaves moves out")
    assert "times" not in faster


def test_what_fails_is_named_with_its_first_check_and_still_has_a_load() -> None:
    failed = {"failed": ["work-1: joint B2 is beyond"], "failed_checks": 1}
    bad = variant("bad", status="failed", reason="joint B2 is beyond", operator_load_s=7.0, **failed)
    texts = sentences([variant("good"), bad, without_motion("none", "no_solution"), without_motion("odd", "bad_input")])
    assert texts[:4] == [
        "Only good passes every check: 4 s.",
        "bad fails 1 check, first: work-1: joint B2 is beyond.",
        "none has no solution: kuka: no start posture.",
        "odd is no valid cell: kuka: no start posture.",
    ]
    assert "Load of the operators, most first: bad 7 s, good 3 s." in texts


def test_nothing_pays_where_nothing_passes() -> None:
    first, *others = sentences([without_motion("one", "no_solution"), without_motion("other", "no_solution")])
    assert first == "None of them passes every check: there is nothing to choose from."
    assert len(others) == 2


def test_figures_that_are_not_known_are_no_costs() -> None:
    first, *_ = sentences([variant("fast", min_clearance_mm=None), variant("slow", cycle_time_s=8.0)])
    assert "clearance" not in first.split(";")[-1].split(", and")[0]


def test_a_run_that_was_not_verified_again_is_named() -> None:
    texts = sentences([variant("one"), variant("run", proof="name the cell file with --cell")])
    assert texts[-1] == "run was not verified again: name the cell file with --cell."
