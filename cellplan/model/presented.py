"""What all results can do: become pandas frames, and show themselves in a notebook.

Results know nothing of frames and pages. Their presenter does: the package sets it when it is imported.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, slots=True, kw_only=True)
class Presenter:
    """How results are shown."""

    to_frame: "Callable[[object, str | None], pd.DataFrame]"  # a table of a result by its name, None for the first one
    to_html: Callable[[object], str]  # what a notebook shows of a result


class Presented:
    """A result that becomes pandas frames and that notebooks show."""

    __slots__ = ()
    presenter: ClassVar[Presenter]

    def to_frame(self, table: str | None = None) -> "pd.DataFrame":
        """One of its tables as a pandas frame, with units in the names of the columns; see ``cellplan.to_frame``.

        Args:
            table: Name of the table; None for the first one. ``cellplan.tables`` lists the names.

        Raises:
            InputError: It has no such table.
            MissingPackageError: pandas is not installed.
        """
        return self.presenter.to_frame(self, table)

    def _repr_html_(self) -> str:
        """What a notebook shows of it: a page without scripts; see ``cellplan.to_html``."""
        return self.presenter.to_html(self)
