"""Pictures of a live cell at other values than the present ones: where everything is, and how the shown block moves."""

from dataclasses import replace

from cellplan.jobs.view.run_scene import motion_record
from cellplan.model.cell.cell import Cell
from cellplan.report.record.common import Record
from cellplan.session.answer import poses
from cellplan.session.blocks import LiveCell
from cellplan.session.motion import follow
from cellplan.session.starts import stated_start


def picture(answer: Record) -> Record:
    """That of an answer."""
    return {**{key: answer[key] for key in ("values", "poses")}, "motions": {str(answer["block"]): answer["motion"]}}


def picture_of(cell: Cell, live: LiveCell, shown: int) -> Record:
    """That of a changed cell.

    Args:
        live: The cell that it comes from.
        shown: Number of the block that is shown.
    """
    values = live.variables.written(cell)
    x, block = live.variables.numbers(values), live.blocks[shown]
    motion = follow(replace(block, start=stated_start(cell, block)), x)
    return {
        "values": {it.address: values.get(it.address, it.given) for it in live.variables.listed},
        "poses": poses(live.variables.layout.placed(x), {body.name: body.X_BS for body in live.scene.bodies}),
        "motions": {str(shown): motion_record(motion.times, motion.q, [])} if motion.is_begun else {},
    }
