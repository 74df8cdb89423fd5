"""The verdict on a program in a few words: the first finding, or the smallest clearance."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from cellplan.model.units import MM, rounded_down

if TYPE_CHECKING:
    from cellplan.model.report.report import Report


def verdict(reports: Sequence["Report"]) -> str:
    """Checks that passed and the smallest clearance, or checks that failed and the first of them."""
    checks = [check for report in reports for check in report.checks]
    failed = [check.message for check in checks if not check.passed]
    if failed:
        return f"failed: {len(failed)} of {len(checks)} checks; {failed[0]}"
    distances = (minimum for report in reports for minimum in report.clearance.minima.values())
    known = [
        (distance.minimum, distance.pair)
        for distance in distances
        if distance.minimum is not None and distance.pair is not None
    ]
    if not known:
        return f"passed: {len(checks)} checks"
    least, pair = min(known)
    return f"passed: {len(checks)} checks; smallest clearance {rounded_down(MM * least):.1f} mm, {' - '.join(pair)}"
