"""Shapes of parts, tools and surroundings as they are written in a cell file."""

from typing import Annotated, ClassVar, Final, Literal, Self

from pydantic import Field, model_validator

from cellplan.model.settings.entry import AxisName, Coordinate, Entry, OneOf, PoseEntry, Size, Text, rule, setting
from cellplan.model.settings.units import Mm, Within

SOLID_SHAPES: Final = ("box", "cylinder", "capsule", "sphere", "mesh")


class BoxEntry(Entry):
    """A cuboid centred on its frame."""

    size_mm: tuple[Size, Size, Size] = Field(description="Edge lengths along x, y, z.")


class CylinderEntry(Entry):
    """A circular cylinder centred on its frame."""

    radius_mm: Size = Field(description="Radius.")
    length_mm: Size = Field(description="Length along its axis.")
    axis: AxisName = setting("z", "Direction of its axis.")


class RoundEnds(Entry):
    """Base of round shapes that end in half balls."""

    radius_mm: Size = Field(description="Radius.")
    length_mm: Size = Field(description="Length from end to end, round ends included.")

    @model_validator(mode="after")
    def _has_round_ends(self) -> Self:
        """The round ends need room."""
        if self.length_mm < 2.0 * self.radius_mm:
            raise rule(f"expected a length of at least {2.0 * self.radius_mm:g} (two radii)", "length_mm")
        return self


class CapsuleEntry(RoundEnds):
    """A cylinder with round ends, centred on its frame."""

    axis: AxisName = setting("z", "Direction of its axis.")


class SphereEntry(Entry):
    """A ball centred on its frame."""

    radius_mm: Size = Field(description="Radius.")


class ToolRoundEntry(Entry):
    """A round tool along its z axis, from -length to 0, so that it ends at the tip."""

    radius_mm: Size = Field(description="Radius.")
    length_mm: Size = Field(description="Length from end to end.")


class ToolCapsuleEntry(RoundEnds):
    """A round tool with round ends along its z axis, from -length to 0, so that it ends at the tip."""

    length_mm: Size = Field(description="Length from end to end.")


class PlaneEntry(Entry):
    """A floor: everything below it is solid."""

    z_mm: Coordinate = Field(description="Height of the floor in the world.")


MeshUnit = Literal["mm", "m", "inch"]
OPEN_MESH: Final = (
    "Take a mesh that is not closed as a surface: touching it counts, being inside it does not. An open mesh is "
    "refused otherwise."
)
MESH_FILE: Final = "STL, OBJ, PLY or COLLADA (.dae) file"
MESH_UNIT: Final = (
    "Unit of the mesh file; required with STL, OBJ and PLY. A COLLADA file states its own, and its up axis becomes z: "
    "a unit given here must be the same."
)


def require_unit_of(file: str | None, unit: str | None) -> None:
    """Most mesh files do not say their unit, so the cell must; nothing else may."""
    if unit is None and file is not None and not file.lower().endswith(".dae"):
        raise rule("missing, expected the unit of the mesh: mm, m or inch", "unit")
    if unit is not None and file is None:
        raise rule("unexpected key, a unit requires a mesh", "unit")


class OneShape(OneOf):
    """Base of entries that hold exactly one of several shapes, and the unit of a mesh."""

    @model_validator(mode="after")
    def _has_unit(self) -> Self:
        """A unit and the permission to be open go with a mesh."""
        file = getattr(self, "mesh", None)
        require_unit_of(file, getattr(self, "unit", None))
        if getattr(self, "open", None) is not None and file is None:
            raise rule("unexpected key, open requires a mesh", "open")
        return self


class PartShapeEntry(OneShape):
    """Exactly one of box, cylinder, sphere and mesh."""

    alternatives: ClassVar[tuple[str, ...]] = ("box", "cylinder", "sphere", "mesh")

    box: BoxEntry | None = setting(None, "Cuboid centred on the part frame.")
    cylinder: CylinderEntry | None = setting(None, "Circular cylinder centred on the part frame.")
    sphere: SphereEntry | None = setting(None, "Ball centred on the part frame.")
    mesh: Text | None = setting(None, f"{MESH_FILE} of a closed surface, drawn in the part frame.")
    unit: MeshUnit | None = setting(None, MESH_UNIT)


class StepEntry(Entry):
    """A part as its STEP file has it; units and places of an assembly are those of the file."""

    file: Text = Field(description="STEP file (.step, .stp); needs the extra `step`. Its frame is the part frame.")
    shape: Text | None = setting(
        None, "Name of an assembly, a part or a solid of the file; absent: all solids of the file."
    )
    deviation_mm: Annotated[Mm, Within(ge=0.001, le=10.0)] = setting(
        Mm(0.1),
        "Largest distance of the mesh from the surfaces of the file. The mesh stands for the part where distances are "
        "measured and in pictures; its deviation counts as the accuracy of bodies does (`checks.body_accuracy`).",
    )
    gap_mm: Annotated[Mm, Within(ge=0.0, le=5.0)] = setting(
        Mm(0.0), "Fit-up: solids that are no farther apart than this are joined by seams, which paths may follow."
    )


class ToolShapeEntry(OneShape):
    """Exactly one of box, cylinder, capsule, sphere and mesh; it ends at the tool tip."""

    alternatives: ClassVar[tuple[str, ...]] = SOLID_SHAPES

    box: BoxEntry | None = setting(None, "Cuboid; along the tool's z axis it reaches from -size to 0.")
    cylinder: ToolRoundEntry | None = setting(None, "Cylinder along the tool's z axis, from -length to 0.")
    capsule: ToolCapsuleEntry | None = setting(None, "Capsule along the tool's z axis, from -length to 0.")
    sphere: SphereEntry | None = setting(None, "Ball that touches the tool tip from behind.")
    mesh: Text | None = setting(None, f"{MESH_FILE}, drawn in the flange frame.")
    unit: MeshUnit | None = setting(None, MESH_UNIT)
    open: bool | None = setting(None, OPEN_MESH)


class SolidEntry(OneShape):
    """A solid and its pose."""

    alternatives: ClassVar[tuple[str, ...]] = SOLID_SHAPES

    box: BoxEntry | None = setting(None, "Cuboid.")
    cylinder: CylinderEntry | None = setting(None, "Circular cylinder.")
    capsule: CapsuleEntry | None = setting(None, "Cylinder with round ends.")
    sphere: SphereEntry | None = setting(None, "Ball.")
    mesh: Text | None = setting(None, f"{MESH_FILE}.")
    unit: MeshUnit | None = setting(None, MESH_UNIT)
    open: bool | None = setting(None, OPEN_MESH)
    at: PoseEntry | None = None


class ToolBodyEntry(SolidEntry):
    """A further solid of a tool, given in the flange frame."""

    at: PoseEntry = setting(PoseEntry(), "Pose of the solid in the flange frame.")


class _Floor(Entry):
    """The first key of an obstacle."""

    plane: PlaneEntry | None = setting(None, "Floor of the cell.")


class ObstacleEntry(SolidEntry, _Floor):
    """A fixed thing in the cell: exactly one shape and its pose."""

    alternatives: ClassVar[tuple[str, ...]] = ("plane", *SOLID_SHAPES)

    at: PoseEntry | None = setting(
        None, "Pose of the shape in the world; the world frame when absent. Not with a plane."
    )

    @model_validator(mode="after")
    def _is_placed_once(self) -> Self:
        """A floor has its height and no pose."""
        if self.plane is not None and self.at is not None:
            raise rule("unexpected key, a plane is placed by z_mm only", "at")
        return self
