"""Base reactions in the record of a run."""

from collections.abc import Iterable
from typing import Annotated, Final, TypedDict

from cellplan.model.robot.base_reaction import BaseReaction, PeakLoad
from cellplan.report.record.common import Number, Record, number

PEAKS: Final = {"vertical": "n", "horizontal": "n", "tilting": "nm", "turning": "nm", "tilting_at_rest": "nm"}


class BaseReactionRecord(TypedDict):
    """Largest forces and moments of a robot on what it stands on; moments about the origin of its base."""

    weight_n: Annotated[Number, "weight of the robot and of what it carries"]
    vertical_n: Annotated[Number, "largest force along the vertical"]
    vertical_at_s: Annotated[Number, "its time"]
    horizontal_n: Annotated[Number, "largest force across it"]
    horizontal_at_s: Annotated[Number, "its time"]
    tilting_nm: Annotated[Number, "largest moment about a horizontal axis"]
    tilting_at_s: Annotated[Number, "its time"]
    turning_nm: Annotated[Number, "largest moment about the vertical"]
    turning_at_s: Annotated[Number, "its time"]
    tilting_at_rest_nm: Annotated[Number, "largest moment about a horizontal axis by weights alone"]
    tilting_at_rest_at_s: Annotated[Number, "its time"]


def base_reactions_record(reactions: Iterable[BaseReaction | None]) -> dict[str, BaseReactionRecord]:
    """Base reactions by robot."""
    return {it.robot: _reaction_record(it) for it in reactions if it is not None}


def _reaction_record(reaction: BaseReaction) -> BaseReactionRecord:
    return {
        "weight_n": number(reaction.weight),
        "vertical_n": number(reaction.vertical.size),
        "vertical_at_s": number(reaction.vertical.at_s),
        "horizontal_n": number(reaction.horizontal.size),
        "horizontal_at_s": number(reaction.horizontal.at_s),
        "tilting_nm": number(reaction.tilting.size),
        "tilting_at_s": number(reaction.tilting.at_s),
        "turning_nm": number(reaction.turning.size),
        "turning_at_s": number(reaction.turning.at_s),
        "tilting_at_rest_nm": number(reaction.tilting_at_rest.size),
        "tilting_at_rest_at_s": number(reaction.tilting_at_rest.at_s),
    }


def read_base_reactions(record: Record) -> dict[str, BaseReaction]:
    """Base reactions by robot, of a record that may have none."""
    known = {}
    for robot, entry in record.get("base_reactions", {}).items():
        peaks = {name: PeakLoad(entry[f"{name}_{unit}"], entry[f"{name}_at_s"]) for name, unit in PEAKS.items()}
        known[robot] = BaseReaction(robot=robot, weight=entry["weight_n"], **peaks)
    return known
