"""Frames of a floor plan to type into the pendants of the makers, as values and as lines of text."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from cellplan.geometry.arrays import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlanFrame:
    """A frame as it is typed."""

    name: str  # what its controller calls it
    seen_from: str  # in what it is given
    numbers: tuple[str, ...]  # its numbers as they are typed; none where there is no such frame
    purpose: str  # what it is for
    X_W: Array | None = None  # a fixed one of the part in the world, in [m]; None for any other


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlanPendant:
    """The frames of one robot."""

    robot: str
    title: str  # the robot, its controller and the units of the numbers
    labels: tuple[str, ...]  # of the numbers
    frames: tuple[PlanFrame, ...]
    remarks: tuple[str, ...]  # what to know of the numbers

    @property
    def record(self) -> dict[str, Any]:
        """All of it as plain values; numbers as they are typed."""
        frames = [
            {
                "name": frame.name,
                "in": frame.seen_from,
                "numbers": dict(zip(self.labels, frame.numbers, strict=False)),
                "for": frame.purpose,
            }
            for frame in self.frames
        ]
        return {"robot": self.robot, "title": self.title, "frames": frames, "remarks": list(self.remarks)}


def pendant_lines(pendants: Sequence[PlanPendant]) -> Iterator[str]:
    """All frames as text: a block for each robot, its frames in aligned columns."""
    for pendant in pendants:
        yield pendant.title
        texts = [frame.numbers or ("-",) * len(pendant.labels) for frame in pendant.frames]
        widths = [max(map(len, column)) for column in zip(*texts, strict=True)]
        starts = [f"{frame.name} in {frame.seen_from}" for frame in pendant.frames]
        for start, numbers, frame in zip(starts, texts, pendant.frames, strict=True):
            cells = zip(pendant.labels, numbers, widths, strict=True)
            row = "  ".join(f"{label} {number:>{width}}" for label, number, width in cells)
            yield f"  {start.ljust(max(map(len, starts)))}  {row}  {frame.purpose}"
        yield from (f"  {remark}" for remark in pendant.remarks)
