"""What a robot may carry: entries of a robot file or a cell become the model's data."""

from collections.abc import Iterator

from cellplan.io.input.findings import Finding, KeyPath, unknown_name
from cellplan.io.schema.robot import PayloadEntry
from cellplan.io.yaml.reader import YamlDocument
from cellplan.model.payload import AxisLimit, Payload
from cellplan.model.settings.units import si_or_none


def build_payload(entry: PayloadEntry | None) -> Payload | None:
    """What a robot may carry, in [kg], [m], [N m] and [kg m^2]."""
    if entry is None:
        return None
    return Payload(
        mass=entry.mass_kg,
        source=entry.source,
        along=si_or_none(entry.along_mm),
        across=si_or_none(entry.across_mm),
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
        turning: Names of the turning joints, from the base to the flange.
        document: The file.
    """
    last = turning[-3:]
    for joint in entry.axes if entry is not None else ():
        if joint not in last:
            text = unknown_name("one of the last turning joints", joint, last)
            yield document.key_finding((*path, "axes", joint), text)
