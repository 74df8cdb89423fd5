"""What a robot may carry: limits of axes that it does not have."""

from collections.abc import Iterator

from cellplan.files.input.findings import Finding, KeyPath, unknown_name
from cellplan.files.yaml.reader import YamlDocument
from cellplan.model.settings.robot import PayloadEntry


def payload_findings(
    path: KeyPath, entry: PayloadEntry | None, turning: tuple[str, ...], document: YamlDocument
) -> Iterator[Finding]:
    """Limits of axes belong to the last turning joints before the flange, named from the base on."""
    last = turning[-3:]
    for joint in entry.axes if entry is not None else ():
        if joint not in last:
            text = unknown_name("one of the last turning joints", joint, last)
            yield document.key_finding((*path, "axes", joint), text)
