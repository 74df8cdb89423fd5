"""The templates: each is one of the shipped cells with the files that it names."""

from dataclasses import dataclass
from typing import Final

from cellplan.errors import InputError
from cellplan.files.input.findings import did_you_mean, shown


@dataclass(frozen=True, slots=True)
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

STEP_FILE: Final = """\
The part is `step/frame.step`. Its seams, tasks to paste and a 3-D page with their names:

```sh
cellplan seams step/frame.step --fillets -o frame-seams.html
```

It needs the extra `step`: `pip install 'cellplan[step]'`."""

# fmt: off
TEMPLATES: Final = (  # name, summary, setting, meaning
    Template("two-robots", "one robot holds a plate, the other draws a ring on it; a line for every choice",
             "tasks.ring.path.circle.radius_mm=110", "a larger ring"),
    Template("own-urdf",
             "a small arm from a URDF draws on a plate that a bundled robot holds; your URDF takes its place",
             "robots.own.base.x_mm=1600", "the arm stands 50 mm nearer",
             files=("robots/own_arm.urdf",), more=USER_URDF),
    Template("gripper", "the gripper of a URDF with meshes and SRDF holds a plate, another robot draws on it",
             "tasks.ring.path.circle.radius_mm=30", "a smaller ring",
             files=("vendor/arm_description/config/arm.srdf", "vendor/arm_description/meshes/block.dae",
                    "vendor/arm_description/urdf/arm.urdf")),
    Template("fixed-part", "a block on a table, held by no robot; two robots work on it from both sides",
             "part.at.z_mm=920", "the block is clamped 20 mm higher"),
    Template("turntable", "a table that tilts and turns carries a ball, a robot draws a ring round its top",
             "motion.duration_s=4", "a shorter cycle", files=("robots/turntable.yaml",)),
    Template("rail", "a robot on a 3 m rail carries a beam past another that draws a line of 0.8 m",
             "tasks.seam.feed_mm_s=200", "a slower feed along the beam", files=("robots/abb_on_rail.yaml",)),
    Template("pedestal", "a cobot on a pedestal welds a ring on a drum that a larger robot holds",
             "robots.welder.base.z_mm=650", "a lower pedestal"),
    Template("tilted-mount", "a cobot on a stand that leans by 40 deg, another holds a plate for it",
             "robots.pen.base.pitch_deg=30", "a stand that leans less"),
    Template("dual-arm", "one robot holds a ball on a stalk, another draws a ring on its far side",
             "tasks.ring.path.circle.radius_mm=60", "a smaller ring"),
    Template("load-sharing", "two robots hold a beam of 1.6 m together, a third draws a long rectangle on it",
             "motion.duration_s=8", "a calmer cycle"),
    Template("four-robots", "one robot turns a cylinder, three others draw on it all at once (Ribeiro 2010)",
             "motion.duration_s=5", "a calmer cycle"),
    Template("multimove", "two arms and a positioner on one controller, which programs them in step (RAPID)",
             "motion.duration_s=8", "a calmer cycle", more=MULTIMOVE),
    Template("step-frame", "two arms weld a frame from a STEP file on a turntable: eight seams by name",
             "tasks.left_inside.process.feed_mm_s=18", "a slower seam", files=("step/frame.step",), more=STEP_FILE),
)
# fmt: on
FIRST: Final = TEMPLATES[0].name


def template_named(name: str) -> Template:
    """The template of a name; ``InputError`` where there is none."""
    names = [template.name for template in TEMPLATES]
    if name not in names:
        hint = did_you_mean(name, names)
        raise InputError(f"--template: expected one of {', '.join(names)}, got {shown(name)}{hint}")
    return TEMPLATES[names.index(name)]
