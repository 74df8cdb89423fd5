"""STEP files made by OpenCASCADE: solids with known edges, assemblies at known places, in any unit of length."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder
from OCP.gp import gp_Ax2, gp_Dir, gp_Mat, gp_Pnt, gp_Quaternion, gp_Trsf, gp_Vec
from OCP.Interface import Interface_Static
from OCP.Message import Message
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_AsIs
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SOLID
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS
from OCP.XCAFDoc import XCAFDoc_DocumentTool

from cellplan.geometry.step.kernel import explored

UNITS = {"MM": 1.0, "CM": 10.0, "M": 1000.0, "INCH": 25.4, "FT": 304.8}  # [mm]


class Named(NamedTuple):
    """A solid with its name, and the names of some of its edges and faces by number, from 0."""

    name: str
    shape: Any
    edges: Mapping[int, str] = MappingProxyType({})
    faces: Mapping[int, str] = MappingProxyType({})


def box(low: Sequence[float], high: Sequence[float]) -> Any:
    """A cuboid between two corners in [mm]."""
    return BRepPrimAPI_MakeBox(gp_Pnt(*low), gp_Pnt(*high)).Shape()


def cylinder(radius: float, length: float, at: Sequence[float] = (0, 0, 0), along: Sequence[float] = (0, 0, 1)) -> Any:
    """A cylinder in [mm] that begins at a point."""
    return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(*at), gp_Dir(*along)), radius, length).Shape()


def frustum(low: float, high: float, length: float, along: Sequence[float] = (0, 0, 1)) -> Any:
    """A cone without its tip, from one radius to another in [mm], that begins at the origin."""
    return BRepPrimAPI_MakeCone(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(*along)), low, high, length).Shape()


def cut(shape: Any, tool: Any) -> Any:
    """A solid without another one."""
    return next(explored(BRepAlgoAPI_Cut(shape, tool).Shape(), TopAbs_SOLID))


def moved(shape: Any, X: np.ndarray) -> Any:
    """A solid at a pose in [mm]."""
    return BRepBuilderAPI_Transform(shape, placed(X).Transformation(), True).Shape()


def placed(X: np.ndarray) -> Any:
    """A location of the library from a pose in [mm]."""
    trsf, quaternion = gp_Trsf(), gp_Quaternion()
    quaternion.SetMatrix(gp_Mat(*X[:3, :3].ravel()))
    trsf.SetTransformation(quaternion, gp_Vec(*X[:3, 3]))
    return TopLoc_Location(trsf)


def write_step(path: Path, parts: Sequence[Named], *, poses: Sequence[np.ndarray] = (), unit: str = "MM") -> Path:
    """Write solids as an assembly; each of ``poses`` [mm] puts it into one assembly more, the first one outermost."""
    Message.DefaultMessenger_s().ChangePrinters().Clear()
    document = TDocStd_Document(TCollection_ExtendedString("step"))
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    inner = tool.NewShape()
    _name(inner, "FRAME")
    for part in parts:
        label = tool.AddShape(part.shape, False)
        _name(label, part.name)
        for kind, names in ((TopAbs_EDGE, part.edges), (TopAbs_FACE, part.faces)):
            for number, shape in enumerate(distinct(part.shape, kind)):
                if number in names:
                    _name(tool.AddSubShape(label, shape), names[number])
        tool.AddComponent(inner, label, TopLoc_Location())
    for level, X in enumerate(reversed(poses)):
        outer = tool.NewShape()
        _name(outer, f"LEVEL_{level}")
        tool.AddComponent(outer, inner, placed(X))
        inner = outer
    tool.UpdateAssemblies()
    writer = STEPCAFControl_Writer()
    Interface_Static.SetIVal_s("write.stepcaf.subshapes.name", 1)
    Interface_Static.SetCVal_s("write.step.unit", unit)
    writer.Transfer(document, STEPControl_AsIs)
    writer.Write(str(path))
    return path


def distinct(shape: Any, kind: Any) -> list[Any]:
    """Edges or faces of a shape, each once."""
    shapes: list[Any] = []
    for part in explored(shape, kind):
        if not any(part.IsSame(other) for other in shapes):
            shapes.append(part)
    cast = TopoDS.Edge if kind == TopAbs_EDGE else TopoDS.Face
    return [cast(it) for it in shapes]


def _name(label: Any, name: str) -> None:
    TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))
