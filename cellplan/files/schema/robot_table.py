"""A robot as a table of joint axes at its reference configuration, with the solids of its links."""

from typing import Annotated, ClassVar, Final, Literal, Self

from pydantic import Field, Tag, model_validator

from cellplan.files.schema.robot import (
    AXIS_LIMIT,
    SLIDING_LIMITS,
    TURNING_LIMITS,
    JointAngle,
    SlidingAcceleration,
    SlidingJerk,
    Torque,
    TurningAcceleration,
    TurningJerk,
    TurningSpeed,
)
from cellplan.files.schema.shapes import MESH_FILE, MESH_UNIT, SOLID_SHAPES, MeshUnit, SphereEntry, require_unit_of
from cellplan.model.settings.controllers import ControllerZeroEntry
from cellplan.model.settings.entry import (
    NOT_TURNED,
    ORIGIN,
    Angles,
    Coordinate,
    Coordinates,
    Entry,
    Name,
    OneOf,
    PoseEntry,
    Size,
    SlidingSpeed,
    Text,
    Vector,
    by_kind,
    rule,
    setting,
)
from cellplan.model.settings.robot import Accuracy, InertiasEntry, PayloadEntry, ReachEntry

BODY_LIMIT: Final = 200  # solids of one robot
UNIT_TOL: Final = 1e-3  # [-] room for axes written with four digits


class JointEntry(Entry):
    """One joint: its axis in the base frame at the reference configuration, and its limits."""

    type: Literal["revolute", "prismatic"] = Field(description="How the joint moves.")
    axis: Vector = Field(description="Unit direction of the axis.")
    point_mm: Coordinates = setting(ORIGIN, "A point on the axis; required for a revolute joint.")
    lower_deg: JointAngle | None = setting(None, "Lowest angle of a revolute joint.")
    upper_deg: JointAngle | None = setting(None, "Highest angle of a revolute joint.")
    velocity_deg_s: TurningSpeed | None = setting(None, "Largest speed of a revolute joint.")
    acceleration_deg_s2: TurningAcceleration | None = setting(
        None, "Largest acceleration of a revolute joint, if known."
    )
    jerk_deg_s3: TurningJerk | None = setting(None, "Largest jerk of a revolute joint, if known.")
    torque_nm: Torque | None = setting(
        None, "Largest torque of the drive of a revolute joint, behind its gears, if known."
    )
    lower_mm: Coordinate | None = setting(None, "Lowest position of a prismatic joint.")
    upper_mm: Coordinate | None = setting(None, "Highest position of a prismatic joint.")
    velocity_mm_s: SlidingSpeed | None = setting(None, "Largest speed of a prismatic joint.")
    acceleration_mm_s2: SlidingAcceleration | None = setting(
        None, "Largest acceleration of a prismatic joint, if known."
    )
    jerk_mm_s3: SlidingJerk | None = setting(None, "Largest jerk of a prismatic joint, if known.")
    force_n: Torque | None = setting(None, "Largest force of the drive of a prismatic joint, if known.")

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        """Keys of the joint's own unit, all of them, lower below upper."""
        limits, other = (
            (TURNING_LIMITS, SLIDING_LIMITS) if self.type == "revolute" else (SLIDING_LIMITS, TURNING_LIMITS)
        )
        for name in other:
            if getattr(self, name) is not None:
                raise rule(f"unexpected key, a {self.type} joint has {', '.join(limits)}", name)
        for name in limits[:3]:
            if getattr(self, name) is None:
                raise rule(f"missing, a {self.type} joint needs {', '.join(limits[:3])}", name)
        if self.type == "revolute" and "point_mm" not in self.model_fields_set:
            raise rule("missing, expected a point on the axis", "point_mm")
        lower, upper = getattr(self, limits[0]), getattr(self, limits[1])
        if not lower < upper:
            raise rule(f"expected a number above {limits[0]} = {lower:g}, got {upper:g}", limits[1])
        length = sum(component * component for component in self.axis) ** 0.5
        if abs(length - 1.0) > UNIT_TOL:
            raise rule(f"expected a vector of length 1, got one of length {length:.6g}", "axis")
        return self


class SegmentEntry(Entry):
    """A round solid along a segment in the base frame at the reference configuration."""

    from_mm: Coordinates = Field(description="One end of the middle line.")
    to_mm: Coordinates = Field(description="Other end of the middle line.")
    radius_mm: Size = Field(description="Radius.")


