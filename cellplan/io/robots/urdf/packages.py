"""Folders of packages, found without ROS: below those that the cell names, or above the file."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from cellplan.errors import InputError
from cellplan.io.input.allowed_folders import AllowedFolders
from cellplan.io.input.files import read_regular_file
from cellplan.io.input.findings import listed, shown

LEVELS_UP: Final = 8  # folders above the file that are searched for a package
MANIFEST: Final = "package.xml"
MANIFEST_BYTES: Final = 1_000_000
PACKAGE_NAME: Final = re.compile(rb"<name>\s*([^<\s]+)\s*</name>")
LIKELY_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]*")


@dataclass(frozen=True, slots=True, kw_only=True)
class Packages:
    """Where packages are looked up."""

    folder: Path  # folder of the file that names them
    package_dirs: tuple[Path, ...] = ()  # folders that hold packages, or are one
    within: AllowedFolders | None = None  # folders that a package must lie in; None for all

    def file(self, package: str, rest: str) -> tuple[Path, Path | None]:
        """A file of a package, and the folder that stands in for the package if none has its name.

        In each of ``package_dirs``, then in ``folder`` and those above it, the package is a folder below with its name,
        or the folder itself if its name or that in its ``package.xml`` is the right one. Where there is none, a folder
        of another name counts that contains the file.

        Raises:
            InputError: There is no such package.
        """
        found = self._named(package)
        if found is not None:
            return found / rest, None
        for root in self._roots():
            place = root / rest
            if (self.within is None or self.within.holds(place)) and place.is_file():
                return place, root
        where = listed(shown(each.name) for each in self.package_dirs)
        raise InputError(
            f"no package {shown(package)} in package_dirs ({where}) or above the file: "
            "name the folder that holds it in `package_dirs`"
        )

    def _named(self, package: str) -> Path | None:
        """Folder of a package that is recognised by its name; None for none."""
        if not LIKELY_NAME.fullmatch(package):
            raise InputError(f"expected the name of a package, got {shown(package)}")
        for root in self._roots():
            if (root / package).is_dir():
                return root / package
            if root.resolve().name == package or _manifest_name(root) == package:
                return root
            for manifest in sorted(root.glob(f"*/{MANIFEST}")) if root in self.package_dirs else ():
                if _manifest_name(manifest.parent) == package:
                    return manifest.parent
        return None

    def _roots(self) -> list[Path]:
        """Folders that are searched, in this order."""
        folder = self.folder.resolve()
        roots = [*self.package_dirs, *[folder, *folder.parents][: LEVELS_UP + 1]]
        return [root for root in dict.fromkeys(roots) if self.within is None or self.within.holds(root)]


def _manifest_name(folder: Path) -> str:
    """Name that the manifest in a folder states; empty for none."""
    try:
        found = PACKAGE_NAME.search(read_regular_file(folder / MANIFEST, file=MANIFEST, limit=MANIFEST_BYTES))
    except InputError:
        return ""
    return found[1].decode(errors="replace") if found else ""
