"""Write the parts under ``cells/step``: a plate with a square frame of four flats, and a dome on a round plate.

Each is one STEP file from the same input.
"""

import re
from pathlib import Path
from typing import Any, Final

from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Fuse
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakeSphere
from OCP.GeomAbs import GeomAbs_Sphere
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from OCP.Interface import Interface_Static
from OCP.Message import Message
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_FACE, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS
from OCP.XCAFDoc import XCAFDoc_DocumentTool

FOLDER: Final = Path(__file__).resolve().parent.parent / "cells" / "step"
PLATES: Final = {
    "PLATE": ((-230, -230, -10), (230, 230, 0)),
    "FRONT": ((-200, -200, 0), (200, -192, 40)),
    "BACK": ((-200, 192, 0), (200, 200, 40)),
    "LEFT": ((-200, -192, 0), (-192, 192, 40)),
    "RIGHT": ((192, -192, 0), (200, 192, 40)),
}  # two corners of each in [mm]
BALL, HEIGHT, ROUND, THICK = 250.0, 50.0, 180.0, 20.0  # [mm] radius of the ball, height of its cap, of the plate


def main() -> None:
    """Write the files."""
    Message.DefaultMessenger_s().ChangePrinters().Clear()
    plates = {name: BRepPrimAPI_MakeBox(gp_Pnt(*low), gp_Pnt(*high)).Shape() for name, (low, high) in PLATES.items()}
    write("frame.step", "welded frame", "FRAME", plates)
    dome = domed_plate()
    write("dome.step", "dome on a plate", "PART", {"DOME": dome}, {"CAP": ball_of(dome)})


def domed_plate() -> Any:
    """A cap of a ball on a round plate, its underside at z = -THICK."""
    ball = BRepPrimAPI_MakeSphere(gp_Pnt(0, 0, HEIGHT - BALL), BALL).Shape()
    above = BRepPrimAPI_MakeBox(gp_Pnt(-BALL, -BALL, -1.0), gp_Pnt(BALL, BALL, BALL)).Shape()
    plate = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 0, -THICK), gp_Dir(0, 0, 1)), ROUND, THICK).Shape()
    return TopExp_Explorer(
        BRepAlgoAPI_Fuse(BRepAlgoAPI_Common(ball, above).Shape(), plate).Shape(), TopAbs_SOLID
    ).Current()


def ball_of(solid: Any) -> Any:
    """The face of a solid that is part of a ball."""
    explorer = TopExp_Explorer(solid, TopAbs_FACE)
    while BRepAdaptor_Surface(TopoDS.Face(explorer.Current())).GetType() != GeomAbs_Sphere:
        explorer.Next()
    return explorer.Current()


def write(file: str, title: str, assembly: str, solids: dict[str, Any], faces: dict[str, Any] | None = None) -> None:
    """Write an assembly of solids by name, with the names of some of their faces."""
    document = TDocStd_Document(TCollection_ExtendedString("step"))
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    frame = tool.NewShape()
    TDataStd_Name.Set_s(frame, TCollection_ExtendedString(assembly))
    for name, solid in solids.items():
        label = tool.AddShape(solid, False)
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))
        for of_face, face in (faces or {}).items():
            TDataStd_Name.Set_s(tool.AddSubShape(label, face), TCollection_ExtendedString(of_face))
        tool.AddComponent(frame, label, TopLoc_Location())
    tool.UpdateAssemblies()
    writer = STEPCAFControl_Writer()
    Interface_Static.SetIVal_s("write.surfacecurve.mode", 0)
    Interface_Static.SetIVal_s("write.stepcaf.subshapes.name", 1 if faces else 0)
    writer.Transfer(document)
    writer.Write(str(FOLDER / file))
    header = f"FILE_NAME('{file}','',(''),(''),'','cellplan','');\n"  # without the time and the program
    text = re.sub(r"FILE_NAME\(.*?\);\n", header, (FOLDER / file).read_text(), flags=re.DOTALL)
    (FOLDER / file).write_text(text.replace("'Open CASCADE Model'", f"'{title}'"))


if __name__ == "__main__":
    main()
