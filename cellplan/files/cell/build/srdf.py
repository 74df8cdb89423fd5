"""SRDFs of the robots of a cell: pairs that they disable, and start postures and homes that are named by them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from cellplan.errors import InputError
from cellplan.files.cell.referenced_files import Sources
from cellplan.files.cell.write import in_file_units
from cellplan.files.input.findings import unknown_name
from cellplan.files.schema.partial import ValidEntries
from cellplan.files.schema.robot import POSITION_WORDS, RobotEntry
from cellplan.files.yaml.reader import YamlDocument
from cellplan.geometry.transforms import Array
from cellplan.model.robot.robot import RobotModel, start_keys
from cellplan.model.settings.units import Deg, Mm

if TYPE_CHECKING:  # read only for a cell that names an SRDF
    from cellplan.files.robots.urdf.srdf import Srdf

AUTO: Final = "auto"


def apply_srdfs(
    valid: ValidEntries, models: Mapping[str, RobotModel], sources: Sources, document: YamlDocument
) -> tuple[ValidEntries, dict[str, RobotModel]]:
    """The entries with named configurations written out, and the models with the pairs that their SRDFs disable.

    What is wrong with an SRDF, or with a name, is added to the findings of the sources, and what says nothing to their
    remarks.
    """
    read_models, robots = dict(models), dict(valid.robots)
    for name, model in models.items():
        entry = valid.robots[name]
        srdf = None if entry.srdf is None else sources.srdf(name, entry.srdf, entry)
        try:
            if srdf is not None:
                from cellplan.files.robots.urdf.srdf import disabled_bodies, unknown_links

                read_models[name] = replace(model, disabled=disabled_bodies(srdf, model))
                remark = unknown_links(srdf, model)
                sources.remarks += [(f"robots.{name}.srdf", remark)] if remark else []
        except InputError as error:
            sources.errors.append(error)
        if entry.srdf is None or srdf is not None:
            robots[name] = _Configurations(name, model, srdf, sources, document).written_out(entry)
    whole = valid.whole
    if whole is not None:
        whole = whole.model_copy(
            update={"robots": {name: robots.get(name, whole.robots[name]) for name in whole.robots}}
        )
    return replace(valid, robots=robots, whole=whole), read_models


@dataclass(frozen=True, slots=True)
class _Configurations:
    """Named configurations of one robot."""

    name: str
    model: RobotModel
    srdf: "Srdf | None"
    sources: Sources
    document: YamlDocument

    def written_out(self, entry: RobotEntry) -> RobotEntry:
        """The entry with positions in place of names; a name that means none stays, after a finding."""
        written = {"start": entry.start, "home": entry.home}
        rail = entry.mount.rail if entry.mount is not None else None
        added = () if rail is None else (rail.name,)
        positions = {key: self._positions(key, word, added) for key, word in written.items() if isinstance(word, str)}
        return entry.model_copy(update={key: value for key, value in positions.items() if value is not None})

    def _positions(self, key: str, word: str, added: tuple[str, ...]) -> dict[str, float] | None:
        """Positions of a configuration by joint, in the units of a cell file; None for ``auto`` and after a finding."""
        if word == AUTO:
            return None
        path = ("robots", self.name, key)
        if self.srdf is None:
            text = f"expected {POSITION_WORDS}, got '{word}' without the key srdf"
            self.sources.findings.append(self.document.finding(path, text))
            return None
        from cellplan.files.robots.urdf.srdf import configuration_of

        try:
            q = configuration_of(self.srdf, word, self.model, added=added)
        except InputError as error:
            self.sources.errors.append(error)
            return None
        if q is None:
            text = unknown_name(f"a configuration of {self.srdf.file}", word, self.srdf.configuration_names)
            self.sources.findings.append(self.document.finding(path, text))
            return None
        return dict(zip(start_keys(self.model), _within_limits(self.model, q), strict=True))


def _within_limits(model: RobotModel, q: Array) -> list[float]:
    """Degrees and millimetres that do not read back outside the limits that a configuration is within."""
    numbers = in_file_units(model, q)
    for index, joint in enumerate(model.joints):
        unit = Deg if joint.is_revolute else Mm
        while unit(numbers[index]).si > joint.upper:
            numbers[index] = float(np.nextafter(numbers[index], -np.inf))
        while unit(numbers[index]).si < joint.lower:
            numbers[index] = float(np.nextafter(numbers[index], np.inf))
    return numbers
