"""Distances in the record of a run: minima, contacts, exclusions, closest pairs, and the evidence for them."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Annotated, Any, Final, TypedDict

from cellplan.model.report.left_out import LeftOut
from cellplan.model.report.report import ASSUMPTION, MARGIN, ClearanceClass, ClearanceMinimum, ClearanceReport
from cellplan.model.units import MM
from cellplan.report.record.common import Number, number

# what each class is called
CLASSES: Final = {"robot_robot": "robot to robot", "part": "part", "self": "own bodies", "environment": "surroundings"}

Contact = TypedDict(
    "Contact",
    {
        "pair": Annotated[list[str], "the two bodies"],
        "class": Annotated[str, "`robot_robot`, `self`, `part` or `environment`"],
        "first_s": Annotated[Number, "start of the contact"],
        "last_s": Annotated[Number, "end of the contact"],
        "allowed": Annotated[bool, "whether the contact is permitted"],
        "reason": Annotated[str, "the reason"],
    },
)
Contact.__doc__ = "An interval in which two bodies are in contact."
ClosestPair = TypedDict(
    "ClosestPair",
    {
        "pair": Annotated[list[str], "the two bodies"],
        "class": Annotated[str, "`robot_robot`, `self`, `part` or `environment`"],
        "distance_mm": Annotated[Number, "smallest distance, never above the true one"],
        "at_s": Annotated[Number, "its time"],
    },
)
ClosestPair.__doc__ = "One of the ten closest pairs that must keep `checks.clearance_mm`."


class MinimumRecord(TypedDict):
    """Smallest distance of a class of pairs over the whole motion."""

    minimum_mm: Annotated[Number, "smallest distance, never above the true one; 0 in contact; null without a pair"]
    pair: Annotated[list[str] | None, "the two bodies"]
    at_s: Annotated[Number, "its time"]
    certified: Annotated[
        bool,
        "whether it is proved, also between the samples, that nothing touches and that the clearance holds (or not)",
    ]
    exact: Annotated[bool, "whether the true distance exceeds `minimum_mm` by at most 0.1 mm; else a lower bound"]
    points_mm: Annotated[list[list[Number]] | None, "nearest points of the two bodies in the world; null in contact"]
    accuracies_mm: Annotated[
        list[Number] | None, "accuracy of the two bodies, each null if it is not stated; null without a pair"
    ]


class ExclusionRecord(TypedDict):
    """A pair with reduced requirements."""

    pair: Annotated[list[str], "the two bodies"]
    reason: Annotated[str, "the reason"]


class ProofRecord(TypedDict):
    """Evidence for the distances between the samples."""

    assumption: Annotated[str, "motion of the joints assumed between the samples"]
    margin: Annotated[str, "effects that the required clearance must cover as well"]
    not_certified: Annotated[
        list[list[str]], "pairs with neither proof nor counterexample of the clearance; each fails a check `clearance`"
    ]
    distance_queries: Annotated[int, "number of distance queries to the collision engine"]
    contact_queries: Annotated[int, "number of contact queries to the collision engine"]
    cut_steps: Annotated[int, "number of steps between samples that were subdivided"]


class LeftOutRecord(TypedDict):
    """A pair that was not judged in full."""

    kind: Annotated[
        str, "`excluded`, `srdf`, `grip`, `mounted`, `standing`, `at_work`, `contact_only`, `environment` or `no_body`"
    ]
    bodies: Annotated[list[str], "the bodies"]
    reason: Annotated[str, "the reason"]


def clearance_record(minima: Mapping[ClearanceClass, ClearanceMinimum]) -> dict[str, MinimumRecord]:
    """Smallest distance of the whole cell and of each class."""
    known = {minimum.pair: minimum.accuracies for minimum in minima.values() if minimum.pair is not None}
    order = (ClearanceClass.ROBOT_ROBOT, ClearanceClass.SELF, ClearanceClass.PART, ClearanceClass.ENVIRONMENT)
    shown = {"whole": smallest_minimum(minima), **{str(kind): minima.get(kind, ClearanceMinimum()) for kind in order}}
    return {
        name: _minimum_record(minimum, None if minimum.pair is None else known.get(minimum.pair))
        for name, minimum in shown.items()
    }


def smallest_minimum(minima: Mapping[ClearanceClass, ClearanceMinimum]) -> ClearanceMinimum:
    """The smallest of all classes, the first of those that are printed alike; it is certified if every class is."""
    measured = [minimum for minimum in minima.values() if minimum.minimum is not None]
    if not measured:
        return ClearanceMinimum()
    smallest = min(measured, key=lambda minimum: number(minimum.minimum) or 0.0)
    return replace(smallest, certified=all(minimum.certified for minimum in measured))


def _minimum_record(minimum: ClearanceMinimum, accuracies: tuple[float | None, float | None] | None) -> MinimumRecord:
    return {
        "minimum_mm": number(minimum.minimum, MM),
        "pair": list(minimum.pair) if minimum.pair else None,
        "at_s": number(minimum.at_s),
        "certified": minimum.certified,
        "exact": minimum.certified and minimum.exact,
        "points_mm": [[number(MM * x) for x in point] for point in minimum.points] if minimum.points else None,
        "accuracies_mm": None if accuracies is None else [number(value, MM) for value in accuracies],
    }


def contacts_record(clearance: ClearanceReport) -> list[Contact]:
    """All contacts with their intervals, permitted or not."""
    return [
        {
            "pair": list(contact.pair),
            "class": str(contact.clearance_class),
            "first_s": number(contact.first_s),
            "last_s": number(contact.last_s),
            "allowed": contact.is_allowed,
            "reason": contact.reason,
        }
        for contact in clearance.contacts
    ]


def closest_pairs_record(clearance: ClearanceReport) -> list[ClosestPair]:
    """The closest pairs that must keep the required clearance, nearest first."""
    return [
        {
            "pair": list(close.pair),
            "class": str(close.clearance_class),
            "distance_mm": number(MM * close.distance),
            "at_s": number(close.at_s),
        }
        for close in clearance.closest
    ]


def clearance_proof_record(clearance: ClearanceReport) -> ProofRecord:
    """Assumption, pairs without a proof, and effort."""
    return {
        "assumption": ASSUMPTION,
        "margin": MARGIN,
        "not_certified": [list(pair) for pair in clearance.not_certified],
        "distance_queries": clearance.distance_queries,
        "contact_queries": clearance.contact_queries,
        "cut_steps": clearance.cut_steps,
    }


def left_out_record(left_out: Iterable[LeftOut]) -> list[LeftOutRecord]:
    """Everything that was not judged in full, except pairs of links in one robot's model."""
    return [{"kind": str(entry.kind), "bodies": list(entry.bodies), "reason": entry.reason} for entry in left_out]


def other_classes(record: Mapping[str, Any]) -> dict[str, Any]:
    """Minima of the classes that the smallest one of all does not belong to, by what each is called."""
    of_all = (record["whole"]["pair"], record["whole"]["minimum_mm"])
    minima = {words: record[kind] for kind, words in CLASSES.items() if kind in record}
    known = {words: minimum for words, minimum in minima.items() if minimum["minimum_mm"] is not None}
    return {words: minimum for words, minimum in known.items() if (minimum["pair"], minimum["minimum_mm"]) != of_all}
