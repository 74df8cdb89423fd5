"""The templates: each is one of the shipped cells with the files that it names."""

from dataclasses import dataclass
from typing import Final

from cellplan.errors import InputError
from cellplan.files.input.findings import did_you_mean, shown


@dataclass(frozen=True, slots=True, kw_only=True)
class Template:
    """A shipped cell to begin with."""

    name: str  # name of the template and of its cell
    summary: str  # what the cell is, in one line
    setting: str  # A first change to try, ``KEY=VALUE`` for ``--set``; the cell passes with it, too
    meaning: str  # what that changes
    files: tuple[str, ...] = ()  # files that the cell names, relative to its folder
    more: str = ""  # A further hint; empty for none

    @property
    def source(self) -> str:
        """File of the shipped cell."""
        return f"{self.name.replace('-', '_')}.yaml"


USER_URDF: Final = """\
Put your URDF into `robots/`, with the meshes that it names, and see what it says before you write its path into
`cell.yaml`:

```sh
cellplan robots robots/own_arm.urdf
```"""

MULTIMOVE: Final = """\
The cell states its controller, so that its programs can be written in the language of the maker:

```sh
cellplan export outputs/multimove --format rapid --cell cell.yaml
```"""

TEMPLATES: Final = (
    Template(
        name="two-robots",
        summary="one robot holds a plate, the other draws a ring on it; a line for every choice",
        setting="tasks.ring.path.circle.radius_mm=110",
        meaning="a larger ring",
    ),
    Template(
        name="own-urdf",
        summary="a small arm from a URDF draws on a plate that a bundled robot holds; your URDF takes its place",
        setting="robots.own.base.x_mm=1600",
        meaning="the arm stands 50 mm nearer",
        files=("robots/own_arm.urdf",),
        more=USER_URDF,
    ),
    Template(
        name="gripper",
        summary="the gripper of a URDF with meshes and SRDF holds a plate, another robot draws on it",
        setting="tasks.ring.path.circle.radius_mm=30",
        meaning="a smaller ring",
        files=(
            "vendor/arm_description/config/arm.srdf",
            "vendor/arm_description/meshes/block.dae",
            "vendor/arm_description/urdf/arm.urdf",
        ),
    ),
    Template(
        name="fixed-part",
        summary="a block on a table, held by no robot; two robots work on it from both sides",
        setting="part.at.z_mm=920",
        meaning="the block is clamped 20 mm higher",
    ),
    Template(
        name="turntable",
        summary="a table that tilts and turns carries a ball, a robot draws a ring round its top",
        setting="motion.duration_s=4",
        meaning="a shorter cycle",
        files=("robots/turntable.yaml",),
    ),
    Template(
        name="rail",
        summary="a robot on a 3 m rail carries a beam past another that draws a line of 0.8 m",
        setting="tasks.seam.feed_mm_s=200",
        meaning="a slower feed along the beam",
        files=("robots/abb_on_rail.yaml",),
    ),
    Template(
        name="pedestal",
        summary="a cobot on a pedestal welds a ring on a drum that a larger robot holds",
        setting="robots.welder.base.z_mm=650",
        meaning="a lower pedestal",
    ),
    Template(
        name="tilted-mount",
        summary="a cobot on a stand that leans by 40 deg, another holds a plate for it",
        setting="robots.pen.base.pitch_deg=30",
        meaning="a stand that leans less",
    ),
    Template(
        name="dual-arm",
        summary="one robot holds a ball on a stalk, another draws a ring on its far side",
        setting="tasks.ring.path.circle.radius_mm=60",
        meaning="a smaller ring",
    ),
    Template(
        name="load-sharing",
        summary="two robots hold a beam of 1.6 m together, a third draws a long rectangle on it",
        setting="motion.duration_s=8",
        meaning="a calmer cycle",
    ),
    Template(
        name="four-robots",
        summary="one robot turns a cylinder, three others draw on it all at once (Ribeiro 2010)",
        setting="motion.duration_s=5",
        meaning="a calmer cycle",
    ),
    Template(
        name="multimove",
        summary="two arms and a positioner on one controller, which programs them in step (RAPID)",
        setting="motion.duration_s=8",
        meaning="a calmer cycle",
        more=MULTIMOVE,
    ),
)
FIRST: Final = TEMPLATES[0].name


def template_named(name: str) -> Template:
    """The template of a name; ``InputError`` where there is none."""
    names = [template.name for template in TEMPLATES]
    if name not in names:
        hint = did_you_mean(name, names)
        raise InputError(f"--template: expected one of {', '.join(names)}, got {shown(name)}{hint}")
    return TEMPLATES[names.index(name)]
