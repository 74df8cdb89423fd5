"""Make the part and the path of ``cells/mesh_part_csv.yaml``: ``python docs/make_dome_part.py`` writes both.

The part is a smooth dome on a round plate, drawn in [mm] with the middle of its underside at the origin:
``z(r) = PLATE + RISE (1 - (r/RADIUS)^2)^2``. The path is a three-lobed curve on the dome with the inward normal.
"""

import struct
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CELLS = Path(__file__).resolve().parent.parent / "cells"
RADIUS, PLATE, RISE = 150.0, 20.0, 60.0  # [mm]
RINGS, SECTORS = 20, 64
PATH_POINTS = 180


def height(r: Array) -> Array:
    """Height of the dome at a distance from its axis."""
    return PLATE + RISE * (1.0 - (r / RADIUS) ** 2) ** 2


def slope(r: Array) -> Array:
    """Derivative of the height."""
    return -4.0 * RISE * r / RADIUS**2 * (1.0 - (r / RADIUS) ** 2)


def dome() -> Array:
    """Triangles of the closed surface, counter-clockwise from outside, shape (M, 3, 3)."""
    angles = 2.0 * np.pi * np.arange(SECTORS + 1) / SECTORS
    angles[-1] = 0.0  # the seam closes exactly
    radii = RADIUS * np.linspace(0.0, 1.0, RINGS + 1)
    profile = [(r, float(height(np.array(r)))) for r in radii] + [(RADIUS, 0.0), (0.0, 0.0)]
    triangles = []
    for (r0, z0), (r1, z1) in pairwise(profile):
        for a, b in pairwise(angles):
            inner = [(r0 * np.cos(t), r0 * np.sin(t), z0) for t in (a, b)]
            outer = [(r1 * np.cos(t), r1 * np.sin(t), z1) for t in (a, b)]
            if r1 > 0.0:
                triangles.append((inner[0], outer[0], outer[1]))
            if r0 > 0.0:
                triangles.append((inner[0], outer[1], inner[1]))
    return np.array(triangles)


def write_stl(path: Path, triangles: Array) -> None:
    """Binary STL; normals are left to the reader."""
    records = b"".join(struct.pack("<12fH", 0.0, 0.0, 0.0, *map(float, t.ravel()), 0) for t in triangles)
    path.write_bytes(b"dome of cellplan, in mm".ljust(80, b" ") + struct.pack("<I", len(triangles)) + records)


def rosette() -> Array:
    """Points on the dome and unit axes into it, shape (N, 6); the last point is not the first again."""
    phi = 2.0 * np.pi * np.arange(PATH_POINTS) / PATH_POINTS
    r = 75.0 + 20.0 * np.cos(3.0 * phi)
    outward = np.stack([-slope(r) * np.cos(phi), -slope(r) * np.sin(phi), np.ones_like(phi)], axis=1)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    return np.column_stack([r * np.cos(phi), r * np.sin(phi), height(r), -outward])


def main() -> None:
    """Write the mesh and the table."""
    write_stl(CELLS / "meshes" / "dome.stl", dome())
    rows = [",".join(f"{value + 0.0:.9f}" for value in row) for row in rosette()]
    text = "\n".join(["x_mm,y_mm,z_mm,i,j,k", *rows]) + "\n"
    (CELLS / "paths" / "dome_rosette.csv").write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
