"""Contacts: what touches from when to when, what of it is allowed, and the verdict on each pair."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cellplan.certify.survey import Survey
from cellplan.geometry.transforms import Array
from cellplan.model.report import Check, ClearanceClass, Contact
from cellplan.model.units import MM
from cellplan.scene.pairs import Rule

SAME_CONTACT: Final = 0.010  # [s] touches with shorter breaks between them are one contact
OUTSIDE_ZONE: Final = {
    Rule.PROCESS: "outside the contact zone of the tool at work",
    Rule.GRIP: "outside the contact zone of the grip",
}


def find_contacts(survey: Survey, times: Array) -> tuple[Contact, ...]:
    """All contacts: forbidden ones first, then those of tools at work.

    Args:
        survey: What was found.
        times: Instants of the samples in [s], shape (N,).
    """
    touched = [row for row, found in enumerate(survey.found) if found.touches]
    forbidden = [contact for row in touched for contact in _of_pair(survey, times, row)]
    return (*forbidden, *_at_work(survey, times))


def uncertified(survey: Survey) -> list[int]:
    """Pairs that were not found to touch or to come nearer than demanded, and could not be proved not to."""
    return [row for row in range(len(survey.found)) if _is_open(survey, row)]


def seconds(times: Array, instants: Array) -> Array:
    """Instants in [s] from instants counted in samples."""
    found: Array = np.interp(instants, np.arange(len(times)), times)
    return found


def collision_checks(
    survey: Survey, contacts: Sequence[Contact], times: Array, *, kind: ClearanceClass, open_rows: Sequence[int]
) -> list[Check]:
    """One failed check for each pair of a class that touches or is not certified; a passed one when none may touch."""
    own: dict[tuple[str, str], list[Contact]] = {}
    for contact in contacts:
        if contact.clearance_class is kind and not contact.is_allowed:
            own.setdefault(contact.pair, []).append(contact)
    checks = [_pair_collision(pair, found) for pair, found in own.items()]
    own_rows = [row for row in open_rows if survey.scene.pairs[row].clearance_class is kind]
    if not checks and all(survey.low[row].min() > 0.0 for row in own_rows):
        message = f"collision: none in class {kind}, certified between the samples"
        checks.append(_collision(str(kind), passed=True, length_s=0.0, at_s=None, message=message))
    return checks + [_not_certified(survey, times, row) for row in own_rows]


def _is_open(survey: Survey, row: int) -> bool:
    """Whether something was left unproved of a pair that matters for the verdict."""
    found = survey.found[row]
    return bool(found.unproved and not found.touches and survey.low[row].min() < found.needed)


def _of_pair(survey: Survey, times: Array, row: int) -> list[Contact]:
    """Contacts of one pair in the order of time."""
    pair = survey.scene.pairs[row]
    reason = OUTSIDE_ZONE.get(pair.rule, "")
    return [
        Contact(
            pair=survey.scene.names(pair),
            clearance_class=pair.clearance_class,
            first_s=first,
            last_s=last,
            is_allowed=False,
            reason=reason,
        )
        for first, last in _spans(seconds(times, np.unique(survey.found[row].touches)), times)
    ]


def _spans(touches: Array, times: Array) -> list[tuple[float, float]]:
    """First and last instant of each contact in [s], short breaks bridged."""
    longest_break = max(SAME_CONTACT, 1.5 * float(times[-1]) / max(1, len(times) - 1))
    ends = np.flatnonzero(np.diff(touches) > longest_break)
    first, last = np.append(0, ends + 1), np.append(ends, len(touches) - 1)
    return [(float(touches[a]), float(touches[b])) for a, b in zip(first, last, strict=True)]


def _at_work(survey: Survey, times: Array) -> list[Contact]:
    """Contacts of tools at work with the part: from the first touch to the last, whatever short breaks there are."""
    scene = survey.scene
    return [
        Contact(
            pair=scene.names(scene.pairs[row]),
            clearance_class=scene.pairs[row].clearance_class,
            first_s=float(times[first]),
            last_s=float(times[last]),
            is_allowed=True,
            reason=f"at work, within {MM * scene.cell.checks.contact_zone:g} mm of the tool tip",
        )
        for row, (first, last) in sorted(survey.at_surface.items())
    ]


def _pair_collision(pair: tuple[str, str], contacts: Sequence[Contact]) -> Check:
    """The failed check of one pair."""
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


def _not_certified(survey: Survey, times: Array, row: int) -> Check:
    """The failed check of a pair of which neither a contact was found nor the demanded distance proved."""
    first, second = survey.scene.names(survey.scene.pairs[row])
    found, proved = survey.found[row], MM * max(0.0, float(survey.low[row].min()))
    at_s = float(seconds(times, np.array([min(found.unproved)]))[0])
    others = len({int(at) for at in found.unproved}) - 1
    more = f" and in {others} more steps" if others else ""
    required = MM * found.demand
    smallest = f", the smallest distance found is {MM * found.distance:.2f} mm" if np.isfinite(found.distance) else ""
    what = f"{np.floor(10.0 * proved) / 10.0:.1f} mm are proved, required {required:.1f} mm"
    if not proved > 0.0:
        what = "no contact was found and none could be ruled out"
    return Check(
        name="clearance",
        subject=f"{first} - {second}",
        passed=False,
        value=proved,
        limit=required,
        unit="mm",
        at_s=at_s,
        message=f"not certified: {first} to {second} at {at_s:.3f} s{more}: {what}{smallest}; keep them farther apart "
        "or shorten motion.step_s",
    )


def _collision(subject: str, *, passed: bool, length_s: float, at_s: float | None, message: str) -> Check:
    """A check on contact; its value is the time spent in contact."""
    return Check(
        name="collision",
        subject=subject,
        passed=passed,
        value=length_s,
        limit=0.0,
        unit="s",
        at_s=at_s,
        message=message,
    )