class PlacedBoxEntry(Entry):
    """A cuboid in the base frame at the reference configuration."""

    size_mm: tuple[Size, Size, Size] = Field(description="Edge lengths along its own x, y, z.")
    center_mm: Coordinates = Field(description="Centre.")
    rpy_deg: Angles = setting(NOT_TURNED, "Roll, pitch and yaw about fixed axes.")


class PlacedSphereEntry(SphereEntry):
    """A ball in the base frame at the reference configuration."""

    center_mm: Coordinates = Field(description="Centre.")


class PlacedMeshEntry(Entry):
    """A mesh in the base frame at the reference configuration."""

    file: Text = Field(description=f"{MESH_FILE}, relative to the table.")
    unit: MeshUnit | None = setting(None, MESH_UNIT)
    at: PoseEntry = setting(PoseEntry(), "Pose of the drawing in the base frame.")

    @model_validator(mode="after")
    def _has_unit(self) -> Self:
        """A unit, unless the file states it."""
        require_unit_of(self.file, self.unit)
        return self


class LinkBodyEntry(OneOf):
    """A solid fixed to one link."""

    alternatives: ClassVar[tuple[str, ...]] = SOLID_SHAPES

    link: Text = Field(description="The word base, or the joint that carries the solid.")
    name: Name | None = setting(None, "Name in reports; the link's name, numbered, when absent.")
    box: PlacedBoxEntry | None = setting(None, "Cuboid.")
    cylinder: SegmentEntry | None = setting(None, "Cylinder with flat ends.")
    capsule: SegmentEntry | None = setting(None, "Cylinder with round ends beyond the segment.")
    sphere: PlacedSphereEntry | None = setting(None, "Ball.")
    mesh: PlacedMeshEntry | None = setting(None, "Mesh from a file.")
    accuracy_mm: Accuracy | None = setting(
        None, "How far the real link may stick out of this solid; when absent what is stated for all of them."
    )

    @model_validator(mode="after")
    def _has_two_ends(self) -> Self:
        """A cylinder has two ends."""
        if self.cylinder is not None and self.cylinder.from_mm == self.cylinder.to_mm:
            raise rule("expected another point than from_mm, got the same", "cylinder.to_mm")
        return self


class BodiesEntry(Entry):
    """Solids of the links, with a statement on how good they are."""

    accuracy_mm: Accuracy | None = setting(
        None, "Largest distance by which the real arm sticks out of the solids; the report says so when absent."
    )
    source: Text = setting("not stated", "Where the accuracy comes from.")
    solids: tuple[LinkBodyEntry, ...] = setting(
        (), "Solids of the links, in the base frame at the reference configuration.", max_length=BODY_LIMIT
    )


BODIES_WORDS: Final = "a list of solids or a mapping (accuracy_mm, source, solids)"
BodiesChoice = Annotated[
    Annotated[BodiesEntry, Tag("<mapping>")]
    | Annotated[tuple[LinkBodyEntry, ...], Field(max_length=BODY_LIMIT), Tag("<list>")],
    by_kind(BODIES_WORDS, mapping=dict, list=tuple),
]


class RobotTableDocument(Entry):
    """A whole robot file."""

    robot: Name = Field(description="Name of the robot model.")
    source: Text = setting("not stated", "Where the figures come from.")
    joints: dict[Name, JointEntry] = Field(
        min_length=1, max_length=AXIS_LIMIT, description="Joints by name, from the base to the flange."
    )
    flange: PoseEntry = Field(
        description="Flange (mechanical interface) in the base frame at zero joints, z out of the flange."
    )
    bodies: BodiesChoice = setting(
        (),
        "Solids of the links, in the base frame at the reference configuration: a list of them, or a mapping that "
        "also states their accuracy.",
    )
    payload: PayloadEntry | None = setting(None, "What the robot may carry; the report says so when absent.")
    inertias: InertiasEntry | None = setting(None, "Masses and inertias of the links, if known.")
    reach: ReachEntry | None = setting(None, "Reach as the maker publishes it, if known.")
    controller: ControllerZeroEntry | None = setting(
        None,
        "How its controller counts the joints; when absent the zero of the model is taken as the controller's, and "
        "the report says so. Without keys: known to be the same.",
    )

    @property
    def solids(self) -> tuple[LinkBodyEntry, ...]:
        """Solids of the links, in whichever way they are written."""
        return self.bodies.solids if isinstance(self.bodies, BodiesEntry) else self.bodies

    @property
    def solids_path(self) -> tuple[str, ...]:
        """Key path of the solids in the file."""
        return ("bodies", "solids") if isinstance(self.bodies, BodiesEntry) else ("bodies",)
