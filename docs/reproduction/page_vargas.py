"""Lines of the page on Vargas, Leite and Costa 2012."""

from collections.abc import Callable

from reproduction.runs import Numbers
from reproduction.verdicts import ALONE, Row, claim, shown

SHORT = {"filtered_inverse": "I", "filtered_inverse_ii": "II", "damped_least_squares": "DLS"}
FILTERED = ("filtered_inverse", "filtered_inverse_ii")
NIL = 1.0  # [mm] practically nil in a plot whose axis ends at 0.6 m
DAMPED_BELOW = 1.0  # w0
FASTEST = 4.0  # [rad/s]


def case_rows(case: int, numbers: Numbers) -> list[Row]:
    """The claims of one case."""
    builders: dict[int, Callable[[Numbers], list[Row]]] = {1: _first, 2: _second, 3: _third}
    return builders[case](numbers)


def _all(numbers: Numbers, key: str, unit: str) -> str:
    """One figure of all methods."""
    return ", ".join(f"{name} {shown(numbers[method][key])}" for method, name in SHORT.items()) + f" {unit}"


def _first(numbers: Numbers) -> list[Row]:
    errors = [numbers[method]["error_mm"] for method in SHORT]
    least = numbers["damped_least_squares"]["manipulability_min"]
    apart = numbers["apart_mm"]
    return [
        claim(
            "error after the transient (Fig. 6)",
            "practically nil",
            _all(numbers, "error_mm", "mm"),
            holds=max(errors) < NIL,
        ),
        claim("the three paths (Fig. 5)", "practically coincide", f"within {shown(apart)} mm", holds=apart < NIL),
        claim(
            "damping (section 4.1)",
            "never: w stays above w0 = 1",
            f"never: w >= {shown(least)}",
            holds=least > DAMPED_BELOW,
        ),
    ]


def _second(numbers: Numbers) -> list[Row]:
    dls = numbers["damped_least_squares"]
    less = all(numbers[method]["error_mm"] < dls["error_mm"] for method in FILTERED)
    nearer = all(numbers[method]["kept_away_mm"] < dls["kept_away_mm"] for method in FILTERED)
    worse = all(numbers[method]["condition_min"] < dls["condition_min"] for method in FILTERED)
    return [
        claim(
            "error near the singular point (Fig. 10)",
            "filtered less than DLS",
            _all(numbers, "error_mm", "mm"),
            holds=less,
        ),
        claim(
            "kept away from it beyond the path's 100 mm (Fig. 9)",
            "filtered nearer than DLS",
            _all(numbers, "kept_away_mm", "mm"),
            holds=nearer,
        ),
        claim("smallest c (Fig. 11)", "filtered below DLS", _all(numbers, "condition_min", ""), holds=worse),
        _with_squared_damping(numbers),
    ]


def _with_squared_damping(numbers: Numbers) -> Row:
    """What becomes of the claim about errors where Eq. 9 is read with the square of lambda."""
    first, second = (numbers[method]["error_mm"] for method in FILTERED)
    damped = numbers["squared"]["error_mm"]
    return Row(
        what="the same with lambda^2 I, which is not printed",
        published="-",
        ours=f"I {shown(first)}, II {shown(second)}, DLS {shown(damped)} mm",
        difference="the claim fails for law II" if second > damped > first else "the claim holds for both",
        verdict=ALONE,
    )


def _third(numbers: Numbers) -> list[Row]:
    away = min(numbers[method]["nearest_mm"] for method in SHORT)
    fastest = max(numbers[method]["speed_rad_s"] for method in SHORT)
    late = max(numbers[method]["late_error_mm"] for method in SHORT)
    first, second = (numbers[method] for method in FILTERED)
    return [
        claim(
            "distance from the singular point (Fig. 13)",
            "all avoid it",
            _all(numbers, "nearest_mm", "mm"),
            holds=away > NIL,
        ),
        claim(
            "joint speeds (section 4.3)",
            "< 4 rad/s",
            _all(numbers, "speed_rad_s", "rad/s"),
            holds=fastest < FASTEST,
            difference=f"{shown(FASTEST - fastest)} rad/s below",
        ),
        claim(
            "error from 30 s on (Fig. 14)", "back on the path", _all(numbers, "late_error_mm", "mm"), holds=late < NIL
        ),
        claim(
            "law II leaves the point more smoothly than law I: the path (Fig. 13)",
            "smoother",
            f"its heading turns by {shown(first['turned_deg'])} deg with I, {shown(second['turned_deg'])} deg with II",
            holds=second["turned_deg"] < first["turned_deg"],
        ),
        claim(
            "the same: the joints",
            "smoother",
            f"at most {shown(first['late_speed_rad_s'])} rad/s with I, {shown(second['late_speed_rad_s'])} rad/s with "
            f"II; {shown(first['late_acceleration_rad_s2'])} and {shown(second['late_acceleration_rad_s2'])} rad/s²",
            holds=second["late_speed_rad_s"] < first["late_speed_rad_s"]
            and second["late_acceleration_rad_s2"] < first["late_acceleration_rad_s2"],
            difference="II is faster",
        ),
    ]
