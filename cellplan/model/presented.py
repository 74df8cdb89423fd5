"""What all results can do: become pandas frames, and show themselves in a notebook.

Results know nothing of pages and frames: both methods hand over to the public functions of the package, which find the
tables of a result and its page.
"""

from typing import TYPE_CHECKING

import cellplan

if TYPE_CHECKING:
    import pandas as pd


class Presented:
    """A result that becomes pandas frames and that notebooks show."""

    __slots__ = ()

    def to_frame(self, table: str | None = None) -> "pd.DataFrame":
        """One of its tables as a pandas frame, with units in the names of the columns; see ``cellplan.to_frame``.

        Args:
            table: Name of the table; None for the first one. ``cellplan.tables`` lists the names.

        Raises:
            InputError: It has no such table.
            MissingPackageError: pandas is not installed.
        """
        return cellplan.to_frame(self, table)

    def _repr_html_(self) -> str:
        """What a notebook shows of it: a page without scripts; see ``cellplan.to_html``."""
        return cellplan.to_html(self)
