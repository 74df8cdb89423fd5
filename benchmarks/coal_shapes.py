"""Solids as coal takes them: the second opinion of tests and benchmarks on distances and contacts."""

import coal

from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere


def coal_shape(solid: Solid) -> coal.CollisionGeometry:
    """Geometry of a solid in its own frame, lengths in [m]; a mesh becomes the tree of its triangles."""
    match solid:
        case Box(size):
            return coal.Box(*size)
        case Cylinder(radius, length):
            return coal.Cylinder(radius, length)
        case Capsule(radius, length):
            return coal.Capsule(radius, length)
        case Sphere(radius):
            return coal.Sphere(radius)
        case Mesh(vertices, faces):
            tree = coal.BVHModelOBBRSS()
            tree.beginModel(len(faces), len(vertices))
            tree.addVertices(vertices)
            tree.addTriangles(faces)
            tree.endModel()
            return tree
