"""Contacts and required clearance: intervals of contact, permitted contacts, and the verdicts."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cellplan.certify.bound import Bound, PairBound
from cellplan.geometry.arrays import Array
from cellplan.model.report.report import Check, ClearanceClass, ClearanceMinimum, Contact
from cellplan.model.units import MM, rounded_down
from cellplan.scene.collision.distance import TIGHT_TOL
from cellplan.scene.pairs import Rule

MAX_BREAK: Final = 0.010  # [s] touches with shorter breaks between them are one contact
EXACT_TOL: Final = 1e-4 - 2.0 * TIGHT_TOL  # [m] a bound this near to a measured distance is exact to 0.1 mm
OUTSIDE_ZONE: Final = {
    Rule.PROCESS: "outside the contact zone of the tool at work",
    Rule.GRIP: "outside the contact zone of the grip",
}


def find_contacts(bound: Bound, times: Array) -> tuple[Contact, ...]:
    """All contacts: forbidden ones first, then those of tools at work.

    Args:
        times: Times of the samples in [s], shape (N,).
    """
    touching: dict[tuple[tuple[str, str], str], list[PairBound]] = {}
    for pair in bound.pairs:
        if pair.touches:
            reason = pair.pair.where or OUTSIDE_ZONE.get(pair.pair.rule, "")
            touching.setdefault((bound.names(pair), reason), []).append(pair)
    forbidden = [contact for key, pairs in touching.items() for contact in _of_pairs(*key, times, pairs)]
    return (*forbidden, *_at_work(bound, times))


def time_of(times: Array, at: float) -> float:
    """Time in [s] from one counted in samples."""
    return float(np.interp(at, np.arange(len(times)), times))


def collision_checks(bound: Bound, contacts: Sequence[Contact], times: Array, *, kind: ClearanceClass) -> list[Check]:
    """One failed check for each pair of a class that touches or is not certified; a passed one when none may touch."""
    by_pair: dict[tuple[str, str], list[Contact]] = {}
    for contact in contacts:
        if contact.clearance_class is kind and not contact.is_allowed:
            by_pair.setdefault(contact.pair, []).append(contact)
    checks = [_pair_collision(pair, contacts) for pair, contacts in by_pair.items()]
    open_pairs = [pair for pair in bound.of_class(kind) if pair.is_open]
    if not checks and all(pair.lowest > 0.0 for pair in open_pairs):
        message = f"collision: none in class {kind}, certified between the samples"
        checks.append(_collision(str(kind), passed=True, length_s=0.0, at_s=None, message=message))
    return checks + [_not_certified(bound, times, pair) for pair in open_pairs]


def clearance_check(bound: Bound, times: Array, kind: ClearanceClass, minimum: ClearanceMinimum) -> Check:
    """Whether every pair of a class keeps the demanded clearance; the check names the pair with the smallest margin.

    Where the accuracy of bodies is added to the demand, that is not always the pair that comes nearest.

    Args:
        times: Times of the samples in [s], shape (N,).
        minimum: Its smallest distance; zero where a pair touches.
    """
    checks, pairs = bound.scene.cell.checks, [pair for pair in bound.of_class(kind) if pair.is_compared]
    names, at_s, distance = minimum.pair or ("", ""), minimum.at_s or 0.0, float(minimum.minimum or 0.0)
    demand, reason, is_exact = checks.clearance_mm.si, "", minimum.exact
    if checks.adds_accuracy and distance > 0.0 and pairs:
        worst = min(pairs, key=lambda pair: pair.proved - pair.pair.demand)
        names, demand = bound.names(worst), worst.pair.demand
        at_s, distance = time_of(times, worst.at), worst.proved
        is_exact = worst.distance - distance <= EXACT_TOL
        added = demand - checks.clearance_mm.si
        reason = f" ({checks.clearance_mm:.1f} mm, and {MM * added:.1f} mm for the accuracy of both bodies)"
    passed = bool(distance >= demand)
    shown = rounded_down(MM * distance) if passed else np.floor(10.0 * MM * distance) / 10.0  # never as enough
    least = "" if is_exact else "at least "
    message = (
        f"clearance {kind}: {names[0]} to {names[1]} {least}{shown:.1f} mm at {at_s:.3f} s, "
        f"required {MM * demand:.1f} mm{reason}"
    )
    return Check("clearance", str(kind), passed, message, value=MM * distance, limit=MM * demand, unit="mm", at_s=at_s)


def _of_pairs(names: tuple[str, str], reason: str, times: Array, pairs: Sequence[PairBound]) -> list[Contact]:
    """Contacts of two bodies in the order of time, watched as one pair or as several, each on a part of the way."""
    rows = np.unique(np.concatenate([pair.touches for pair in pairs]))
    return [
        Contact(
            pair=names,
            clearance_class=pairs[0].pair.clearance_class,
            first_s=first,
            last_s=last,
            is_allowed=False,
            reason=reason,
        )
        for first, last in _spans(np.interp(rows, np.arange(len(times)), times), times)
    ]


def _spans(touches: Array, times: Array) -> list[tuple[float, float]]:
    """First and last time of each contact in [s], short breaks bridged."""
    longest_break = max(MAX_BREAK, 1.5 * float(times[-1]) / max(1, len(times) - 1))
    ends = np.flatnonzero(np.diff(touches) > longest_break)
    first, last = np.append(0, ends + 1), np.append(ends, len(touches) - 1)
    return [(float(touches[a]), float(touches[b])) for a, b in zip(first, last, strict=True)]


def _at_work(bound: Bound, times: Array) -> list[Contact]:
    """Contacts of tools at work with the part: from the first touch to the last, whatever short breaks there are."""
    zone = bound.scene.cell.checks.contact_zone_mm
    return [
        Contact(
            pair=bound.names(pair),
            clearance_class=pair.pair.clearance_class,
            first_s=float(times[pair.at_surface[0]]),
            last_s=float(times[pair.at_surface[1]]),
            is_allowed=True,
            reason=f"at work, within {zone:g} mm of the tool tip",
        )
        for pair in bound.pairs
        if pair.at_surface is not None
    ]


def _pair_collision(pair: tuple[str, str], contacts: Sequence[Contact]) -> Check:
    first = contacts[0]
    when = f"from {first.first_s:.3f} s to {first.last_s:.3f} s"
    if first.first_s == first.last_s:
        when = f"at {first.first_s:.3f} s"
    more = f" and {len(contacts) - 1} more times" if len(contacts) > 1 else ""
    where = f" {first.reason}" if first.reason else ""
    return _collision(
        f"{pair[0]} - {pair[1]}",
        passed=False,
        length_s=sum(contact.last_s - contact.first_s for contact in contacts),
        at_s=first.first_s,
        message=f"collision: {pair[0]} touches {pair[1]}{where} {when}{more}",
    )


def _not_certified(bound: Bound, times: Array, pair: PairBound) -> Check:
    """The failed check of a pair of which neither a contact was found nor the demanded distance proved."""
    first, second = bound.names(pair)
    proved, required, at_s = MM * max(0.0, pair.lowest), MM * pair.demand, time_of(times, min(pair.unproved))
    others = len({int(at) for at in pair.unproved}) - 1
    more = f" and in {others} more steps" if others else ""
    smallest = f", the smallest distance found is {MM * pair.distance:.2f} mm" if np.isfinite(pair.distance) else ""
    what = f"{np.floor(10.0 * proved) / 10.0:.1f} mm is proved, required {required:.1f} mm"
    if not proved > 0.0:
        what = "no contact was found, but none could be ruled out"
    message = (
        f"not certified: {first} to {second} at {at_s:.3f} s{more}: {what}{smallest}; keep them farther apart "
        "or shorten motion.step_s"
    )
    return Check("clearance", f"{first} - {second}", False, message, value=proved, limit=required, unit="mm", at_s=at_s)


def _collision(subject: str, *, passed: bool, length_s: float, at_s: float | None, message: str) -> Check:
    """A check on contact; its value is the time spent in contact."""
    return Check("collision", subject, passed, message, value=length_s, limit=0.0, unit="s", at_s=at_s)
