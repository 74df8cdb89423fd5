"""Scenes of the stages of a program: the part held, or lying where it is picked up or put down."""

from dataclasses import dataclass, field, replace

from cellplan.certify.run_pairs import scene_with_contact
from cellplan.model.cell import Cell
from cellplan.model.program import PartPlace
from cellplan.planning.sequence.part_moves import PartMove, part_lying
from cellplan.planning.sequence.stages import Stage
from cellplan.scene.bodies import Kind, SceneBody
from cellplan.scene.mounting import is_rigid_with_flange
from cellplan.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StageScenes:
    """The scenes that the stages of a program are judged in; each is built once.

    Attributes:
        lying: Those with the part lying somewhere, by its pose.
    """

    cell: Cell  # the cell; its starts and homes do not matter
    held: Scene  # its scene with the part held, or fixed
    lying: dict[bytes, Scene] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, cell: Cell) -> "StageScenes":
        """Build the scene of a cell."""
        return cls(cell=cell, held=Scene.from_cell(cell))

    def of_stage(self, stage: Stage) -> Scene:
        """The scene of one stage, with the cell of that stage."""
        scene = self.held if stage.place is None else self.with_part_at(stage.place)
        scene = replace(scene, cell=stage.cell)
        if stage.move is None:
            return scene
        if stage.place is not None:
            grasp = self.cell.part.held_by[0]

            def grips(body: SceneBody, other: SceneBody) -> bool:
                is_named = grasp.bodies is None or body.name in grasp.bodies
                is_gripper = body.robot == grasp.robot and is_named and is_rigid_with_flange(body, self.cell)
                return other.kind is Kind.PART and is_gripper

            return scene_with_contact(scene, grips, f"{grasp.robot} grips the part here or lets it go")
        program = self.cell.program
        places = {} if program is None else {PartMove.LIFT: program.attach, PartMove.LOWER: program.detach}
        place = places.get(stage.move)
        support = None if place is None else place.rests_on

        def rests(body: SceneBody, other: SceneBody) -> bool:
            return other.kind is Kind.PART and body.kind is Kind.OBSTACLE and body.name == support

        return scene_with_contact(scene, rests, "the part is taken from it here or put on it")

    def with_part_at(self, place: PartPlace) -> Scene:
        """The scene with the part lying at a place."""
        key = place.X_WP.tobytes()
        if key not in self.lying:
            self.lying[key] = Scene.from_cell(part_lying(self.cell, place))
        return self.lying[key]
