"""Pairs of bodies that are not checked for the full clearance, with the reasons."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final


class LeftOutKind(StrEnum):
    """Why less than the clearance is required; links of one robot that are joined or always touch are not listed."""

    EXCLUDED = "excluded"  # named under checks.exclude
    SRDF = "srdf"  # two links of one robot that its SRDF names
    GRIP = "grip"  # the part and what holds it
    MOUNTED = "mounted"  # fixed to each other
    STANDING = "standing"  # one stands on the other
    PUT_DOWN = "put_down"  # the part, and what grips it or what it lies on, while it is picked up or put down
    AT_WORK = "at_work"  # a tool that works on the part
    CONTACT_ONLY = "contact_only"  # no contact, but any distance
    ENVIRONMENT = "environment"  # things of the surroundings among themselves
    NO_BODY = "no_body"  # a robot that has no solids


TITLES: Final = {
    LeftOutKind.EXCLUDED: "excluded by the cell",
    LeftOutKind.SRDF: "disabled by the robot's SRDF",
    LeftOutKind.GRIP: "grip",
    LeftOutKind.MOUNTED: "mounted on each other",
    LeftOutKind.STANDING: "standing on each other",
    LeftOutKind.PUT_DOWN: "picked up or put down",
    LeftOutKind.AT_WORK: "at work",
    LeftOutKind.CONTACT_ONLY: "contact only",
    LeftOutKind.ENVIRONMENT: "surroundings",
    LeftOutKind.NO_BODY: "without bodies",
}
NOTHING_LEFT_OUT: Final = "every pair was checked in full"


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Bodies that were not judged in full against each other."""

    kind: LeftOutKind  # why
    bodies: tuple[str, ...]  # their names: a pair, all things of the surroundings, or a robot whose links have none
    reason: str  # what is demanded instead, as text


def left_out_lines(kinds: Iterable[tuple[str, tuple[str, ...], str]], *, most: int = 3) -> list[str]:
    """One line for each kind: its pairs with their reasons, each reason once; or that every pair was checked in full.

    At most ``most`` pairs are named for each reason; the others are counted.
    """
    grouped: dict[str, dict[str, list[str]]] = {}
    for kind, bodies, reason in kinds:
        grouped.setdefault(kind, {}).setdefault(reason, []).append(" - ".join(bodies))
    lines = []
    for kind in LeftOutKind:
        texts = [f"{_listed(pairs, most)} ({reason})" for reason, pairs in grouped.get(kind, {}).items()]
        if texts:
            lines.append(f"not checked in full, {TITLES[kind]}: {'; '.join(texts)}")
    return lines or [NOTHING_LEFT_OUT]


def _listed(pairs: list[str], most: int) -> str:
    """The first pairs, and how many more there are."""
    more = f" and {len(pairs) - most} more" if len(pairs) > most else ""
    return ", ".join(pairs[:most]) + more
