"""What a report tells of the proof of its distances: the closest pairs, the assumption, and what it took."""

from cellplan.model.report import ASSUMPTION, MARGIN, ClearanceReport
from cellplan.report.record.run import Record, number


def closest_pairs_record(clearance: ClearanceReport) -> list[Record]:
    """The closest pairs that are to keep the demanded distance, nearest first."""
    return [
        {
            "pair": list(close.pair),
            "class": str(close.clearance_class),
            "distance_mm": number(1e3 * close.distance),
            "at_s": number(close.at_s),
        }
        for close in clearance.closest
    ]


def clearance_proof_record(clearance: ClearanceReport) -> Record:
    """On what assumption distances hold between the samples, what could not be proved, and what the proof took."""
    return {
        "assumption": ASSUMPTION,
        "margin": MARGIN,
        "not_certified": [list(pair) for pair in clearance.not_certified],
        "distance_queries": clearance.distance_queries,
        "contact_queries": clearance.contact_queries,
        "cut_steps": clearance.cut_steps,
    }
