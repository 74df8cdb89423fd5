"""Lines of the page on Vargas, Leite and Costa 2012."""

from collections.abc import Callable

from reproduction.runs import Numbers
from reproduction.verdicts import ALONE, CHOSEN, NOT, Row, alone, claim, shown

SHORT = {"filtered_inverse": "I", "filtered_inverse_ii": "II", "damped_least_squares": "DLS"}
FILTERED = ("filtered_inverse", "filtered_inverse_ii")
NIL = 1.0  # [mm] practically nil in a plot whose axis ends at 0.6 m
DAMPED_BELOW = 1.0  # w0
FASTEST = 4.0  # [rad/s]
PRECISE = 1e-3  # [-] of a closed form
STUCK = 0.5  # [m] half of the way that is to be made from a stretched start


def case_rows(case: int, numbers: Numbers, signs: Numbers) -> list[Row]:
    """The claims of one case; what the mirror image of its start gives, where the figures do not tell the two apart."""
    builders: dict[int, Callable[[Numbers], list[Row]]] = {1: _first, 2: _second, 3: _third}
    rows = builders[case](numbers)
    return rows if case == 1 else [*rows, _mirrored(signs[f"case_{case}"])]


def _mirrored(numbers: Numbers) -> Row:
    """Errors, distances and speeds from the mirror image of the start."""
    return alone(
        "the same from the mirror image of the start, (pi/4, -pi/3, -pi/3)",
        f"error {_all(numbers, 'error_mm', 'mm')}; from the point {_all(numbers, 'nearest_mm', 'mm')}; "
        f"at most {_all(numbers, 'speed_rad_s', 'rad/s')}",
    )


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
        Row(
            what="joint speeds (section 4.3)",
            published="< 4 rad/s",
            ours=_all(numbers, "speed_rad_s", "rad/s"),
            difference=f"{shown(FASTEST - fastest)} rad/s below; the signs of the start were chosen by it",
            verdict=CHOSEN if fastest < FASTEST else NOT,
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


def filter_rows(numbers: Numbers) -> list[Row]:
    """What the text says beside the figures of the three cases."""
    return [*_scalar_rows(numbers["scalar"]), *_setting_rows(numbers), *_outlook_rows(numbers)]


def _scalar_rows(scalar: Numbers) -> list[Row]:
    """The filter of one function."""
    off = abs(scalar["time_constant_s"] - scalar["expected_s"])
    end = abs(scalar["theta_at_end"] / scalar["closed_form_at_end"] - 1.0)
    return [
        claim(
            "one constant k: time constant of the filter",
            "1 / (gamma k²)",
            f"{shown(scalar['time_constant_s'])} s, the formula {shown(scalar['expected_s'])} s (gamma 25, k 0.5)",
            holds=off < PRECISE * scalar["expected_s"],
        ),
        claim(
            "k that falls to zero: theta grows, slowly and without end",
            "no escape in finite time",
            f"{shown(scalar['theta_at_end'])} at {shown(scalar['end_s'])} s, as the square root of time",
            holds=end < PRECISE and scalar["value_error"] < PRECISE,
        ),
    ]


def _setting_rows(numbers: Numbers) -> list[Row]:
    """Settings of damped least squares, and the one gain of the filter."""
    damping, gain = numbers["damping"], numbers["gain"]
    printed = damping["printed"]
    rows = [
        claim(
            f"DLS in case II with half of {name}",
            "comes nearer to the singular point",
            f"{item['nearest_mm']:.4g} mm instead of {printed['nearest_mm']:.4g} mm, error {shown(item['error_mm'])} "
            f"instead of {shown(printed['error_mm'])} mm",
            holds=item["nearest_mm"] < printed["nearest_mm"],
        )
        for name, item in (("lambda_0", damping["lambda0_halved"]), ("w_0", damping["w0_halved"]))
    ]
    errors = ", ".join(f"{shown(gain[of]['I']['error_mm'])} and {shown(gain[of]['II']['error_mm'])}" for of in gain)
    return [
        *rows,
        Row(
            what=f"gains {', '.join(gain)} per second of the filter in case II: error of laws I and II",
            published="-",
            ours=f"{errors} mm",
            difference="a larger gain, a smaller error",
            verdict=ALONE,
        ),
    ]


def _outlook_rows(numbers: Numbers) -> list[Row]:
    """Section 5: singular starts, orientation, goals that exclude each other, and the cost."""
    start, turn, left = numbers["singular_start"], numbers["orientation"], numbers["unreachable"]
    place, hand = left["position"], left["orientation"]
    planar, four = numbers["products"]["planar"], numbers["products"]["four_robots"]
    return [
        claim(
            "stretched start, Theta = 0",
            "the filter has too little rank, and fails",
            f"stays stretched: {shown(start['zero_I_m'])} m off with I, {shown(start['zero_II_m'])} m with II",
            holds=min(start["zero_I_m"], start["zero_II_m"]) > STUCK,
        ),
        claim(
            "the same, Theta with independent columns, law I",
            "goes well",
            f"{shown(1e3 * start['chosen_I_m'])} mm off",
            holds=1e3 * start["chosen_I_m"] < NIL,
        ),
        claim("the same, law II", "fails", f"{shown(start['chosen_II_m'])} m off", holds=start["chosen_II_m"] > STUCK),
        claim(
            "position and orientation at once",
            "similar performance",
            f"I {shown(turn['I_mm'])} mm and {shown(turn['I_rad'])} rad, "
            f"II {shown(turn['II_mm'])} mm and {shown(turn['II_rad'])} rad",
            holds=max(turn["I_mm"], turn["II_mm"]) < NIL,
        ),
        claim(
            "position and orientation that cannot both be reached",
            "gains give one of them priority",
            f"{shown(place['position_m'])} m and {shown(place['orientation_rad'])} rad with ten times the gain on "
            f"position, {shown(hand['position_m'])} m and {shown(hand['orientation_rad'])} rad with it on orientation",
            holds=place["position_m"] < hand["position_m"] and hand["orientation_rad"] < place["orientation_rad"],
        ),
        claim(
            "cost against DLS: multiplications of one step",
            "more efficient, as no matrix is inverted",
            f"{planar['filtered']:g} against {planar['damped']:g} for 2 rows and 3 joints, "
            f"{four['filtered']:g} against {four['damped']:g} for 18 and 24",
            holds=planar["filtered"] < planar["damped"] and four["filtered"] < four["damped"],
            difference=f"{shown(planar['filtered'] / planar['damped'])} and "
            f"{shown(four['filtered'] / four['damped'])} times as many",
        ),
    ]
