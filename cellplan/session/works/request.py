"""What layout searches and repairs are asked for, from the cell file that is open."""

from collections.abc import Mapping

from cellplan.errors import InputError
from cellplan.jobs.layout.request import LayoutRequest
from cellplan.model.cell.cell import Cell
from cellplan.session.document import Document


def request_of(document: Document) -> tuple[LayoutRequest, Mapping[str, str]]:
    """The request for the cell as it is now, and the digests of the files that it was read from.

    Raises:
        InputError: The values do not go together.
    """
    settings = tuple(document.settings)
    request = LayoutRequest(cell=document.path, allow_dirs=document.allow_dirs, settings=settings)
    return request.anywhere, dict(document.cell.inputs)


def require_inputs(cell: Cell, inputs: Mapping[str, str]) -> None:
    """Refuse a cell whose files were saved since the session has read them: its values are meant for others.

    Raises:
        InputError: A file is another one.
    """
    if saved := next((name for name in {**cell.inputs, **inputs} if cell.inputs.get(name) != inputs.get(name)), None):
        raise InputError(f"{saved}: was saved by another program since it was read: decide about it first")
