"""A map of a base as text: a line of counts, the best place, and the line to type."""

from pathlib import Path

from cellplan.report.record.common import Record


def map_lines(record: Record, folder: Path) -> list[str]:
    """All lines about a map.

    Args:
        record: As ``base_map`` returns it.
    """
    counts = record["counts"]
    others = ", ".join(
        f"{count} {verdict.replace('_', ' ')}" for verdict, count in counts.items() if verdict != "passes"
    )
    lines = [
        f"{record['cell']}, {record['robot']}: {counts['passes']} of {len(record['places'])} places pass; {others}"
    ]
    for each in record["best"][:1]:
        place = record["places"][each["place"]]
        figures, options = place["figures"], " ".join(f"--set '{option}'" for option in each["options"])
        margin = "no joint with limits"
        if figures["margin"] is not None:
            margin = f"margin {figures['margin']:.1f} {figures['margin_unit']} ({figures['margin_joint']})"
        lines += [
            f"  best: x {place['x_mm']:g} mm, y {place['y_mm']:g} mm: cycle {figures['cycle_s']:.3f} s, {margin}",
            f"  to solve it: {options}",
        ]
    outcomes = [each["certified"] for each in record["best"] if each["certified"] is not None]
    for each, outcome in zip(record["best"], outcomes, strict=False):
        place = record["places"][each["place"]]
        why = f": {outcome['reason']}" if outcome["reason"] else ""
        lines.append(f"  solved at x {place['x_mm']:g} mm, y {place['y_mm']:g} mm: {outcome['status']}{why}")
    return [*lines, f"map: {folder / 'map.html'}"]
