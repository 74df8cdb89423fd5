"""What the rounds of a layout search try depends on the finished rounds alone."""

from pathlib import Path
from typing import Any

from cellplan import LayoutRequest
from cellplan.pipeline.layout.proposals import SIZE, Proposals, origin_text
from cellplan.study.trial import Outcome, Trial, TrialStatus, Variant

REQUEST = LayoutRequest(cell=Path("cell.yaml"))


def ended(number: int, cycle: float, status: TrialStatus = TrialStatus.PASSED) -> Trial:
    figures = {"cycle_s": cycle, "violation": 0.0, "x": [cycle], "start": [0.0]}
    return Trial(variant=Variant(number, {"kind": "given"}), outcome=Outcome(status=status, figures=figures))


def test_the_first_round_begins_with_the_given_layout_and_those_of_the_user() -> None:
    request = LayoutRequest(cell=Path("cell.yaml"), attempts=(Path("one.yaml"), Path("two.yaml")))

    kinds = [each["kind"] for each in Proposals(request=request)([])]

    assert kinds[:3] == ["given", "attempt", "attempt"]
    assert len(kinds) == SIZE


def test_every_combination_of_choices_is_tried_from_the_given_layout() -> None:
    choices = {"motion.mode": ["simultaneous", "part_at_rest"], "tasks.a.robot": ["one", "two", "three"]}
    proposals = Proposals(request=REQUEST, choices=choices)

    tried: list[dict[str, Any]] = []
    for _ in range(2):
        tried += proposals([ended(number, 1.0) for number in range(len(tried))])

    given = [tuple(each["choice"].values()) for each in tried if each["kind"] == "given"]
    assert sorted(given) == sorted(
        (mode, robot) for mode in choices["motion.mode"] for robot in choices["tasks.a.robot"]
    )
    assert len(tried) == 2 * SIZE


def test_later_rounds_go_on_from_the_best_trial_of_finished_rounds() -> None:
    finished = [ended(0, 2.0), ended(1, 1.0), ended(2, 0.5, TrialStatus.FAILED), ended(3, 3.0)]

    following = Proposals(request=REQUEST)(finished)

    assert (following[0]["kind"], following[0]["of"], following[0]["x"]) == ("perturbed", 1, [1.0])
    assert (following[1]["kind"], following[1]["of"]) == ("perturbed", None)
    assert {each.get("give_up_above_s") for each in following} == {1.25}
    assert Proposals(request=REQUEST)(finished) == following


def test_while_nothing_conforms_every_round_has_a_sample() -> None:
    failed = [ended(number, 2.0, TrialStatus.FAILED) for number in range(3 * SIZE)]

    rounds = [Proposals(request=REQUEST)(failed[: SIZE * count]) for count in (1, 2, 3)]

    assert ["sampled" in {each["kind"] for each in tried} for tried in rounds] == [True, True, True]
    assert not any("give_up_above_s" in each for tried in rounds for each in tried)


def test_a_rejected_trial_is_not_built_on() -> None:
    finished = [ended(0, 2.0), ended(1, 1.0), ended(2, 1.5), ended(3, 3.0)]

    following = Proposals(request=REQUEST, rejected=frozenset({1}))(finished)

    assert following[0]["of"] == 2


def test_the_beginning_of_a_trial_in_words() -> None:
    values = {"kind": "improved", "of": 3, "clearance_m": 0.01, "choice": {"motion.mode": "part_at_rest"}}

    assert origin_text(values) == "trial 3, 10 mm more clearance (motion.mode = part_at_rest)"
    assert origin_text({"kind": "perturbed", "of": None}) == "the given layout, perturbed"
