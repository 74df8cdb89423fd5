"""Scenes of the stages of a program: the part held, or lying where it is picked up or put down."""

from dataclasses import dataclass, field, replace

from cellplan.model.cell.cell import Cell
from cellplan.model.settings.program import PartPlaceEntry
from cellplan.planning.sequence.part_moves import PartMove, part_lying
from cellplan.planning.sequence.stages import Stage
from cellplan.scene.part_contact import PartContact
from cellplan.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StageScenes:
    """The scenes that the stages of a program are judged in; each is built once."""

    cell: Cell  # the cell; its starts and homes do not matter
    held: Scene  # its scene with the part held, or fixed
    lying: dict[bytes, Scene] = field(default_factory=dict, repr=False)  # those with the part lying, by its pose

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
        key = "attach" if stage.move in (PartMove.GRIP, PartMove.LIFT) else "detach"
        place, is_lying = getattr(self.cell.program, key), stage.place is not None
        grasp = self.cell.part.held_by[0]
        contact = PartContact(key=f"program.{key}", place=place, grasp=grasp, is_lying=is_lying)
        return contact.with_contacts(scene)

    def with_part_at(self, place: PartPlaceEntry) -> Scene:
        """The scene with the part lying at a place."""
        key = place.X_WP.tobytes()
        if key not in self.lying:
            self.lying[key] = Scene.from_cell(part_lying(self.cell, place))
        return self.lying[key]
