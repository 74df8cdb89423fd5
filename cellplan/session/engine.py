"""Engine of a session: the values of a live cell, the block that is shown, and what is to be worked out next."""

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
from cellplan.session.blocks import LiveCell
from cellplan.session.executor import Executor
from cellplan.session.judge import JOB, Judgement, reason
from cellplan.session.layout import Layout
from cellplan.session.starts import as_given, stated_start, written_starts

SAME_START: Final = 1e-3  # [rad] or [m] within which a start that is written is the one that a motion has
LAYOUT: Final = "layout"  # step of an executor that plans the given layout


class Engine:
    """A cell at values of its variables.

    Attributes:
        origin: The cell as it was read.
        given: The same with ``others``, planned as soon as the executor has done so.
        others: Values by address that are no variables.
        values: Values in file units by address; those of the file where there is none.
        shown: Number of the block that is shown.
        version: How often the values were set.
    """

    def __init__(
        self, cell: Cell, executor: Executor, others: Mapping[str, object] = {}, shown: str = "", version: int = 0
    ) -> None:
        """Begin to plan the layout of a cell, with other values than those of variables and starts.

        Args:
            shown: Name of the block to be shown, where there is one.
        """
        self.origin, self.others, self._executor, self.version = cell, {**others}, executor, version
        self.values: Mapping[str, float] = {}
        self._use(LiveCell.of(cell.with_values(others) if others else cell), shown, {})

    def _use(self, given: LiveCell, shown: str, values: Mapping[str, float]) -> None:
        """Go on with a live cell."""
        self.given = self._live = given
        works = [place for place, block in enumerate(given.blocks) if block.stage.move is None]
        self.shown = next((it for it, block in enumerate(given.blocks) if block.name == shown), works[0])
        self._bodies = {body.name: body.X_BS for body in given.scene.bodies}
        self._obstacles, self._layout = dict[str, float](), Layout(given, given.variables.layout.given)
        self._pieces: Iterator[None] | None = None  # what is still to be found out at rest by this process
        self._advice, self._is_restored = Advice(), True  # whether its blocks begin as the changed cell says
        self.move(values)

    def move(self, values: Mapping[str, float], block: int | None = None) -> None:
        """Work out a block at other values; None for the one that is shown.

        Raises:
            InputError: There is no such block, or an obstacle cannot stand there.
        """
        if block is not None and not 0 <= block < len(self.given.blocks):
            raise InputError(f"block: expected a number below {len(self.given.blocks)}, got {block}")
        if block is not None and values == self.values and self._pieces is not None:
            self.shown, self._advice, self._is_settled = block, Advice(), False  # arrows are those of another block
            return
        obstacles = {it: value for it, value in values.items() if self.given.variables.is_of_obstacle(it)}
        if obstacles != self._obstacles:
            self._live, self._obstacles = _placed(self.given, obstacles), obstacles
        if block not in {None, self.shown}:
            self._advice = Advice()
        self.shown = self.shown if block is None else block
        self.version, self.values = self.version + 1, {**values}
        self._is_settled, self._is_begun, self._pieces = False, False, None
        layout = self._layout = Layout(self._live, self._live.variables.numbers(values), self._layout)
        if self.given.is_planned:
            self._executor.begin(*layout.motions(self.shown))
        elif not self._executor.is_busy:
            self._executor.begin((LAYOUT, LiveCell.planned, (self.given,)))
        self.take()

    def advise(self) -> bool:
        """Find out more of what would help, a bounded piece of work; False for nothing until some changes later."""
        return self._advice.go_on(self._layout.look(self.shown), self._live.variables, self.version)

    def restore(self, cell: Cell) -> None:
        """Work out the shown block at the values of a changed cell, whose robots begin as it says."""
        self.move(self.given.variables.written(cell))
        self._is_restored = self.given.is_planned
        look = self._layout.look(self.shown)
        stated = stated_start(cell, look.block)
        if self._is_restored and np.abs(look.motion.q[0] - stated).max() > SAME_START:
            self.given, self._live = _begun({self.shown: stated}, self.given, self._live)
            self._layout = Layout(self._live, self._layout.x)
            self.move(self.values)

    def hold(self) -> None:
        """Let later motions begin on the branches of the present ones: they are certified."""
        if self.given.is_planned:
            motions = {place: look.motion for place, look in self._layout.looks.items() if look.motion.is_begun}
            starts = {place: motion.q[0] for place, motion in motions.items()}
            self.given, self._live = _begun(starts, self.given, self._live)

    def starts(self, *, of_all: bool = False) -> dict[str, object]:
        """Where robots begin in the blocks that are known, by address; as the file says where nothing was changed.

        Args:
            of_all: Whether all blocks are to be known.
        """
        if not self.given.is_planned:
            return {}
        if of_all:
            deque(self._layout.others(), maxlen=0)
        cell, written = self.given.cell, dict[str, object]()
        for look in self._layout.looks.values():
            if look.motion.is_begun:
                written |= written_starts(cell, look.block, look.motion.q[0])
        listed = self.given.variables.listed
        is_given = all(self.values.get(it.address, it.given) == it.given for it in listed)
        return as_given(cell, written) if is_given else written

    def settle(self, cell: Cell) -> bool:
        """Find out more of what is asked at rest, a bounded piece of work; False while nothing more is to be had.

        What takes longer is left to the executor: there may be more to be had later, see ``take``.

        Args:
            cell: The cell as it would be saved.
        """
        if self._is_settled:
            return False
        if self.given.is_planned and not self._is_restored:
            self.restore(cell)
        if self.given.is_planned and not self._layout.look(self.shown).motion.is_awaited:
            self._pieces = self._pieces or self._layout.others()
            if next(self._pieces, True) is None:
                return True
            if not self._is_begun:
                self._executor.begin(*self._layout.at_rest(self.shown, cell))
                self._advice, self._is_begun = (
                    Advice.of(self._layout.look(self.shown), self._live.variables, self.version),
                    True,
                )
                return True
        if self.take():
            return True
        if self._executor.is_busy:
            return False
        self._advice = Advice.of(self._layout.look(self.shown), self._live.variables, self.version)
        self._is_settled = True
        return True

    def take(self) -> bool:
        """Take in what the executor has worked out; whether there was something, or it has come to an end."""
        was_busy = self._executor.is_busy
        results = self._executor.results()
        for result in results:
            if result.step == LAYOUT:
                self._use(result.value, self.given.blocks[self.shown].name, self.values)
            else:
                self._layout.note(result)
        return bool(results) or was_busy != self._executor.is_busy

    def refuse(self, error: InputError) -> bool:
        """Note why there is no cell at the present values; False once that is known."""
        was_settled, self._is_settled = self._is_settled, True
        self._layout.job[JOB] = Judgement(lost=reason(self.origin, error))
        return not was_settled

    def record(self) -> Record:
        """What is known of the present values."""
        listed = self.given.variables.listed
        return {
            "version": self.version,
            "values": {it.address: self.values.get(it.address, it.given) for it in listed},
            **self._layout.record(self.shown, self._bodies),
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


def _placed(given: LiveCell, obstacles: Mapping[str, float]) -> LiveCell:
    """A live cell whose obstacles stand where values of theirs say, by address."""
    if not obstacles:
        return given
    cell = given.cell.with_values(obstacles)
    return given.on(cell, placed_scene(given.scene, cell))


def _begun(starts: Mapping[int, Array], *cells: LiveCell) -> Iterator[LiveCell]:
    """Live cells whose blocks begin elsewhere, at stacked joint positions in [rad] or [m], (nq,), by their numbers."""
    for live in cells:
        blocks = (replace(block, start=starts.get(place, block.start)) for place, block in enumerate(live.blocks))
        yield replace(live, blocks=tuple(blocks))
