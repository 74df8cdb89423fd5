"""Tiles of a map: places judged together in one trial of its study, as plain data on the way to and from it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
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
    judge_phases,
    verdicts_at_start,
)
from cellplan.study.trial import TrialOutcome, TrialStatus, Variant

SHARES: Final = 4  # [-] of which the number of tiles is a multiple, so that so many workers end together
PAIRS: Final = frozenset({"joint", "fast", "pair"})  # of names, lists in plain data


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tiles:
    """The places of a map that have starts within limits in all phases, in tiles that lie all over the map."""

    known: Sequence[PlaceVerdict]  # what is known of every place before its motions
    at_start: Sequence[Sequence[PlaceVerdict]]  # the same for each phase
    values: Sequence[Mapping[str, Any]]  # ``places`` and ``starts`` of each tile by phase, in order of trying

    @classmethod
    def of(cls, jobs: Sequence[MapJob], starts: Sequence[tuple[Array, Indices]]) -> Self:
        """The tiles of a map.

        Args:
            starts: For each phase starts of the robot, shape (S, n), as ``starts_at`` returns them, and their places.
        """
        at_start, inside = list[list[PlaceVerdict]](), list[tuple[Array, Indices]]()
        for phase, (job, (q, at)) in enumerate(zip(jobs, starts, strict=True)):
            verdicts, rows = verdicts_at_start(job, q, at)
            at_start.append([replace(verdict, phase=phase) for verdict in verdicts])
            inside.append((q[rows], at[rows]))
        can_begin = np.array([np.isin(np.arange(len(jobs[0].places)), at) for _, at in inside])
        places = np.flatnonzero(can_begin.all(axis=0))
        count = 1 if len(places) <= AT_ONCE // SHARES else SHARES * -(-len(places) // (SHARES * AT_ONCE))
        tiles = [places[tile::count] for tile in range(count)] if len(places) else []
        first = np.argmin(can_begin, axis=0).tolist()  # the first phase that cannot begin
        return cls(
            known=[at_start[phase][place] for place, phase in enumerate(first)],
            at_start=at_start,
            values=[{"phases": [_at_places(q, at, tile) for q, at in inside]} for tile in tiles],
        )

    def verdicts(self, trials: Iterable[Mapping[str, Any]]) -> list[PlaceVerdict]:
        """The verdict of every place, from the trials of all tiles as plain data, in their order."""
        verdicts = list(self.known)
        for trial in trials:
            judged = trial["figures"].get("places")
            if judged is None:
                for place in trial["values"]["phases"][0]["places"]:
                    verdicts[place] = PlaceVerdict(verdict=Verdict.NOT_JUDGED, reason=trial["reason"])
            for place, values in (judged or {}).items():
                verdict = _verdict(values)
                verdicts[int(place)] = verdict.or_better(self.at_start[verdict.phase][int(place)])
        return verdicts


def evaluate(request: MapRequest, variant: Variant) -> TrialOutcome:
    """Judge the places of a tile."""
    return judged(prepared_request(request).jobs, variant.values)


def judged(jobs: Sequence[MapJob], values: Mapping[str, Any]) -> TrialOutcome:
    """What becomes of the places of a tile, whose values are those of ``Tiles``."""
    starts = [(np.array(phase["starts"]), np.array(phase["places"], dtype=np.intp)) for phase in values["phases"]]
    verdicts = judge_phases(jobs, starts)
    listed = list(verdicts.values())
    figures: dict[str, Any] = {"places": {str(place): _plain(verdict) for place, verdict in sorted(verdicts.items())}}
    passing = best_first(listed)
    if not passing:
        return TrialOutcome(status=TrialStatus.FAILED, reason="no place passes", figures=figures)
    best = {"passing": len(passing), "cycle_s": listed[passing[0]].cycle}
    return TrialOutcome(status=TrialStatus.PASSED, figures={**best, **figures})


def _at_places(q: Array, at: Indices, places: Indices) -> dict[str, Any]:
    """The starts of some places as plain data."""
    rows = np.isin(at, places)
    return {"places": at[rows].tolist(), "starts": q[rows].tolist()}


def _plain(verdict: PlaceVerdict) -> dict[str, Any]:
    """A verdict as plain data, without what it does not have."""
    values = {field.name: getattr(verdict, field.name) for field in fields(verdict)}
    values["starts"] = [start.tolist() for start in verdict.starts] or None
    if verdict.start is not None:
        values["start"] = verdict.start.tolist()
    return {name: value for name, value in values.items() if value is not None and name != "reason"}


def _verdict(values: Mapping[str, Any]) -> PlaceVerdict:
    """The verdict of plain data."""
    fields_of_verdict: dict[str, Any] = {
        name: tuple(value) if name in PAIRS else value for name, value in values.items()
    }
    fields_of_verdict |= {
        "verdict": Verdict(values["verdict"]),
        "start": np.array(values["start"]),
        "starts": tuple(np.array(start) for start in values.get("starts", ())),
    }
    return PlaceVerdict(**fields_of_verdict)
