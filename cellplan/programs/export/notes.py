"""Notes for the head of exported files: what is promised, and what was found in them."""

from collections.abc import Iterator
from typing import Final

from cellplan.model.report.verified_run import VerifiedRun
from cellplan.programs.export.prepare import PreparedExport
from cellplan.programs.judgement.judge import Deviation, Judgement, largest_of
from cellplan.programs.promises.skew import skew_text

READ_BACK: Final = "read back by cellplan's own reader, not by the maker's controller"
NOISE: Final = 1e-6  # [deg] or [mm] deviations below it differ from processor to processor


def export_notes(run: VerifiedRun, prepared: PreparedExport, judgement: Judgement) -> tuple[str, ...]:
    """Notes for the head of every file, of any characters."""
    return tuple(_notes(run, prepared, judgement))


def _notes(run: VerifiedRun, prepared: PreparedExport, judgement: Judgement) -> Iterator[str]:
    promised = prepared.promised
    yield f"cell {run.cell.name}, format {prepared.dialect.name}"
    yield f"promise: {promised.promise}"
    yield from promised.reasons
    yield from promised.remarks
    yield from skew_lines(prepared)
    if prepared.orders:
        yield f"all robots of the cell wait at {sum(len(order.marks) for order in prepared.orders)} marks"
    if prepared.thinning is not None:
        yield f"rows left out within {prepared.thinning[0]:g} mm and {prepared.thinning[1]:g} deg"
    yield deviation_line(judgement)
    if prepared.dialect.is_rounded:
        yield rounding_line(prepared.job.blend, judgement)
    yield f"run {run.digest}"
    yield from (f"names {digest}" for digest in run.names.values())
    yield READ_BACK


def skew_lines(prepared: PreparedExport) -> Iterator[str]:
    """What the start skew may be."""
    if prepared.skew is not None:
        least = prepared.skew.least
        over = " over all phases and their ends" if prepared.job.frame.cell.program.is_home_to_home else ""
        yield f"allowed skew{over} {skew_text(least.allowed)}: '{least.first}' and '{least.second}', {least.reason}"


def deviation_line(judgement: Judgement) -> str:
    """The largest deviations of what is written from the run: of any joint in each unit, and of any tool."""
    largest = largest_of(judgement.deviations, lambda deviation: ("/" in deviation.subject, deviation.unit))
    return "largest deviation from the run: " + (", ".join(map(_deviation, largest)) or "none")


def rounding_line(blend: float, judgement: Judgement) -> str:
    """Which share of rows is rounded, and by how much the tools may be off for it."""
    if blend <= 0.0 or not judgement.rounded[0]:
        return "every row is a stop"
    most = {
        corner.unit: max(o.largest for o in judgement.corners if o.unit == corner.unit) for corner in judgement.corners
    }
    off = " and ".join(f"{largest:.2g} {unit}" for unit, largest in most.items()) or "nothing"
    rounded, count = judgement.rounded
    return (
        f"{rounded} of {count} rows rounded within {blend:g} of their segments or less: tools off by at most {off} more"
    )


def _deviation(deviation: Deviation) -> str:
    """A deviation with what deviates, unless it is nothing but rounding."""
    if deviation.largest < NOISE:
        return f"{'joints' if '/' in deviation.subject else 'tools'} below {NOISE:g} {deviation.unit}"
    where = f"at {deviation.at_s:.3f} s" + (f", in {deviation.phase}" if deviation.phase else "")
    return f"{deviation.subject} {deviation.largest:.2g} {deviation.unit} {where}"


def deviation_records(judgement: Judgement, *, of_corners: bool = False) -> list[dict[str, object]]:
    """All deviations as records; or by how much more tools may be off at rounded rows."""
    return [
        {
            "of": deviation.subject,
            "largest": deviation.largest,
            "unit": deviation.unit,
            "at_s": deviation.at_s,
            "phase": deviation.phase or None,
        }
        for deviation in (judgement.corners if of_corners else judgement.deviations)
    ]
