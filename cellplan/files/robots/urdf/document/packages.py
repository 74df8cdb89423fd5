"""Folders of packages, found without ROS: below those that the cell names, or above the file."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from cellplan.errors import InputError
from cellplan.files.input.files import AllowedFolders, read_regular_file
from cellplan.files.input.findings import listed, shown

LEVELS_UP: Final = 8  # folders above the file that are searched for a package
MANIFEST: Final = "package.xml"
MANIFEST_BYTES: Final = 1_000_000
PACKAGE_NAME: Final = re.compile(rb"<name>\s*([^<\s]+)\s*</name>")
LIKELY_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]*")


@dataclass(frozen=True, slots=True, kw_only=True)
class Packages:
    """Where packages are looked up, each name once."""

    folder: Path  # folder of the file that names them
    package_dirs: tuple[Path, ...] = ()  # folders that hold packages, or are one
    within: AllowedFolders | None = None  # folders that a package must lie in; None for all
    # by name of a package, its folders with the names that these state
    _known: dict[str, dict[Path, str]] = field(default_factory=dict, compare=False)

    def places(self, package: str, rest: str) -> tuple[list[Path], str | None]:
        """Where a file of a package lies or would lie, and a remark where no folder is the package beyond doubt.

        In each of ``package_dirs``, then in ``folder`` and those above it, the package is a folder below, or the folder
        itself, if its ``package.xml`` states the name or, where no folder does, if it is called so. Where there is
        none, a folder that belongs to no package counts if it contains the file, and is one of ``package_dirs`` or has
        the first part of the name for its own, as ``arm`` for ``arm_support``.

        Returns:
            Paths within the allowed folders, at least one, those of existing files first; and the remark or None.
        """
        if package not in self._known:
            self._known[package] = {folder: _stated_name(folder) for folder in self._named(package)}
        folders = self._known[package]
        stated = [folder for folder, name in folders.items() if name in ("", package)]
        places = [folder / rest for folder in stated or folders]
        if places:
            others = "" if stated else next(iter(folders.values()))
            remark = f"is read from a folder of that name, whose {MANIFEST} states {shown(others)}" if others else None
            return sorted(places, key=lambda place: not self._holds_file(place)), remark
        for root in self.roots:
            is_likely = root in self.package_dirs or package.startswith(f"{root.resolve().name or package}_")
            if is_likely and self._holds_file(root / rest) and not self._name_around(root):
                return [root / rest], f"no such package, read from the folder {shown(root.resolve().name)}"
        where = listed(dict.fromkeys(str(root.absolute()) for root in self.roots))
        cure = "name the folder that holds it in `package_dirs`"
        raise InputError(f"no package {shown(package)}, looked through {where}: {cure}")

    @property
    def roots(self) -> list[Path]:
        """Folders that are searched, in this order."""
        chains = [[start, *start.parents][: LEVELS_UP + 1] for start in (self.folder.absolute(), self.folder.resolve())]
        roots = [*self.package_dirs, *chains[0], *chains[1]]
        return [root for root in dict.fromkeys(roots) if self.within is None or self.within.holds(root)]

    def _named(self, package: str) -> Iterator[Path]:
        """Folders of a package that are recognised by its name."""
        if not LIKELY_NAME.fullmatch(package):
            raise InputError(f"expected the name of a package, got {shown(package)}")
        for root in self.roots:
            places = [root / package, root]
            if root in self.package_dirs:
                places += [manifest.parent for manifest in sorted(root.glob(f"*/{MANIFEST}"))]
            yield from (
                place for place in places if place.is_dir() and package in (_stated_name(place), place.resolve().name)
            )

    def _name_around(self, folder: Path) -> str:
        """Name of the package that a folder belongs to; empty for none."""
        above = [folder, *folder.resolve().parents][: LEVELS_UP + 1]
        inside = (folder for folder in above if self.within is None or self.within.holds(folder))
        return next(filter(None, map(_stated_name, inside)), "")

    def _holds_file(self, place: Path) -> bool:
        """Whether there is such a file, within the allowed folders."""
        return (self.within is None or self.within.holds(place)) and is_file(place)


def is_file(place: Path) -> bool:
    """Whether there is a file; false for names that the system cannot resolve."""
    try:
        return place.is_file()
    except (OSError, ValueError):
        return False


def _stated_name(folder: Path) -> str:
    """Name that the manifest in a folder states; empty for none."""
    try:
        stated = PACKAGE_NAME.search(read_regular_file(folder / MANIFEST, file=MANIFEST, limit=MANIFEST_BYTES))
    except InputError:
        return ""
    return stated[1].decode(errors="replace") if stated else ""
