"""Tiles of a map: places judged together in one trial of its study, as plain data on the way to and from it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Final, Self

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.jobs.base_map.prepared import MapRequest, prepared_request
from cellplan.search.base_map.verdicts import (
    AT_ONCE,
    MapJob,
    PlaceVerdict,
    Verdict,
    best_first,
    judge,
    verdicts_at_start,
)
from cellplan.study.trial import TrialOutcome, TrialStatus, Variant

SHARES: Final = 4  # [-] of which the number of tiles is a multiple, so that so many workers end together
PAIRS: Final = frozenset({"joint", "fast", "pair"})  # of names, lists in plain data


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tiles:
    """The places of a map that have a start within limits, in tiles whose places lie all over the map."""

    known: Sequence[PlaceVerdict]  # what is known of every place before its motions
    values: Sequence[Mapping[str, Any]]  # ``places`` and ``starts`` of each tile, those of a place in order of trying

    @classmethod
    def of(cls, job: MapJob, q: Array, at: Indices) -> Self:
        """The tiles of a map.

        Args:
            q: Starts of the robot, shape (S, n), as ``starts_at`` returns them.
            at: Their places, shape (S,).
        """
        known, inside = verdicts_at_start(job, q, at)
        q, at = q[inside], at[inside]
        places, number = np.unique(at, return_inverse=True)
        count = 1 if len(places) <= AT_ONCE // SHARES else SHARES * -(-len(places) // (SHARES * AT_ONCE))
        rows = [np.flatnonzero(number % count == tile) for tile in range(count)] if len(places) else []
        return cls(known=known, values=[{"places": at[row].tolist(), "starts": q[row].tolist()} for row in rows])

    def verdicts(self, trials: Iterable[Mapping[str, Any]]) -> list[PlaceVerdict]:
        """The verdict of every place, from the trials of all tiles as plain data, in their order."""
        verdicts = list(self.known)
        for trial in trials:
            judged = trial["figures"].get("places")
            if judged is None:
                for place in trial["values"]["places"]:
                    verdicts[place] = PlaceVerdict(verdict=Verdict.NOT_JUDGED, reason=trial["reason"])
            for place, values in (judged or {}).items():
                verdicts[int(place)] = _verdict(values).or_better(verdicts[int(place)])
        return verdicts


def evaluate(request: MapRequest, variant: Variant) -> TrialOutcome:
    """Judge the places of a tile."""
    return judged(prepared_request(request).job, variant.values)


def judged(job: MapJob, values: Mapping[str, Any]) -> TrialOutcome:
    """What becomes of the places of a tile, whose values are those of ``Tiles``."""
    verdicts = judge(job, np.array(values["starts"]), np.array(values["places"], dtype=np.intp))
    listed = list(verdicts.values())
    figures: dict[str, Any] = {"places": {str(place): _plain(verdict) for place, verdict in sorted(verdicts.items())}}
    passing = best_first(listed)
    if not passing:
        return TrialOutcome(status=TrialStatus.FAILED, reason="no place passes", figures=figures)
    best = {"passing": len(passing), "cycle_s": listed[passing[0]].cycle}
    return TrialOutcome(status=TrialStatus.PASSED, figures={**best, **figures})


def _plain(verdict: PlaceVerdict) -> dict[str, Any]:
    """A verdict as plain data, without what it does not have."""
    values = {field.name: getattr(verdict, field.name) for field in fields(verdict)}
    if verdict.start is not None:
        values["start"] = verdict.start.tolist()
    return {name: value for name, value in values.items() if value is not None and name != "reason"}


def _verdict(values: Mapping[str, Any]) -> PlaceVerdict:
    """The verdict of plain data."""
    fields_of_verdict: dict[str, Any] = {
        name: tuple(value) if name in PAIRS else value for name, value in values.items()
    }
    fields_of_verdict |= {"verdict": Verdict(values["verdict"]), "start": np.array(values["start"])}
    return PlaceVerdict(**fields_of_verdict)
