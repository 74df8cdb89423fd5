"""Repair a failing cell: the remedies of ``cellplan repair``, each solved and verified, as values to set."""

from collections.abc import Mapping
from typing import Any, Final

from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.repair.record import RemedyRecord
from cellplan.jobs.repair.repair import repair as repaired
from cellplan.session.works.events import Send, progress_of
from cellplan.session.works.request import require_inputs

WORK: Final = "repair"


def repair(request: LayoutRequest, inputs: Mapping[str, str], *, send: Send) -> None:
    """Send the remedies of a cell, the smallest change first; none where it passes, or nothing helps.

    Args:
        request: The cell and its settings.
        inputs: Digests of the files that the cell was read from.
    """
    result = repaired(request, progress=progress_of(WORK, send))
    require_inputs(result.given, inputs)
    status = result.record["status"].replace("_", " ")
    remedies = [_remedy(remedy, result.given.origin.changes) for remedy in result.record["remedies"]]
    send({"event": "remedies", "work": WORK, "text": f"{result.given.name}: {status}", "remedies": remedies})


def _remedy(remedy: RemedyRecord, settings: Mapping[str, object]) -> dict[str, Any]:
    """A remedy with the values that it changes, in words and by address."""
    known = object()
    values = {it: value for it, value in remedy["settings"].items() if settings.get(it, known) != value}
    effects = [effect["text"] for effect in remedy["effects"]]
    figures = [f"cycle {remedy['cycle_s']:.3f} s", f"smallest margin {remedy['smallest_margin_deg']:.3g} deg"]
    return {"title": remedy["text"], "text": "; ".join([*effects, *figures]), "values": values}
