"""Engine of a session: the values of a live cell, the block that is shown, and what is known of all blocks."""

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array
from cellplan.jobs.view.cell_scene import standing_scene
from cellplan.jobs.view.describe import base_records
from cellplan.jobs.view.geometries import Geometries
from cellplan.jobs.view.write import page_record, placed_scene
from cellplan.model.cell.cell import Cell
from cellplan.report.record.common import Record
from cellplan.session.advice import Advice
from cellplan.session.answer import Look, poses, strip_of
from cellplan.session.blocks import LiveCell
from cellplan.session.judge import Judgement, judged, reason
from cellplan.session.motion import follow, of_rows
from cellplan.session.starts import as_given, started, stated_start, written_starts

SAME_START: Final = 1e-3  # [rad] or [m] within which a start that is written is the one that a motion has


class Engine:
    """A cell at values of its variables.

    Attributes:
        origin: The cell as it was read.
        given: The same with ``others``, planned.
        others: Values by address that are no variables.
        values: Values in file units by address; those of the file where there is none.
        shown: Number of the block that is shown.
        version: How often the values were set.
    """

    def __init__(self, cell: Cell, others: Mapping[str, object] = {}, shown: int = 0, version: int = 0) -> None:
        """Plan the layout of a cell, with other values than those of variables and starts."""
        self.origin, self.others = cell, {**others}
        cell = cell.with_values(others) if others else cell
        self.given = self._live = LiveCell.of(cell)
        works = [place for place, block in enumerate(self.given.blocks) if block.stage.move is None]
        self.shown = shown if 0 < shown < len(self.given.blocks) else works[0]
        self._bodies = {body.name: body.X_BS for body in self.given.scene.bodies}
        self._obstacles, self.version = dict[str, float](), version
        self._looks = dict[int, Look]()
        self._advice = Advice()
        self.move({})

    def move(self, values: Mapping[str, float], block: int | None = None) -> None:
        """Work out a block at other values; None for the one that is shown.

        Raises:
            InputError: There is no such block, or an obstacle cannot stand there.
        """
        if block is not None and not 0 <= block < len(self.given.blocks):
            raise InputError(f"block: expected a number below {len(self.given.blocks)}, got {block}")
        self._place_obstacles({it: value for it, value in values.items() if self.given.variables.is_of_obstacle(it)})
        before, self.shown, self.values = self.shown, self.shown if block is None else block, {**values}
        self.version, self._is_settled = self.version + 1, False
        self._pending: Iterator[None] | None = None  # what is still to be found out at rest
        self._x = self._live.variables.numbers(values)
        last, shown = self._looks.get(self.shown), self._live.blocks[self.shown]
        motion = follow(shown, self._x, None if last is None else last.motion)
        self._looks = {self.shown: Look.at(shown, motion, last)}
        if last is None or self.shown != before:  # arrows are those of another block
            self._advice = Advice()

    def advise(self) -> bool:
        """Find out more of what would help, a bounded piece of work; False for nothing until some changes later."""
        return self._advice.go_on(self._looks[self.shown], self._live.variables, self.version)

    def restore(self, cell: Cell) -> None:
        """Work out the shown block at the values of a changed cell, whose robots begin as it says."""
        self.move(self.given.variables.written(cell))
        look = self._looks[self.shown]
        stated = stated_start(cell, look.block)
        if np.abs(look.motion.q[0] - stated).max() > SAME_START:
            self.given, self._live = _begun({self.shown: stated}, self.given, self._live)
            self._looks.clear()
            self.move(self.values)

    def hold(self) -> None:
        """Let later motions begin on the branches of the present ones: they are certified."""
        motions = {place: look.motion for place, look in self._looks.items() if look.motion.is_begun}
        starts = {place: motion.q[0] for place, motion in motions.items()}
        self.given, self._live = _begun(starts, self.given, self._live)

    def starts(self, *, of_all: bool = False) -> dict[str, object]:
        """Where robots begin in the blocks that are known, by address; as the file says where nothing was changed.

        Args:
            of_all: Whether all blocks are to be known.
        """
        if of_all:
            deque(_looked(self._live, self._x, self._looks), maxlen=0)
        cell, written = self.given.cell, dict[str, object]()
        for look in self._looks.values():
            if look.motion.is_begun:
                written |= written_starts(cell, look.block, look.motion.q[0])
        listed = self.given.variables.listed
        is_given = all(self.values.get(it.address, it.given) == it.given for it in listed)
        return as_given(cell, written) if is_given else written

    def settle(self, cell: Cell) -> bool:
        """Find out more of what is asked at rest, a bounded piece of work; False once there is nothing left to do.

        Args:
            cell: The cell as it would be saved.
        """
        if self._pending is None:
            self._pending = self._settling(cell)
        return next(self._pending, True) is None

    def refuse(self, error: InputError) -> bool:
        """Note why there is no cell at the present values; False once that is known."""
        was_settled, self._is_settled = self._is_settled, True
        judgement = Judgement(is_done=True, lost=reason(self.origin, error))
        self._looks[self.shown] = self._looks[self.shown].judged(judgement)
        return not was_settled

    def _settling(self, cell: Cell) -> Iterator[None]:
        """Piece by piece: what would help, the other blocks, the judgement of the shown one."""
        look = self._looks[self.shown]
        self._advice = Advice.of(look, self._live.variables, self.version)
        yield None
        yield from _looked(self._live, self._x, self._looks)
        begun = started(cell, look.motion.q[0]) if look.motion.is_begun else cell
        for judgement in judged(begun, look.block, self.given.scene):
            if not look.motion.is_followed and len(judgement.q):
                look = Look.at(look.block, of_rows(self._x, judgement.times, judgement.q))
            look = self._looks[self.shown] = look.judged(judgement)
            yield None
        self._advice = Advice.of(look, self._live.variables, self.version)
        self._is_settled = True
        yield None

    def record(self) -> Record:
        """What is known of the present values."""
        listed = self.given.variables.listed
        return {
            "version": self.version,
            "values": {it.address: self.values.get(it.address, it.given) for it in listed},
            "block": self.shown,
            **self._looks[self.shown].record,
            "poses": poses(self._live.variables.layout.placed(self._x), self._bodies),
            "strip": strip_of(self._live.blocks, self._looks),
            "advice": self._advice.records,
            "is_settled": self._is_settled,
        }

    def page(self) -> Record:
        """What a page needs once: the picture of the cell, its variables and its blocks."""
        geometries, scene = Geometries(), self.given.scene
        shown = {**standing_scene(scene, geometries), "bases": base_records(scene.cell)}
        return {
            "view": page_record("cell", scene.cell, geometries, [shown]),
            "variables": [it.record(value=self.values.get(it.address, it.given)) for it in self.given.variables.listed],
            "blocks": [{"name": block.name, "tasks": list(block.tasks)} for block in self.given.blocks],
            "demands": {"clearance_mm": scene.cell.checks.clearance_mm},
        }

    def _place_obstacles(self, values: Mapping[str, float]) -> None:
        """Let obstacles stand where values of theirs say, by address."""
        if values != self._obstacles:
            cell = self.given.cell.with_values(values) if values else self.given.cell
            self._live = self.given.on(cell, placed_scene(self.given.scene, cell))
            self._obstacles = {**values}


def _looked(live: LiveCell, x: Array, looks: dict[int, Look]) -> Iterator[None]:
    """Work out the blocks that are not known, one after the other."""
    for place, block in enumerate(live.blocks):
        if place not in looks:
            looks[place] = Look.at(block, follow(block, x))
            yield None


def _begun(starts: Mapping[int, Array], *cells: LiveCell) -> Iterator[LiveCell]:
    """Live cells whose blocks begin elsewhere, at stacked joint positions in [rad] or [m], (nq,), by their numbers."""
    for live in cells:
        blocks = (replace(block, start=starts.get(place, block.start)) for place, block in enumerate(live.blocks))
        yield replace(live, blocks=tuple(blocks))
