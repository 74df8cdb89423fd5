"""Bundle: the files of a study, which travel by content to workers that share no file system with it.

On a worker they stand below a folder of its own, under the paths that they have here. Paths in what a worker is sent
are persistent identifiers of its pickle, which each process resolves for itself.
"""

import io
import os
import pickle
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, Self

from cellplan.errors import StudyStoppedError
from cellplan.files.cell.user_folders import VARIABLE, user_folders
from cellplan.files.input.files import digest, read_regular_file
from cellplan.files.run.manifest import user_files
from cellplan.model.cell.cell import Cell

MAX_BYTES: Final = 2_000_000_000  # of one file
PACKAGE: Final = "package.xml"  # states the name of a package of robots, beside or above its files

_ROOTS: dict[str, TemporaryDirectory[str]] = {}  # of this process, by digest; removed when it ends


@dataclass(frozen=True, eq=False)
class Bundle:
    """Files with their content, by absolute path, and folders that are there even if they hold none of them."""

    files: Mapping[str, bytes]
    folders: tuple[str, ...] = ()

    @classmethod
    def of(
        cls, cells: Iterable[tuple[Path, Cell]], *, allow_dirs: Iterable[Path] = (), runs: Iterable[Path] = ()
    ) -> Self:
        """The files that cells are read from, and the whole of some run folders.

        Args:
            allow_dirs: Folders that the files may lie in, beside those of the cells and of the user.
        """
        paths = [path for run in runs for path in sorted(run.rglob("*")) if path.is_file()]
        folders = [*allow_dirs]
        for file, cell in cells:
            paths += [file, *(file.parent / name for name in user_files(cell.inputs, file.name))]
            folders += user_folders(file.parent)
        above = {folder / PACKAGE for path in paths for folder in Path(_place(path)).parents}
        paths += [path for path in sorted(above) if path.is_file()]
        content = {_place(path): read_regular_file(path, file=str(path), limit=MAX_BYTES) for path in paths}
        return cls(files=content, folders=tuple(map(_place, folders)))

    @cached_property
    def digest(self) -> str:
        """What the content is known by."""
        lines = [f"{name}\0{digest(content)}" for name, content in sorted(self.files.items())]
        return digest("\n".join([*lines, *self.folders]).encode())

    def root(self) -> str:
        """The folder below which the files stand in this process's file system; written at the first call.

        Raises:
            StudyStoppedError: They cannot be written.
        """
        if self.digest not in _ROOTS:
            try:
                root = TemporaryDirectory(prefix="cellplan-bundle-")
                for folder in self.folders:
                    Path(root.name + folder).mkdir(parents=True, exist_ok=True)
                for name, content in self.files.items():
                    path = Path(root.name + name)
                    path.parent.mkdir(parents=True, exist_ok=True)
                    path.write_bytes(content)
            except OSError as error:
                raise StudyStoppedError(f"the files of the study cannot be written on a worker: {error}") from None
            _ROOTS[self.digest] = root
        return _ROOTS[self.digest].name


def _place(path: Path) -> str:
    """Absolute path of a file or folder, without steps up."""
    return Path(os.path.normpath(path.absolute())).as_posix()


@contextmanager
def reading_below(root: str) -> Iterator[None]:
    """Read from the folder of a bundle, which holds only what the user allowed, while the ``with`` statement lasts.

    Args:
        root: The folder; empty for the files under their own paths.
    """
    before = os.environ.get(VARIABLE)
    if root:
        os.environ[VARIABLE] = root
    try:
        yield
    finally:
        if root:
            os.environ.pop(VARIABLE)
        if root and before is not None:
            os.environ[VARIABLE] = before


def packed_with_paths(value: object) -> bytes:
    """A value as pickle, its paths as written and where they lead to."""
    stream = io.BytesIO()
    _Pickler(stream).dump(value)
    return stream.getvalue()


class _Pickler(pickle.Pickler):
    def persistent_id(self, value: object) -> tuple[str, str] | None:
        """A path as written and as ``Bundle`` has it; None for everything else."""
        return (str(value), _place(value)) if isinstance(value, Path) else None


class Unpacked(pickle.Unpickler):
    """A value that was packed with its paths."""

    def __init__(self, payload: bytes, root: str) -> None:
        """Unpack it.

        Args:
            root: The folder of the bundle that its paths lie in; empty where they are those of this file system.
        """
        super().__init__(io.BytesIO(payload))
        self._root, self._written = root, dict[str, str]()
        self.value: Any = self.load()  # the value, with the paths that hold in this process

    def persistent_load(self, pid: tuple[str, str]) -> Path:
        """The path here."""
        written, place = pid
        if not self._root:
            return Path(written)
        self._written[self._root + place] = written
        return Path(self._root + place)

    def as_written(self, text: str) -> str:
        """A text that names paths as the sender wrote them."""
        for place in sorted(self._written, key=len, reverse=True):
            text = text.replace(place, self._written[place])
        return text.replace(self._root, "") if self._root else text
