"""Results as pandas frames; pandas is imported only here."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from cellplan.errors import InputError, MissingPackageError
from cellplan.files.input.findings import did_you_mean, listed
from cellplan.jobs.present.result_tables import tables_of

if TYPE_CHECKING:
    import pandas as pd


def tables(result: object) -> tuple[str, ...]:
    """Names of the tables that ``to_frame`` makes of a result, the first one being its default.

    Args:
        result: What ``to_frame`` takes.

    Raises:
        InputError: It is no result that has tables.
    """
    return tuple(tables_of(result))


def to_frame(result: object, table: str | None = None) -> "pd.DataFrame":
    """One table of a result as a pandas frame: a row for each thing, units in the names of the columns.

    A column ``unit`` says what the numbers of a row are in where rows differ: joints turn or slide. Values are those of
    the files, unrounded; what has no value is NaN, or None among texts.

    Args:
        result: A ``Solution``, ``Report``, ``VerifiedRun``, ``Cell``, ``Screening``, ``LayoutResult``, ``Repair``,
            ``ShortestCycles``, the result of ``rehearse``; the record that ``sweep``, ``compare``, ``base_map``,
            ``map_study`` or a writer returns; or the ``Path`` of a run, of a study, or of one of their JSON files.
        table: Name of the table; None for the first one. ``tables`` lists the names.

    Raises:
        InputError: It is no result that has tables, or has no such table, or its files cannot be read.
        MissingPackageError: pandas is not installed.
    """
    tables = tables_of(result)
    name = next(iter(tables)) if table is None else table
    if name not in tables:
        hint = did_you_mean(name, tables)
        raise InputError(f"to_frame: expected one of the tables {listed(tables)}, got '{name}'{hint}")
    pandas = _pandas()
    return pandas.DataFrame({column: _tidy(values) for column, values in tables[name]().items()})


def _pandas() -> Any:
    """The package.

    Raises:
        MissingPackageError: It is not installed.
    """
    try:
        import pandas as pd
    except ImportError:
        raise MissingPackageError(
            "to_frame: expected the package pandas, which is not installed; run: pip install 'cellplan[frames]'"
        ) from None
    return pd


def _tidy(values: Any) -> Any:
    """Numbers with gaps as floating-point numbers, and everything else as it is."""
    if isinstance(values, np.ndarray):
        return values
    column: Sequence[Any] = list(values)
    is_number = all(
        value is None or (isinstance(value, int | float) and not isinstance(value, bool)) for value in column
    )
    if is_number and column and any(value is None for value in column):
        return np.array([np.nan if value is None else float(value) for value in column])
    return column
