"""Where each line of the page stands in its paper, and its figures as numbers, for the record of all lines."""

from dataclasses import dataclass
from typing import Any

from reproduction.pages import NICOLATO, RIBEIRO, VARGAS, pages_of
from reproduction.runs import Numbers
from reproduction.verdicts import ALONE, Row

PAPERS = {"vargas": VARGAS, "nicolato": NICOLATO, "ribeiro": RIBEIRO}


@dataclass(frozen=True, kw_only=True)
class Source:
    """Place of a line in its paper.

    Attributes:
        where: Figure, equation, table or section.
        published: The printed number, or the bound that the text states; None for a claim in words.
        unit: Unit of both numbers.
        ours: Path of our number in the record of measurements; empty where the line compares several.
        scale: What our number is multiplied by to come in that unit.
        at_s: Printed instant in [s].
        ours_at: Path of our instant in the record; empty where there is none.
    """

    where: str
    published: float | None = None
    unit: str = ""
    ours: str = ""
    scale: float = 1.0
    at_s: float | None = None
    ours_at: str = ""


def paper_of(table: str) -> str:
    """The paper that a table of the page is about."""
    return PAPERS[table.partition("_")[0]]


def said(where: str) -> Source:
    """A claim in words."""
    return Source(where=where)


def number(where: str, published: float | None, unit: str, ours: str, **words: Any) -> Source:
    """A claim with a number."""
    return Source(where=where, published=published, unit=unit, ours=ours, **words)


NOWHERE = said("-")  # ours alone


def line_record(table: str, row: Row, source: Source, numbers: Numbers) -> Numbers:
    """One line of the page for machines."""
    ours = value(numbers, source.ours) * source.scale if source.ours else None
    paper = paper_of(table)
    return {
        "paper": paper,
        "table": table,
        "quantity": row.what,
        "where": source.where,
        "pages": pages_of(paper, source.where),
        "published": source.published,
        "published_text": row.published,
        "ours": None if ours is None else float(f"{ours:.6g}"),
        "ours_text": row.ours,
        "unit": source.unit,
        "published_at_s": source.at_s,
        "ours_at_s": value(numbers, source.ours_at) if source.ours_at else None,
        "difference": row.difference,
        "verdict": row.verdict.strip("*"),
    }


def source_of(sources: dict[str, dict[str, Source]], table: str, row: Row) -> Source:
    """The source of a line; a line of ours alone needs none.

    Raises:
        KeyError: A line claims that something was published and no source names the place.
    """
    return sources.get(table, {}).get(row.what, NOWHERE) if row.verdict == ALONE else sources[table][row.what]


def value(numbers: Numbers, path: str) -> float:
    """One number of the record of measurements."""
    result: Any = numbers
    for name in path.split("."):
        result = result[int(name)] if isinstance(result, list) else result[name]
    return float(result)
