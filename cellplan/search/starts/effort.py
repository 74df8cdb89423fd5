"""Effort: how much is drawn, compared and judged for one start of a search."""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True, kw_only=True)
class StartEffort:
    """Counts; larger ones find starts of harder cells, and take longer."""

    settings: int = 400  # configurations of the holder that are drawn for a part at rest
    matched: int = 150  # of these, free of contact, that are compared by what operators reach of them
    matches: int = 300  # configurations of each operator for that
    settings_tried: int = 4  # places of the part at rest, one after the other until a combination follows all paths
    bases: int = 1500  # bases of an operator that are drawn
    per_base: int = 6  # configurations per base that are drawn; the best matching ones are taken
    templates: int = 100  # of these with tools, tilts and heights of their own; places and yaws follow from the path
    pool: int = 40  # bases of an operator that are kept
    leading: int = 12  # bases of an operator beside which those that follow it are sought
    following: int = 4  # of the ones that follow for each
    combinations: int = 256  # of operators that are judged together
    judged: int = 24  # combinations of which distances are asked
    keys: int = 9  # nodes at which they are asked
    handed_out: int = 3  # of these combinations that are asked once more, exactly
    more_keys: int = 33  # nodes at which those are asked
    random: int = 16  # random layouts that are drawn for one start
    every_random: int = 8  # of the sampled starts every so manieth is drawn at random
    postures: int = 48  # random configurations of each operator; finds all eight branches of an arm with six joints
    branches: int = 8  # of an operator that are combined
    branch_combinations: int = 64  # of branches of all operators


EFFORT: Final = StartEffort()
