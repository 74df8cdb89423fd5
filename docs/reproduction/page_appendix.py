"""Lines of the page on the appendices of Ribeiro 2010, and on load sharing."""

from reproduction.runs import Numbers
from reproduction.verdicts import Row, alone, claim, shown

RELEVANT = 1e-6  # [m/s per rad/s] of a Jacobian: more than the rounding of central differences
FIRST_ORDER = 0.05  # [-] by which a drift may differ from one that is proportional to the step
CONVERGED = 0.01  # [-] of the drift without feedback
KEPT_MM = 0.003  # [mm] tolerance of the grasp in the cell


def drift_rows(numbers: Numbers) -> list[Row]:
    """Appendices C, D and E in the plane."""
    gaps, one, two = numbers["jacobian"], numbers["alone"], numbers["together"]
    free, fed, double = (one[name]["error_mm"] for name in ("euler", "feedback", "double_step"))
    ratio = double / free
    e15, e16 = two["e15"]["error_mm"], two["e16"]["error_mm"]
    return [
        claim(
            "N_p^-1 N_s is the Jacobian, with N_p of Eq. E.8",
            "equal",
            "equal to differences of the pose" if gaps["e8"] < RELEVANT else f"off by {shown(gaps['e8'])}",
            holds=gaps["e8"] < RELEVANT,
        ),
        claim(
            "the same with N_p as Eq. C.19 prints it",
            "equal",
            f"off by {shown(gaps['c19'])}",
            holds=gaps["c19"] < RELEVANT,
            difference="its last two columns are misprinted",
        ),
        claim(
            "one arm, 40 s: Euler's method alone drifts",
            "strays from the desired place",
            f"{shown(free)} mm; {shown(double)} mm with twice the step",
            holds=free > 0.0 and abs(ratio - 2.0) < FIRST_ORDER * 2.0,
        ),
        claim(
            "the same with feedback, K = 500 per second",
            "converges",
            f"{shown(fed)} mm",
            holds=fed < CONVERGED * free,
        ),
        claim(
            "two arms, 12 s: without feedback",
            "strays from the desired place",
            f"{shown(e15)} mm, {shown(two['e15']['end_mm'])} mm at the end",
            holds=e15 > e16,
        ),
        _pair_fed(e15, e16),
    ]


def _pair_fed(free: float, fed: float) -> Row:
    """Two arms with feedback."""
    return claim(
        "two arms with feedback, K = 500 per second", "converges", f"{shown(fed)} mm", holds=fed < CONVERGED * free
    )


def sharing_rows(numbers: Numbers) -> list[Row]:
    """Two holders of one part."""
    held, turned = numbers["position_mm"], numbers["turn_deg"]
    travel = numbers["travel_deg"]
    return [
        claim(
            "second holder: its grasp stays where it is in the part",
            "distance constant, relative velocity zero",
            f"moves by at most {shown(held)} mm and {shown(turned)} deg",
            holds=held < KEPT_MM,
        ),
        alone(
            "travel of the two holders",
            ", ".join(f"{robot} {shown(angle)} deg" for robot, angle in travel.items()),
        ),
    ]
