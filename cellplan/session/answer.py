"""Answers of a live cell as plain records: lengths in mm, angles in deg, times in s, poses in m."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.jobs.view.describe import place_record
from cellplan.jobs.view.result import POSE_DECIMALS
from cellplan.jobs.view.run_scene import motion_record
from cellplan.model.cell.cell import Cell
from cellplan.model.units import MM
from cellplan.report.record.common import Record
from cellplan.report.record.figures import figures_of
from cellplan.scene.bodies import Kind, SceneBody, is_ground, scene_bodies
from cellplan.session.blocks import Block
from cellplan.session.figures import WITHIN, Figure, Loads, clearance_figures, joint_figures
from cellplan.session.judge import JOB, Judgement, Judgements
from cellplan.session.motion import LiveMotion
from cellplan.session.seams import branch_figures, depth_figures, seam_figures

PLANNED: Final = "planned"
BREAKS_OFF: Final = "breaks off"
FAILS: Final = "fails"
CERTIFIED: Final = "certified"
UNKNOWN: Final = "unknown"
WORKING_OUT: Final = "working out"
SHARE_DECIMALS: Final = 5
TIME_DECIMALS: Final = 6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Look:
    """A block at some values: its motion and its figures, none while it is awaited, and what is known of it at rest."""

    block: Block
    motion: LiveMotion
    loads: Loads
    figures: tuple[Figure, ...]
    judgement: Judgement | None = None  # None while it moves

    @classmethod
    def at(cls, block: Block, motion: LiveMotion, near: "Look | None" = None) -> "Look":
        """A block with its motion; one nearby makes it quicker."""
        loads = Loads.of(block.cell, motion)
        if motion.is_awaited:
            return cls(block=block, motion=motion, loads=loads, figures=())
        figures = [*joint_figures(block.cell, motion, loads)]
        if motion.is_begun:
            spare = WITHIN if near is None or near.motion.is_awaited else near.spare
            figures += clearance_figures(block, motion, spare)
            figures += [*seam_figures(block, motion), *branch_figures(block, motion), *depth_figures(block, None)]
        return cls(block=block, motion=motion, loads=loads, figures=tuple(figures))

    def judged(self, judgement: Judgement) -> "Look":
        """The same with what is known at rest."""
        figures = [_reported(it, judgement) for it in self.figures]
        if judgement.report is not None:
            figures = [it for it in figures if it.name != "tool depth"] + [*depth_figures(self.block, judgement.report)]
        return replace(self, judgement=judgement, figures=tuple(figures))

    @property
    def spare(self) -> float:
        """Smallest clearance beyond what is demanded in [m]; infinite where nothing is near."""
        clear = next((it for it in self.figures if it.name == "clearance" and it.value is not None), None)
        return np.inf if clear is None else ((clear.value or 0.0) - (clear.limit or 0.0)) / MM

    @property
    def state(self) -> str:
        """Whether its motion breaks off, fails or is planned; without a proof nothing is more than planned."""
        known = self.judgement
        if known is None and self.motion.is_awaited:
            return WORKING_OUT
        if (known is None and not self.motion.is_followed) or (known is not None and known.lost):
            return BREAKS_OFF
        if known is not None:
            return PLANNED if known.passed else FAILS
        return PLANNED if all(figure.is_met for figure in self.figures) else FAILS

    @property
    def words(self) -> str:
        """What becomes of it, in one line."""
        if self.judgement is not None:
            return self._words_at_rest(self.judgement)
        motion = self.motion
        if motion.is_awaited:
            return "the motion is being planned"
        if motion.lost_at is not None:
            lost = f"a tool loses its path at {motion.lost_at:.3f} s"
            return motion.why or (lost if motion.is_begun else "the start of a path is out of reach")
        missed = [figure.words for figure in self.figures if not figure.is_met]
        return "; ".join(missed) or "all limits are kept at the nodes"

    def _words_at_rest(self, known: Judgement) -> str:
        """The same of what is known at rest."""
        if known.lines:
            return several(known.lines)
        if known.lost or not known.is_done:
            return known.lost or f"all limits {'and the clearance ' if known.is_clear else ''}are kept"
        return "all checks pass on a coarser clock; certify proves it on that of the cell"

    @property
    def record(self) -> Record:
        """What an answer says of the shown block, but for its state."""
        motion = self.motion
        worst = self.loads.worst(self.block.cell)[: 0 if motion.is_awaited else None]
        return {
            "figures": [figure.record for figure in self.figures],
            "lost_at": motion.lost_at,
            "motion": motion_record(motion.times, motion.q, []),
            "worst": {
                "times": np.round(motion.times[: len(worst)], TIME_DECIMALS).tolist(),
                "values": (np.round(worst, SHARE_DECIMALS) + 0.0).tolist(),
            },
        }

    @property
    def strip(self) -> Record:
        """What stands of it among all blocks."""
        return {"name": self.block.name, "state": self.state, "text": self.words}


def several(lines: Sequence[str]) -> str:
    """The first of some lines, and how many more there are."""
    return f"{lines[0]}{f' (and {len(lines) - 1} more)' if len(lines) > 1 else ''}"


def verdict_of(look: Look, job: Judgements, failure: str) -> Record:
    """State and verdict of the job, and all reasons: of the block that is shown; where it passes, of all other phases.

    Args:
        job: What is known of the whole job at rest.
        failure: Why it was not judged; empty where it was.
    """
    state, words, reasons = look.state, look.words, [] if look.judgement is None else [*look.judgement.lines]
    others = [f"{name}: {line}" for name, known in job.items() for line in known.lines if name != look.block.name]
    if JOB in job:
        state, words = BREAKS_OFF, job[JOB].lost
    elif state == PLANNED and others:
        state, words, reasons = FAILS, several(others), others
    elif failure:
        state, words = (UNKNOWN, failure) if state == WORKING_OUT else (state, f"{words}; not judged: {failure}")
    return {"state": state, "verdict": f"{state}: {words}", "reasons": reasons}


REPORTED: Final[Mapping[str, tuple[str, str, float]]] = {
    "margin": ("min_margin_deg", "min_margin_joint", 1.0),
    "velocity": ("max_velocity_ratio", "max_velocity_joint", 100.0),
    "acceleration": ("max_acceleration_ratio", "max_acceleration_joint", 100.0),
}  # keys of the figures of reports, and their scale here


def _reported(figure: Figure, judgement: Judgement) -> Figure:
    """A figure as a report has it; whether a clearance is kept, as the certificate says."""
    if figure.name == "clearance" and judgement.is_clear is not None:
        return replace(figure, is_met=judgement.is_clear)
    if judgement.report is None or figure.name not in REPORTED:
        return figure
    value_key, subject_key, scale = REPORTED[figure.name]
    figures = figures_of([judgement.report])
    value, subject = figures.recorded(value_key), figures.recorded(subject_key)
    if value is None:
        return figure
    is_met = figure.limit is None or (value >= 0.0 if figure.name == "margin" else scale * value <= figure.limit)
    return replace(figure, value=scale * float(value), binds=subject or figure.binds, is_met=is_met)


def poses(cell: Cell, given: Mapping[str, Array]) -> Record:
    """Where bases, tools and bodies are.

    Args:
        cell: The cell as its variables have it.
        given: Poses of the bodies in the scene that the page was given, in its order, by name. Of them only rods and
            obstacles may be elsewhere.
    """
    bodies = sorted(scene_bodies(cell), key=is_ground)
    places = {name: place for place, name in enumerate(given)}
    return {
        "bases": [numbers(robot.X_WB) for robot in cell.robots],
        "tools": [numbers(robot.model.X_BF @ robot.tool.X_FT) for robot in cell.robots],
        "bodies": {
            str(places[body.name]): numbers(body.X_BS)
            for body in bodies
            if body.name in places and _may_be_elsewhere(cell, body)
        },
        "part": place_record(cell, 0.0)["pose"],
    }


def _may_be_elsewhere(cell: Cell, body: SceneBody) -> bool:
    """Whether a body may have another pose on its link, or in the world, than pages were given at some time."""
    if body.kind is Kind.OBSTACLE:
        return not is_ground(body)
    return body.kind is Kind.TOOL and body.robot is not None and cell.robot(body.robot).tool.rod is not None


def numbers(X: Array) -> list[float]:
    """A pose of shape (4, 4) as sixteen numbers, row by row."""
    return [number + 0.0 for number in np.round(X, POSE_DECIMALS).ravel().tolist()]


def strip_of(blocks: Sequence[Block], looks: Mapping[int, Look]) -> list[Record]:
    """All blocks, those without a motion as unknown."""
    unknown: dict[str, Any] = {"state": UNKNOWN, "text": "not asked yet"}
    return [looks[place].strip if place in looks else {"name": it.name, **unknown} for place, it in enumerate(blocks)]
