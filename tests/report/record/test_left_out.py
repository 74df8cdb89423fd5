"""What a report says of pairs that were not judged in full."""

from cellplan.model.report.left_out import LeftOut, LeftOutKind
from cellplan.report.record.sections.clearance import left_out_record
from cellplan.report.text.notes import grip_notes, left_out_notes


def test_each_pair_stands_in_the_record_with_kind_bodies_and_reason() -> None:
    result = left_out_record([LeftOut(LeftOutKind.GRIP, ("a/hand", "part"), "holds the part")])

    assert result == [{"kind": "grip", "bodies": ["a/hand", "part"], "reason": "holds the part"}]
    assert left_out_notes({"left_out": result}) == ["not checked in full, grip: a/hand - part (holds the part)"]


def test_a_record_without_any_says_so_and_one_that_is_silent_says_nothing() -> None:
    assert left_out_notes({"left_out": []}) == ["every pair was checked in full"]
    assert left_out_notes({}) == []


def test_grips_of_several_runs_are_reported_once() -> None:
    grip = {"name": "grip_depth", "value": 1.5, "message": "a/hand is 1.5 mm deep in part, allowed 2 mm"}

    assert grip_notes({"checks": [grip, {"name": "clearance", "message": "fine"}, grip]}) == [grip["message"]]


def test_grips_that_reach_into_nothing_are_not_reported_and_those_that_are_too_far_away_are() -> None:
    flush = {"name": "grip_depth", "value": 0.0, "message": "a/hand does not reach into part, allowed 2 mm"}
    away = {
        "name": "grip_depth",
        "value": -3.0,
        "message": "a/hand is 3 mm away from part: is the gripper open too far?",
    }

    assert grip_notes({"checks": [flush, away]}) == [away["message"]]
