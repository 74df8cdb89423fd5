"""Published figures of a robot: accuracy of its link bodies, payload and reach."""

from typing import Annotated, Final, Literal

from pydantic import Field, Tag

from cellplan.model.settings.entry import Coordinates, Entry, PoseEntry, Size, Text, by_kind, setting
from cellplan.model.settings.units import Mm, Within

HEAVIEST_KG: Final = 100_000.0  # no robot lifts more
LARGEST_INERTIA: Final = 1e6  # [kg m^2] of a link
ROUGHEST_MM: Final = 1_000.0  # bodies that are farther off stand for nothing
FARTHEST: Final = 100_000.0  # [deg] or [mm] of a joint

JointPosition = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST)]
Accuracy = Annotated[Mm, Within(ge=0.0, le=ROUGHEST_MM)]
Moment = Annotated[float, Field(ge=-LARGEST_INERTIA, le=LARGEST_INERTIA)]
LoadFigure = Annotated[float, Field(gt=0.0, le=HEAVIEST_KG)]


class BodyAccuracyEntry(Entry):
    """How good the link bodies of a robot are, in place of what its own file says."""

    accuracy_mm: Accuracy = Field(description="Largest distance by which the real arm sticks out of its link bodies.")
    source: Text = setting("stated in the cell", "Where the figure comes from.")


class AxisLimitEntry(Entry):
    """What the load may do to one axis of the wrist."""

    moment_nm: LoadFigure | None = setting(None, "Largest moment of the load about the axis.")
    inertia_kg_m2: LoadFigure | None = setting(None, "Largest moment of inertia of the load about the axis.")


class PayloadEntry(Entry):
    """What a robot may carry on its flange, as far as it is published."""

    mass_kg: LoadFigure = Field(description="Largest mass of tool and part.")
    along_mm: Size | None = setting(None, "Farthest centre of the load from the flange plane, along the flange's z.")
    across_mm: Size | None = setting(None, "Farthest centre of the load from the flange's z axis.")
    axes: dict[str, AxisLimitEntry] = setting({}, "Limits of axes of the wrist by joint name.")
    source: Text = setting("not stated", "Where the figures come from.")

    @property
    def is_mass_only(self) -> bool:
        """Whether nothing but the mass is published."""
        return self.along_mm is None and self.across_mm is None and not self.axes


class LinkInertiaEntry(Entry):
    """The mass of a link; what has none may be left out."""

    mass_kg: LoadFigure = Field(description="Mass.")
    centre_mm: Coordinates = Field(description="Centre of mass.")
    inertia_kg_m2: tuple[Moment, Moment, Moment, Moment, Moment, Moment] = Field(
        description="Inertia about the centre of mass: xx, xy, xz, yy, yz, zz, the products with the sign that they "
        "have in the matrix, as in URDF."
    )
    at: PoseEntry | None = setting(
        None,
        "Frame of centre and inertia, given in the base frame while all joints read zero; when absent the frame of "
        "the link of a URDF, the base frame of a joint-axis table.",
    )


class InertiasEntry(Entry):
    """Masses and inertias of the links of a robot."""

    links: dict[str, LinkInertiaEntry] = Field(
        description="By the word base or the joint that carries a link; for a URDF by the name of the link."
    )
    source: Text = setting("not stated", "Where the figures come from.")


INERTIAS_WORDS: Final = "urdf or a mapping (links, source)"
InertiasChoice = Annotated[
    Annotated[Literal["urdf"], Tag(f"<{INERTIAS_WORDS}>")] | Annotated[InertiasEntry, Tag("<mapping>")],
    by_kind(INERTIAS_WORDS, mapping=dict),
]


class ReachEntry(Entry):
    """The maker's figure of the reach, from the first axis."""

    distance_mm: Size = Field(description="Largest distance from the first axis.")
    to: Text | None = setting(
        None, "The word flange, or the joint to whose point the maker measures; absent when it is not published."
    )
    source: Text = setting("not stated", "Where the figure comes from.")
