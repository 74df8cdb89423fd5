"""DXF drawings: by ezdxf, and as plain text with whatever is wrong in it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import ezdxf
from ezdxf.units import MM

from cellplan.files.cell.paths.dxf import DrawingSettings

CUT = {"layer": "CUT"}
UNITS = "9\n$ACADVER\n1\nAC1015\n9\n$INSUNITS\n70\n4\n"
HEAD = f"0\nSECTION\n2\nHEADER\n{UNITS}0\nENDSEC\n0\nSECTION\n2\nENTITIES\n"  # 18 lines
TAIL = "0\nENDSEC\n0\nEOF\n"
LINE = "0\nLINE\n8\nCUT\n10\n0\n20\n0\n11\n30\n21\n0\n"  # 12 lines


def settings(layer: str = "CUT", *, unit: str | None = None, join: float = 1e-5) -> DrawingSettings:
    """What a cell says of a drawing by the name of logo.dxf."""
    return DrawingSettings(source="logo.dxf", layer=layer, unit=unit, join=join)


def write_drawing(folder: Path, draw: Callable[[Any, Any], object], *, units: int = MM, version: str = "R2010") -> Path:
    """A drawing whose document and model space a function has filled."""
    document = ezdxf.new(version)
    document.units = units
    draw(document, document.modelspace())
    document.saveas(folder / "logo.dxf")
    return folder / "logo.dxf"


def write_text(folder: Path, entities: str = "", *, whole: str | None = None) -> Path:
    """A drawing in millimetres with some entities as text, or a whole file as text."""
    (folder / "logo.dxf").write_text(HEAD + entities + TAIL if whole is None else whole, newline="")
    return folder / "logo.dxf"


def entity(kind: str, *tags: tuple[int, object], layer: str = "CUT") -> str:
    """An entity by its group codes and values."""
    first = "100\nAcDbEntity\n" if tags and tags[0][0] == 100 else ""
    return f"0\n{kind}\n{first}8\n{layer}\n" + "".join(f"{code}\n{value}\n" for code, value in tags)
