"""Contacts: what touches from when to when, what of it is allowed, and the verdict on each pair."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.report import Check, ClearanceClass, Contact
from cellplan.scene.pairs import Rule
from cellplan.scene.survey import Survey

SAME_CONTACT: Final = 0.010  # [s] touches with shorter breaks between them are one contact
MM: Final = 1e3
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
    """Pairs that could neither be proved to be free nor found to touch."""
    return [row for row, found in enumerate(survey.found) if found.unproved]


def seconds(times: Array, instants: Array) -> Array:
    """Instants in [s] from instants counted in samples."""
    found: Array = np.interp(instants, np.arange(len(times)), times)
    return found


def collision_checks(
    survey: Survey, contacts: Sequence[Contact], times: Array, *, kind: ClearanceClass, open_rows: Sequence[int]
) -> list[Check]:
    """One failed check for each pair of a class that touches or is not certified, or one passed check for the class."""
    own: dict[tuple[str, str], list[Contact]] = {}
    for contact in contacts:
        if contact.clearance_class is kind and not contact.is_allowed:
            own.setdefault(contact.pair, []).append(contact)
    checks = [_pair_collision(pair, found) for pair, found in own.items()]
    own_rows = [row for row in open_rows if survey.scene.pairs[row].clearance_class is kind]
    checks += [_not_certified(survey, times, row) for row in own_rows]
    if checks:
        return checks
    message = f"collision: none in class {kind}, certified between the samples"
    return [_collision(str(kind), passed=True, length_s=0.0, at_s=None, message=message)]


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
    """The failed check of a pair that may touch: nothing was found, and nothing proved."""
    first, second = survey.scene.names(survey.scene.pairs[row])
    unproved = survey.found[row].unproved
    at_s = float(seconds(times, np.array([min(unproved)]))[0])
    more = f" and at {len(unproved) - 1} more instants" if len(unproved) > 1 else ""
    return _collision(
        f"{first} - {second}",
        passed=False,
        length_s=0.0,
        at_s=at_s,
        message=f"not certified: {first} and {second} come so near at {at_s:.3f} s{more} that no contact was found and "
        "none could be ruled out: keep them farther apart",
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
