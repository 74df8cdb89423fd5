"""What a robot may carry: entries of a robot file or a cell become the model's data."""

from collections.abc import Iterator

from cellplan.io.input.findings import Finding, KeyPath, did_you_mean, listed, shown
from cellplan.io.schema.robot import PayloadEntry
from cellplan.io.shapes import MM
from cellplan.io.yaml.reader import YamlDocument
from cellplan.model.payload import AxisLimit, Payload


def build_payload(entry: PayloadEntry | None) -> Payload | None:
    """What a robot may carry, in [kg], [m], [N m] and [kg m^2]."""
    if entry is None:
        return None
    return Payload(
        mass=entry.mass_kg,
        source=entry.source,
        along=None if entry.along_mm is None else entry.along_mm / MM,
        across=None if entry.across_mm is None else entry.across_mm / MM,
        axes=tuple(
            AxisLimit(joint=joint, moment=limit.moment_nm, inertia=limit.inertia_kg_m2)
            for joint, limit in entry.axes.items()
        ),
    )


def payload_findings(
    path: KeyPath, entry: PayloadEntry | None, turning: tuple[str, ...], document: YamlDocument
) -> Iterator[Finding]:
    """Limits of axes belong to the last turning joints before the flange.

    Args:
        path: Where the entry stands.
        entry: The entry.
        turning: Names of the turning joints, from the base to the flange.
        document: The file.
    """
    last = turning[-3:]
    for joint in entry.axes if entry is not None else ():
        if joint not in last:
            text = f"expected one of the last turning joints ({listed(last)}), got {shown(joint)}"
            yield document.key_finding((*path, "axes", joint), f"{text}{did_you_mean(joint, last)}")
