"""Small COLLADA files, for tests of the reader: a wedge of six corners, whose faces can be written in several ways."""

import numpy as np

CORNERS = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.2, 0], [0, 0, 0.1], [0.3, 0, 0.1], [0, 0.2, 0.1]], dtype=float)
VOLUME = 0.5 * 0.3 * 0.2 * 0.1
TRIANGLES = [(0, 2, 1), (3, 4, 5), (0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4), (2, 0, 3), (2, 3, 5)]
INPUT = '<input semantic="VERTEX" source="#v" offset="0"/>'
LISTS = {
    "triangles": f'<triangles count="8">{INPUT}<p>{" ".join(str(i) for t in TRIANGLES for i in t)}</p></triangles>',
    "polylist": f'<polylist count="5">{INPUT}<vcount>3 3 4 4 4</vcount>'
    "<p>0 2 1 3 4 5 0 1 4 3 1 2 5 4 2 0 3 5</p></polylist>",
    "polygons": f'<polygons count="5">{INPUT}<p>0 2 1</p><p>3 4 5</p><p>0 1 4 3</p><p>1 2 5 4</p><p>2 0 3 5</p>'
    "</polygons>",
    "tristrips": f'<tristrips count="1">{INPUT}<p>2 0 5 3 4 0 1</p></tristrips>'
    f'<trifans count="1">{INPUT}<p>5 4 1 2</p></trifans><triangles count="1">{INPUT}<p>0 2 1</p></triangles>',
}
SHOWN = '<node><instance_geometry url="#g"/></node>'


def collada(
    faces: str = LISTS["triangles"],
    *,
    nodes: str = SHOWN,
    asset: str = "",
    library: str = "",
    points: np.ndarray = CORNERS,
    extra: str = "",
) -> str:
    """Text of a file; the numbers of the positions stand in line 4, the faces in line 7, the nodes in line 10."""
    names = "".join(f'<param name="{x}"/>' for x in "XYZ")
    numbers = " ".join(f"{value:.9g}" for value in points.ravel())
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>{asset}</asset>
<library_geometries><geometry id="g"><mesh><source id="s">
<float_array id="a" count="{points.size}">{numbers}</float_array>
<technique_common><accessor source="#a" count="{len(points)}" stride="3">{names}
</accessor></technique_common></source>{extra}<vertices id="v"><input semantic="POSITION" source="#s"/></vertices>
{faces}
</mesh></geometry></library_geometries>{library}
<library_visual_scenes><visual_scene id="scene">
{nodes}
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#scene"/></scene></COLLADA>
"""
