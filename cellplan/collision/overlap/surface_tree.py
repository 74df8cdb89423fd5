"""A surface in ever smaller patches, each with a point of the surface and a ball round that point that holds it."""

from dataclasses import dataclass

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.mesh.rays import along_curve
from cellplan.geometry.mesh.tessellation import halved


@dataclass(frozen=True, slots=True, eq=False)
class Patches:
    """Some patches of a surface; one is known by its place in its level of the tree, or as a single triangle."""

    level: int  # level of the tree, the same for all; that of single triangles is the number of levels
    place: Indices  # place of each in that level, shape (K,); of single triangles it has no meaning
    triangles: Array  # their corners in [m], shape (K, 3, 3); none above the level of single triangles
    centres: Array  # A point of the surface in each in [m], shape (K, 3)
    radii: Array  # radius of a ball round it that holds the patch in [m], shape (K,)

    def some(self, which: Indices) -> "Patches":
        """Some of them."""
        triangles = self.triangles[which] if len(self.triangles) else self.triangles
        return Patches(self.level, self.place[which], triangles, self.centres[which], self.radii[which])

    def __len__(self) -> int:
        """How many there are."""
        return len(self.place)


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceTree:
    """Binary tree of patches over triangles that are sorted along a space-filling curve.

    Attributes:
        centres: A point of the surface in each patch of each level above the triangles, shapes (2^level, 3).
    """

    count: int  # number of triangles F
    triangles: Array  # the sorted triangles in [m], the last one repeated until there are 2^D, shape (2^D, 3, 3)
    centres: tuple[Array, ...]
    radii: tuple[Array, ...]  # radii of the balls round them in [m], shapes (2^level,)

    @classmethod
    def over(cls, triangles: Array) -> "SurfaceTree":
        """Build the tree over triangles in [m], shape (F, 3, 3)."""
        middles = triangles.mean(axis=1)
        count = len(triangles)
        depth = int(np.ceil(np.log2(count)))
        order = np.pad(along_curve(middles), (0, 2**depth - count), mode="edge")
        triangles, middles = triangles[order], middles[order]
        centres, radii = [], []
        for level in range(depth):
            centroids, corners = middles.reshape(2**level, -1, 3), triangles.reshape(2**level, -1, 3)
            box = 0.5 * (corners.min(axis=1) + corners.max(axis=1))
            nearest = np.argmin(np.linalg.norm(centroids - box[:, None], axis=2), axis=1)
            centres.append(centroids[np.arange(2**level), nearest])
            radii.append(np.linalg.norm(corners - centres[-1][:, None], axis=2).max(axis=1))
        return cls(count, triangles, tuple(centres), tuple(radii))

    def root(self) -> Patches:
        """The whole surface as one patch."""
        return self._at(0, np.zeros(1, dtype=np.intp))

    def parts(self, patches: Patches) -> tuple[Patches, Indices]:
        """Both halves of each patch, and the place of the patch that each of them is a half of, shape (K,)."""
        whole = np.tile(np.arange(len(patches)), 2)
        if patches.level == len(self.centres):
            return _singles(patches.level, halved(patches.triangles)), whole
        place, level = np.concatenate([2 * patches.place, 2 * patches.place + 1]), patches.level + 1
        is_there = place * (len(self.triangles) >> level) < self.count  # all others hold repeated triangles only
        return self._at(level, place[is_there]), whole[is_there]

    def _at(self, level: int, place: Indices) -> Patches:
        """Patches of a level."""
        if level < len(self.centres):
            return Patches(level, place, np.zeros((0, 3, 3)), self.centres[level][place], self.radii[level][place])
        return _singles(level, self.triangles[place])


def _singles(level: int, triangles: Array) -> Patches:
    """Single triangles as patches."""
    centres = triangles.mean(axis=1)
    radii = np.linalg.norm(triangles - centres[:, None], axis=2).max(axis=1)
    return Patches(level, np.arange(len(triangles)), triangles, centres, radii)
