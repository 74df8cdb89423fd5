"""Transfer reasons: why no transfer move was found, in one line: what was tried, and what was too close most often."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from cellplan.certify.certify import certify
from cellplan.geometry.arrays import Array
from cellplan.model.report.report import ClearanceClass
from cellplan.model.units import MM
from cellplan.planning.transfer.best_try import BlockedTransferError, Try, best_try, blocked_try
from cellplan.planning.transfer.query import TransferQuery
from cellplan.scene.scene import Scene

SHOWN: Final = 2  # pairs of bodies that are named


@dataclass(slots=True, kw_only=True, eq=False)
class Tried:
    """What one way of planning tried in vain."""

    legs: int = 0  # straight legs of several robots that were refused
    orders: int = 0  # orders of the robots
    searches: int = 0  # searches by trees that failed
    samples: int = 0  # configurations drawn in them
    reached: dict[str, tuple[int, int]] = field(default_factory=dict)  # configurations from start and goal, by robot
    refused: Counter[tuple[str, str]] = field(default_factory=Counter)  # how often pairs of bodies were too near
    uncertified: int = 0  # moves that were found but are not certified between their rows

    def failed(self, robot: str, samples: int, reached: tuple[int, int]) -> None:
        """Count a search that found no way."""
        self.searches += 1
        self.samples += samples
        self.reached[robot] = reached


def require_free_ends(query: TransferQuery) -> None:
    """Refuse a start or a goal at which two bodies keep less distance than is demanded."""
    for name, q in (("start", query.start), ("goal", query.goal)):
        at_rest = q[None].repeat(2, axis=0)
        if not certify(query.scene, at_rest, with_minimum=False).is_met:
            blocked = blocked_try(query.scene, Try(words=f"at its {name}", q=at_rest))
            raise BlockedTransferError(
                query.place,
                f"the {name} of the transfer move of {query.named} comes too close: {blocked.words}: let approach and "
                "retract leave more room, or move one of the two",
                blocked,
            )


def blocked_error(
    query: TransferQuery, tries: Sequence[Try], in_turn: Tried, in_time: Tried | None
) -> BlockedTransferError:
    """The error of a query for which no way was found; ``in_time`` is None where a single robot moves."""
    words = [f"straight, {nearest_words(query.scene, tries[0].q)[0]}"]
    name = "one robot after the other" if in_time is not None else "by trees in its joint space"
    words.append(f"{name}, {_tried_words(in_turn)}")
    refused = in_turn.refused
    if in_time is not None:
        words.append(f"all at once in joint space and time, {_tried_words(in_time)}")
        refused = refused + in_time.refused
    often = [f"'{a}' too close to '{b}' ({count} times)" for (a, b), count in refused.most_common(SHOWN)]
    most = f"; most often {' and '.join(often)}" if often else ""
    best = best_try(query.scene, tries)
    return BlockedTransferError(
        query.place,
        f"found no transfer move of {query.named}: at the best try ({best.tried.words}) {best.words}; tried were: "
        f"{'; '.join(words)}{most}: state via points of the task, give another home or start, move what is in the "
        "way, or lower the clearance",
        best,
    )


def _tried_words(tried: Tried) -> str:
    """What one way of planning tried."""
    words = []
    if tried.orders > 1:
        words.append(f"in {tried.orders} orders")
    if tried.searches:
        reached = [
            f"{a} reached from the start of '{name}' and {b} from its goal" for name, (a, b) in tried.reached.items()
        ]
        words.append(f"{tried.samples} configurations drawn ({', '.join(reached)})")
    if tried.uncertified:
        words.append(f"{tried.uncertified} found that could not be certified between their rows")
    return " ".join(words) or "a robot that stands blocks an end of the move"


def nearest_words(scene: Scene, q: Array) -> tuple[str, tuple[str, str]]:
    """Which pair falls short of its demand most over some rows, shape (K, nq), and by how much; and its names."""
    bound = certify(scene, q)
    pairs = [pair for kind in ClearanceClass for pair in bound.of_class(kind) if not pair.is_met]
    worst = min(pairs, key=lambda pair: (pair.proved - pair.demand, pair.row))
    first, second = bound.names(worst)
    held = "touches" if worst.touches else f"is {worst.proved * MM:.3g} mm from"
    demand = f", {worst.demand * MM:g} mm are demanded" if worst.keeps_clearance else ""
    return f"'{first}' {held} '{second}'{demand}", (first, second)
