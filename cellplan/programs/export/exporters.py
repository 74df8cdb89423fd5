"""Exporters: all formats by name, with the tables of all robots among them, and what each can do whatever the run."""

from collections import ChainMap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from cellplan.errors import InputError
from cellplan.files.input.findings import did_you_mean, listed
from cellplan.model.motion.motion import JointTable
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.programs.dialects import DIALECTS, ESCAPES
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.export.choice import Choice
from cellplan.programs.formats.csv import DECIMALS as CSV_DECIMALS
from cellplan.programs.wide_table import read_wide_tables, render_wide_tables

ALL: Final = "all"  # instead of the name of a format: every one that can take the run


@dataclass(frozen=True, slots=True, kw_only=True)
class Exporter:
    """A format that is no program of single robots: it is made from all of a run."""

    render: Callable[[VerifiedRun], dict[str, str]]  # text of every file of a run, by its path in the folder
    # what a reader of its own finds in these files: the tables of each motion, by robot
    read: Callable[[VerifiedRun, Mapping[str, str]], tuple[dict[str, JointTable], ...]]
    decimals: int  # of a second, degree or millimetre in these files


TABLES: Final[dict[str, Exporter]] = {
    "wide": Exporter(render=render_wide_tables, read=read_wide_tables, decimals=CSV_DECIMALS),
}
EXPORTERS: Final[Mapping[str, Dialect | Exporter]] = ChainMap(TABLES, DIALECTS)  # type: ignore[arg-type]


def require_format(name: str, *, option: str = "--format") -> None:
    """Refuse a format that does not exist; messages name the option that it belongs to."""
    if name not in EXPORTERS:
        hint = did_you_mean(name, EXPORTERS)
        raise InputError(f"{option}: expected one of {listed(EXPORTERS)}, got '{name}'{hint}")


def exporter_of(form: str, choice: Choice) -> Dialect | Exporter:
    """What writes and reads a format as it is chosen; ``InputError`` where it has no step registers."""
    dialect = EXPORTERS[form]
    if not choice.steps:
        return dialect
    if form not in ESCAPES or not isinstance(dialect, Dialect):
        raise InputError(f"--escape: expected one of the formats {listed(ESCAPES)}, got {form}")
    from cellplan.programs.elements.escapes import with_register

    return with_register(dialect, ESCAPES[form])


def refuse_choice(form: str, choice: Choice) -> None:
    """Refuse what a format cannot do whatever the run; call it early, before any long work."""
    dialect = exporter_of(form, choice)
    if isinstance(dialect, Dialect):
        choice.refuse_for(dialect)
    elif choice != Choice():
        raise InputError(f"--format: expected no choice of robots, rows or targets with {form}, a table of all robots")


def formats_for(texts: Sequence[str]) -> list[str]:
    """Formats in texts of ``--for`` such as ``rapid,krl``, each once."""
    names = list(dict.fromkeys(name.strip() for text in texts for name in text.split(",")))
    for name in names:
        require_format(name, option="--for")
    return names


def chosen_formats(formats: Sequence[str]) -> dict[str, bool]:
    """Formats that are meant, ``all`` for every one, and whether each was asked for by its name; at least one."""
    if not formats:
        raise InputError(f"--format: expected {ALL}, or one or more of {listed(EXPORTERS)}, got none")
    for name in formats:
        if name != ALL:
            require_format(name)
    every = list(EXPORTERS) if ALL in formats else []
    return {name: name in formats for name in dict.fromkeys([*formats, *every]) if name != ALL}
