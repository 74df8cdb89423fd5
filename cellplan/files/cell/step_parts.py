"""Parts from STEP files, read in the child process; those that were read last are not read again."""

from collections.abc import Hashable
from pathlib import Path
from typing import Final

from cellplan.errors import InputError
from cellplan.files.cell.referenced_files import Sources
from cellplan.files.input.files import digest_of_file
from cellplan.files.input.findings import KeyPath, key_text
from cellplan.files.schema.partial import ValidEntries
from cellplan.files.schema.shapes import StepEntry
from cellplan.geometry.step.kernel import require_step
from cellplan.geometry.step.part import StepPart, read_step_part
from cellplan.geometry.step.reader import UnknownShapeError
from cellplan.guard import Guard, in_child

MEGABYTES: Final = 3000  # of which OpenCASCADE alone takes some hundreds
MOST_PARTS: Final = 8  # that this process holds
_PARTS: Final[dict[Hashable, StepPart]] = {}


def read_part(valid: ValidEntries, sources: Sources) -> StepPart | None:
    """The part of a cell from its STEP file, which becomes one of its sources; None without one or after a finding."""
    path: KeyPath = ("part", "step")
    entry = valid.part.step if valid.part is not None else None
    place = None if entry is None else sources.file(entry.file, (*path, "file"))
    if entry is None or place is None:
        return None
    try:
        part, sources.inputs[entry.file] = load_step_part(place, entry)
        sources.remarks.append((key_text(path), part.remark))
    except UnknownShapeError as error:
        sources.findings.append(sources.document.finding((*path, "shape"), str(error)))
    except InputError as error:
        sources.findings.append(sources.document.finding((*path, "file"), str(error)))
    else:
        return part
    return None


def load_step_part(place: Path, entry: StepEntry) -> tuple[StepPart, str]:
    """The part in a STEP file, and the SHA-256 of the file.

    Raises:
        InputError: The extra ``step`` is not installed, or the file cannot be read; see `read_step_part`.
    """
    require_step(entry.file)
    digest = digest_of_file(place, file=entry.file)
    key = (digest, *entry.model_dump().values())
    if key not in _PARTS:
        guard = Guard(file=entry.file, worker="the STEP reader", megabytes=MEGABYTES)
        part = in_child(read_step_part, place, entry.file, entry.shape, entry.deviation_mm.si, guard=guard)
        while len(_PARTS) >= MOST_PARTS:
            del _PARTS[next(iter(_PARTS))]
        _PARTS[key] = part
    return _PARTS[key], digest
