"""Rules of smoothing: which files of paths have something to smooth, and what the tolerance leaves for it."""

from collections.abc import Iterator
from typing import Final

from cellplan.files.input.findings import Finding, KeyPath
from cellplan.files.schema.task import TaskEntry
from cellplan.files.yaml.reader import YamlDocument
from cellplan.model.task.task import ProgrammedPath, SampledPath, TimedPath

MOST_SMOOTHED: Final = 20_000  # points: a minute of work


def smooth_findings(
    name: str, task: TaskEntry, path: SampledPath | TimedPath, document: YamlDocument
) -> Iterator[Finding]:
    """What contradicts the smoothing of the path of a task, as it was read from its file."""
    smooth, place = task.path.smooth, ("tasks", name, "path", "smooth")
    if smooth is None:
        return
    if isinstance(path, TimedPath):
        yield document.key_finding(place, "unexpected key, a path with a column t_s is used as it stands in the file")
        return
    if not path.is_smooth and not isinstance(path, ProgrammedPath):
        text = "unexpected key beside csv.smooth: false, where the tool stops at every corner and corners stay"
        yield document.key_finding(place, text)
    if smooth.direction_deg is not None and path.tool_axes is None:
        text = f"expected tool axes in {path.source} to smooth: add columns i,j,k, or leave direction_deg out"
        yield document.finding((*place, "direction_deg"), text)
    if len(path.points) > MOST_SMOOTHED:
        text = f"expected at most {MOST_SMOOTHED} points to smooth, got {len(path.points)} in {path.source}"
        yield document.finding(place, f"{text}; leave points out with csv.join_mm, or smooth the file")
    yield from _tubes(task, document, place)


def _tubes(task: TaskEntry, document: YamlDocument, place: KeyPath) -> Iterator[Finding]:
    """A tube is narrower than each tolerance that the tracking error shares with it."""
    allowed = task.tolerance.filled
    pairs = {
        "position_mm": ("position_mm", "between_rows_mm"),
        "direction_deg": ("orientation_deg", "between_rows_deg"),
    }
    for key, tolerances in pairs.items():
        tube = getattr(task.path.smooth, key)
        tolerance = min(tolerances, key=lambda it: getattr(allowed, it))
        limit = getattr(allowed, tolerance)
        if tube is not None and tube >= limit:
            text = f"expected less than tolerance.{tolerance} = {limit:g}, shared with the tracking error, got {tube:g}"
            yield document.finding((*place, key), f"{text}; make it smaller, or the tolerance larger")
