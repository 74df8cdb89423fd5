"""Pictures that a test session has painted before are not painted again: the bytes follow from the sheet alone."""

import hashlib
import io
import os
import pickle
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from cellplan.report.plots import canvas

_paint = canvas.paint
_state: dict[str, Path | None] = {"folder": None}
_sketching = [False]


def install(folder: Path) -> None:
    """Keep pictures in a folder from here on."""
    folder.mkdir(parents=True, exist_ok=True)
    _state["folder"] = folder
    canvas.paint = _kept


@contextmanager
def sketching(*, is_sketching: bool) -> Iterator[None]:
    """Sketch pictures, or paint them, while the ``with`` statement lasts.

    A sketch holds no more than the digest of its sheet, so that other figures show in it.
    """
    before, _sketching[0] = _sketching[0], is_sketching
    try:
        yield
    finally:
        _sketching[0] = before


@contextmanager
def painted_anew() -> Iterator[None]:
    """Paint everything while the ``with`` statement lasts, as users' processes do."""
    folder, _state["folder"] = _state["folder"], None
    try:
        yield
    finally:
        _state["folder"] = folder


def _kept(sheets: Mapping[str, Any]) -> dict[str, bytes]:
    """What ``canvas.paint`` gives; every sheet is painted once in a session."""
    folder = _state["folder"]
    if folder is None:
        return _paint(sheets)
    if _sketching[0]:
        return {f"{name}.{kind}": _sketch(sheet) for name, sheet in sheets.items() for kind in ("svg", "png")}
    files: dict[str, bytes] = {}
    for name, sheet in sheets.items():
        entry = folder / _digest(sheet)
        if not entry.exists():
            draft = entry.with_suffix(f".{os.getpid()}")
            draft.write_bytes(pickle.dumps(_paint({"": sheet})))
            draft.replace(entry)
        painted: dict[str, bytes] = pickle.loads(entry.read_bytes())  # noqa: S301 - written by this session
        files |= {f"{name}{ending}": content for ending, content in painted.items()}
    return files


def _sketch(sheet: Any) -> bytes:
    """A picture whose only word is the digest of its sheet."""
    return f'<svg xmlns="http://www.w3.org/2000/svg"><text>{_digest(sheet)}</text></svg>'.encode()


def _digest(sheet: Any) -> str:
    """Digest of a sheet by its values alone, whichever of its strings are one object."""
    text = io.BytesIO()
    pickler = pickle.Pickler(text)
    pickler.fast = True
    pickler.dump(sheet)
    return hashlib.sha256(text.getvalue()).hexdigest()
