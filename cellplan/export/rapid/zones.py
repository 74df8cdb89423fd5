"""Zones of RAPID: which size each row gets, so that it is rounded within a share of its segments, and their data.

A zone is the distance of the tool from the target at which the next motion begins; a unit without a tool has zones of
its axes. Sizes are taken from a fixed scale of ten to the decade, always the next smaller one. The corner path is a
parabola from the edge of the zone, and a zone larger than half the distance to a neighbouring target is reduced to that
half; during joint movement it "may differ somewhat" (ABB, RAPID reference manual, zonedata).
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.export.corners import chosen_shares, moves, row_shares
from cellplan.export.joints import from_numbers, to_numbers
from cellplan.export.rapid.units import ZONES, RapidUnit, zone_name
from cellplan.export.text import fixed
from cellplan.export.zones import axis_zones, on_scale, tool_zones
from cellplan.geometry.arrays import Array, Flags
from cellplan.model.exported import ExportJob, ProgramRows, Promise, RobotRows
from cellplan.model.units import MM

SMALLEST_TOOL: Final = 50  # [um] a smaller zone of a tool is a stop
TURN: Final = 0.1  # [deg] of a turn for each [mm] of a zone, as the zones of the language have it


def row_zones(job: ExportJob, program: ProgramRows, units: Sequence[RapidUnit]) -> dict[str, list[int]]:
    """Size of the zone of each row in [um] or [mdeg], 0 for a stop, by robot.

    Robots that are in step stop at the same rows: at those where one of them that moves has no zone. One that stands
    has the smallest zone at the others.
    """
    shares = row_shares(job, program)
    sizes = {
        (name := unit.robot.name): _sizes(
            unit, program.robots[name], shares[name], chosen=chosen_shares(job, program.robots[name])
        )
        for unit in units
    }
    if job.frame.promise is Promise.SYNCHRONISED:
        passed: Flags = np.logical_and.reduce(
            [
                (shares[name] > 0.0) & ((radii > 0) | ~np.any(moves(program.robots[name]), axis=0))
                for name, radii in sizes.items()
            ]
        )
        sizes = {name: np.where(passed, np.maximum(radii, ZONES[0]), 0) for name, radii in sizes.items()}
    return {name: radii.tolist() for name, radii in sizes.items()}


def rows_at_part(rows: RobotRows) -> Flags:
    """Rows that are stated as targets on the part; never the first, which is reached before robots are in step."""
    if rows.X_PT is None:
        return np.zeros(len(rows), dtype=bool)
    is_at_part = np.all(np.isfinite(rows.X_PT), axis=(1, 2))
    is_at_part[0] = False
    return is_at_part


def zone_data(unit: RapidUnit, sizes: Sequence[int]) -> Iterator[str]:
    """Declarations of the zones of a robot, the smallest first."""
    for size in sorted(set(sizes) - {0}):
        reach = fixed(size / 1000.0, 3)
        turn = fixed(TURN * size / 1000.0, 4) if unit.has_tool else reach
        yield f"CONST zonedata {zone_name(size)} := [FALSE,{reach},{reach},{reach},{turn},{reach},{turn}];"


def _sizes(unit: RapidUnit, rows: RobotRows, shares: Array, *, chosen: Array) -> np.ndarray:
    """Sizes of the zones of a robot by itself, on the scale, shape (N,)."""
    q = from_numbers(unit.robot, to_numbers(unit.robot, rows.q, decimals=unit.decimals))  # as it is read
    if not unit.has_tool:
        return on_scale(np.maximum(1000.0 * axis_zones(unit.robot, q, chosen), ZONES[0]) * (shares > 0.0), ZONES)
    sizes = on_scale(1000.0 * MM * _tool_zones(unit, replace(rows, q=q), shares), ZONES)
    return np.where(sizes >= SMALLEST_TOOL, sizes, 0)


def _tool_zones(unit: RapidUnit, rows: RobotRows, shares: Array) -> Array:
    """Zones of a tool in [m]; none where a motion of joints meets one on the part, shape (N,)."""
    zones = tool_zones(unit.robot, rows.q, shares)
    at_part = rows_at_part(rows)
    if rows.X_PT is None or not np.any(at_part):
        return zones
    whole = at_part.copy()
    whole[1:-1] &= at_part[:-2] & at_part[2:]
    joint = ~at_part
    joint[1:-1] &= joint[:-2] & joint[2:]
    lengths = np.linalg.norm(np.diff(np.where(at_part[:, None], rows.X_PT[:, :3, 3], 0.0), axis=0), axis=1)
    on_part = np.zeros(len(zones))
    on_part[1:-1] = shares[1:-1] * np.minimum(lengths[:-1], lengths[1:])
    return np.where(joint, zones, np.where(whole, np.minimum(zones, on_part), 0.0))
