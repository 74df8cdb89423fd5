"""Masses of links as a cell or a joint-axis table states them."""

from collections.abc import Iterator
from dataclasses import replace

from cellplan.files.input.findings import Finding, KeyPath, unknown_name
from cellplan.files.yaml.reader import YamlDocument
from cellplan.model.robot.inertia import LinkInertia, inertia_matrix, merged
from cellplan.model.robot.robot import Link, RobotModel
from cellplan.model.settings.robot import InertiasEntry, LinkInertiaEntry
from cellplan.model.settings.units import in_si


def with_inertias(model: RobotModel, entry: InertiasEntry | None) -> RobotModel:
    """The robot with the masses of an entry, those of links that move together as one."""
    if entry is None:
        return model
    links = {link.name: link for link in model.links}
    masses = merged(_inertia(links[name], it) for name, it in entry.links.items() if name in links)
    return replace(model, inertias=masses, inertia_source=entry.source)


def inertia_findings(
    path: KeyPath, entry: InertiasEntry | None, links: tuple[str, ...], document: YamlDocument
) -> Iterator[Finding]:
    """Masses belong to links that exist, by their names."""
    for name in entry.links if entry is not None else ():
        if name not in links:
            yield document.key_finding((*path, "links", name), unknown_name("a link of the robot", name, links))


def _inertia(link: Link, entry: LinkInertiaEntry) -> LinkInertia:
    X_BA = link.X_BL if entry.at is None else entry.at.matrix
    R = X_BA[:3, :3]
    return LinkInertia(
        link=link.index,
        mass=entry.mass_kg,
        centre_B=R @ in_si(entry.centre_mm) + X_BA[:3, 3],
        inertia_B=R @ inertia_matrix(entry.inertia_kg_m2) @ R.T,
    )
