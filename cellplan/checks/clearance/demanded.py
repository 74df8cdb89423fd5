"""Demanded clearance: whether every pair of a class keeps the distance that is demanded of it."""

from typing import Final

import numpy as np

from cellplan.certify.survey import Survey, proved_distance
from cellplan.checks.clearance.contacts import seconds
from cellplan.collision.distance import TIGHT
from cellplan.geometry.transforms import Array
from cellplan.model.report import Check, ClearanceClass, ClearanceMinimum
from cellplan.model.units import MM

EXACT: Final = 1e-4 - 2.0 * TIGHT  # [m] a bound this near to what was measured is a smallest distance, to 0.1 mm


def demanded_clearance(seen: Survey, times: Array, kind: ClearanceClass, found: ClearanceMinimum) -> Check:
    """Whether every pair of a class keeps what is demanded of it; named is the one that keeps least of it.

    Where the accuracy of bodies is added to the demand, that is not always the pair that comes nearest.

    Args:
        seen: What was found.
        times: Instants of the samples in [s], shape (N,).
        kind: The class.
        found: Its smallest distance; zero where a pair touches.
    """
    checks, rows = seen.scene.cell.checks, seen.rows(kind).tolist()
    pair, at_s, distance = found.pair or ("", ""), found.at_s or 0.0, float(found.minimum or 0.0)
    demand, words, is_exact = checks.clearance, "", found.exact
    if checks.adds_accuracy and distance > 0.0 and rows:
        row = min(rows, key=lambda row: proved_distance(seen, row) - seen.scene.pairs[row].demand)
        pair, demand = seen.scene.names(seen.scene.pairs[row]), seen.scene.pairs[row].demand
        at_s, distance = float(seconds(times, np.array([seen.found[row].at]))[0]), proved_distance(seen, row)
        is_exact = seen.found[row].distance - distance <= EXACT
        added = demand - checks.clearance
        words = f" ({MM * checks.clearance:.1f} mm, and {MM * added:.1f} mm for the accuracy of both bodies)"
    shown = np.floor(10.0 * MM * distance) / 10.0  # rounded down: never more than there is
    least = "" if is_exact else "at least "
    kept = f"{pair[0]} to {pair[1]} {least}{shown:.1f} mm at {at_s:.3f} s"
    return Check(
        name="clearance",
        subject=str(kind),
        passed=bool(distance >= demand),
        value=MM * distance,
        limit=MM * demand,
        unit="mm",
        at_s=at_s,
        message=f"clearance {kind}: {kept}, required {MM * demand:.1f} mm{words}",
    )
