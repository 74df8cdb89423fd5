"""Write ``cells/step/frame.step``: a plate with a square frame of four flats, one STEP file from the same input."""

import re
from pathlib import Path
from typing import Final

from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.gp import gp_Pnt
from OCP.Interface import Interface_Static
from OCP.Message import Message
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.TopLoc import TopLoc_Location
from OCP.XCAFDoc import XCAFDoc_DocumentTool

FILE: Final = Path(__file__).resolve().parent.parent / "cells" / "step" / "frame.step"
PLATES: Final = {
    "PLATE": ((-230, -230, -10), (230, 230, 0)),
    "FRONT": ((-200, -200, 0), (200, -192, 40)),
    "BACK": ((-200, 192, 0), (200, 200, 40)),
    "LEFT": ((-200, -192, 0), (-192, 192, 40)),
    "RIGHT": ((192, -192, 0), (200, 192, 40)),
}  # two corners of each in [mm]
HEADER: Final = "FILE_NAME('frame.step','',(''),(''),'','cellplan','');\n"  # without the time and the program


def main() -> None:
    """Write the file."""
    Message.DefaultMessenger_s().ChangePrinters().Clear()
    document = TDocStd_Document(TCollection_ExtendedString("step"))
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    frame = tool.NewShape()
    TDataStd_Name.Set_s(frame, TCollection_ExtendedString("FRAME"))
    for name, (low, high) in PLATES.items():
        label = tool.AddShape(BRepPrimAPI_MakeBox(gp_Pnt(*low), gp_Pnt(*high)).Shape(), False)
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))
        tool.AddComponent(frame, label, TopLoc_Location())
    tool.UpdateAssemblies()
    writer = STEPCAFControl_Writer()
    Interface_Static.SetIVal_s("write.surfacecurve.mode", 0)
    writer.Transfer(document)
    writer.Write(str(FILE))
    text = re.sub(r"FILE_NAME\(.*?\);\n", HEADER, FILE.read_text(), flags=re.DOTALL)
    FILE.write_text(text.replace("'Open CASCADE Model'", "'welded frame'"))


if __name__ == "__main__":
    main()
