"""Tools of a cell file become the cell's data."""

from dataclasses import replace

from cellplan.io.schema.tool import RodEntry, ToolEntry
from cellplan.io.shapes import MeshReader, centred_solid, tool_solid
from cellplan.model.cell import Tool
from cellplan.model.robot import BASE, Body
from cellplan.model.rod import Holder, Rod, tool_body_name
from cellplan.model.settings.units import in_si


def build_tool(entry: ToolEntry, read_mesh: MeshReader) -> Tool:
    """A tool; its bodies are named ``tool``, ``tool_2``, …, those of a rod first."""
    rod = None if entry.rod is None else build_rod(entry.rod)
    X_FT = entry.matrix if rod is None else rod.X_FT
    bodies = [] if rod is None else list(rod.bodies())
    if entry.geometry is not None:
        solid, X_FS = tool_solid(entry.geometry, X_FT, read_mesh)
        bodies.append(Body(name="", link=BASE, shape=solid, X_BS=X_FS))
    for body in entry.bodies:
        solid, X_AS = centred_solid(body, read_mesh)
        bodies.append(Body(name="", link=BASE, shape=solid, X_BS=body.at.matrix @ X_AS))
    return Tool(
        X_FT=X_FT,
        bodies=tuple(replace(body, name=tool_body_name(number)) for number, body in enumerate(bodies, start=1)),
        mass=entry.mass_kg,
        centre=None if entry.centre_mm is None else in_si(entry.centre_mm),
        rod=rod,
    )


def build_rod(entry: RodEntry) -> Rod:
    """A rod in [m] and [rad]."""
    holder = entry.holder
    return Rod(
        length=entry.length_mm.si,
        tilt=entry.tilt_deg.si,
        roll=entry.roll_deg.si,
        radius=entry.radius_mm.si,
        stick_out=entry.stick_out_mm.si,
        holder=None if holder is None else Holder(radius=holder.radius_mm.si, length=holder.length_mm.si),
    )
