"""A layout of a live cell, and what is known of it: its blocks, and its judgement at rest."""

from collections.abc import Iterator
from typing import Final

from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Cell
from cellplan.report.record.common import Record
from cellplan.session.answer import Look, poses, strip_of, verdict_of
from cellplan.session.blocks import LiveCell
from cellplan.session.executor import FAILURE, Result, Step
from cellplan.session.judge import Judgement, Judgements, judged_block, judged_job
from cellplan.session.motion import follow, of_rows, standing, worked_out
from cellplan.session.starts import started

JUDGED: Final = "judged"  # steps of an executor besides motions, which have the numbers of their blocks


class Layout:
    """A layout and what is known of it.

    Attributes:
        live: The live cell.
        x: The variables of its layout in [m] and [rad], shape (n,).
        looks: Its blocks by their numbers, as far as they are known.
        job: What is known of its phases at rest, by their names.
        failure: Why that is not known; empty where it is, or may be.
    """

    def __init__(self, live: LiveCell, x: Array, before: "Layout | None" = None) -> None:
        """Begin without any block; those of the layout before make them quicker."""
        self.live, self.x, self.looks, self.failure = live, x, dict[int, Look](), ""
        self.job: dict[str, Judgement] = {}
        self._before = {} if before is None else before.looks

    def look(self, place: int) -> Look:
        """A block; of one that takes long, as of all while no layout was planned, only where it begins."""
        if place not in self.looks:
            block, near = self.live.blocks[place], self._before.get(place)
            if self.live.is_planned:
                motion = follow(block, self.x, None if near is None else near.motion)
            else:
                motion = standing(self.x, block.start)
            look = Look.at(block, motion, near)
            self.looks[place] = look.judged(self.job[block.name]) if block.name in self.job else look
        return self.looks[place]

    def motions(self, *places: int) -> Iterator[Step]:
        """What is to be worked out of blocks that are not known yet."""
        for place in places if self.live.is_planned else ():
            motion, block = self.look(place).motion, self.live.blocks[place]
            if motion.is_awaited:
                yield place, worked_out, (block, motion)

    def others(self) -> Iterator[None]:
        """Work out the blocks that are not known, one after the other."""
        for place in range(len(self.live.blocks)):
            if place not in self.looks:
                self.look(place)
                yield None

    def at_rest(self, place: int, cell: Cell) -> Iterator[Step]:
        """What is to be worked out at rest.

        Args:
            place: Number of the block that is shown.
            cell: The cell as it would be saved.
        """
        yield from self.motions(*self.looks)
        shown, steps = self.look(place), [len(block.schedule.times) - 1 for block in self.live.blocks]
        if len(steps) > 1 and shown.block.stage.move is None:
            yield JUDGED, judged_block, (cell, shown.block.stage, steps[place], self.live.scene)
        begun = started(cell, shown.motion.q[0]) if shown.motion.is_begun else cell
        yield JUDGED, judged_job, (begun, steps)

    def note(self, result: Result) -> None:
        """Take in what was worked out."""
        if result.step == FAILURE:
            self.failure = result.value
        elif isinstance(result.step, int):
            self.looks[result.step] = Look.at(self.live.blocks[result.step], result.value)
        else:
            self._judge(result.value)

    def _judge(self, known: Judgements) -> None:
        """Take in a judgement; where a motion broke off, with the rows that were judged."""
        self.job |= known
        for place, look in self.looks.items():
            if (of := known.get(look.block.name)) is not None:
                has_rows = not look.motion.is_followed and len(of.q)
                moved = Look.at(look.block, of_rows(self.x, of.times, of.q)) if has_rows else look
                self.looks[place] = moved.judged(of)

    def record(self, place: int, bodies: dict[str, Array]) -> Record:
        """What an answer says with one block shown.

        Args:
            bodies: Poses of the bodies that the page was given, by name.
        """
        look = self.look(place)
        return {
            **verdict_of(look, self.job, self.failure),
            "block": place,
            **look.record,
            "poses": poses(self.live.variables.layout.placed(self.x), bodies),
            "strip": strip_of(self.live.blocks, self.looks),
        }
