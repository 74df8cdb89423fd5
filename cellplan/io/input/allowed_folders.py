"""Where the files that a cell names may lie: below its own folder, or below one that the user allows."""

from dataclasses import dataclass
from pathlib import Path

from cellplan.errors import InputError
from cellplan.io.input.findings import shown


@dataclass(frozen=True, slots=True, kw_only=True)
class AllowedFolders:
    """Folder that names are relative to, and folders that they may lead into."""

    folder: Path  # folder of the file that names others
    allowed: tuple[Path, ...] = ()  # further folders, by leave of the user

    def file(self, written: str) -> Path:
        """Path of a file that exists within the allowed folders.

        Raises:
            InputError: With the reason only; the caller knows where the name stands.
        """
        path = self._within(written)
        if not _is(path, "is_file"):
            what = "a regular file, got a folder, a pipe or a device" if _is(path, "exists") else "an existing file"
            got = "" if "got" in what else f", got {shown(written)}"
            raise InputError(f"expected {what}{got}")
        return path

    def directory(self, written: str) -> Path:
        """Path of a folder that exists within the allowed folders.

        Raises:
            InputError: With the reason only; the caller knows where the name stands.
        """
        path = self._within(written)
        if not _is(path, "is_dir"):
            raise InputError(f"expected an existing folder, got {shown(written)}")
        return path

    def holds(self, path: Path) -> bool:
        """Whether a path, followed through all links, lies within the allowed folders."""
        try:
            real = path.resolve()
            return any(real.is_relative_to(root.resolve()) for root in (self.folder, *self.allowed))
        except (OSError, ValueError, RuntimeError):
            return False

    def _within(self, written: str) -> Path:
        """Path of a name, which must not lead out of the allowed folders."""
        path = self.folder / written
        if not self.holds(path):
            raise InputError(
                f"expected a path below the folder of the cell file, got {shown(written)}; "
                "allow other folders with --allow-dir"
            )
        return path


def _is(path: Path, question: str) -> bool:
    """Answer of the file system; no for names that it cannot resolve."""
    try:
        return bool(getattr(path, question)())
    except (OSError, ValueError):
        return False
