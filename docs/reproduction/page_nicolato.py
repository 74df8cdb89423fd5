"""Lines of the page on Nicolato 2007."""

from reproduction.runs import Numbers
from reproduction.verdicts import CHOSEN, CIRCULAR, NOT, Row, alone, circular, claim, shown

ONSET = 2.85  # [s]
STEP = 0.01  # [s] of the circle
PRINTED = 4.5e-8  # [m] printed error of the search
LARGE = 1e-3  # [m] an error that is large beside a tolerance of 1e-7 m
SEARCHED = 1e-5  # [m] tolerance of section 4.2
CLOSED = 0.001  # [deg] drift of a joint that comes back


SMOOTH = 2.0  # [-] times the acceleration of the smoothest motion on the same path: more is not smooth


def circle_rows(numbers: Numbers) -> list[Row]:
    """Search and damped least squares on the circle."""
    search, dls, upwards = numbers["search"], numbers["dls"], numbers["upwards"]
    onset = dls["damped_from_s"]
    return [
        circular("search: largest error", search["error_m"], PRINTED, "m"),
        *_smooth_rows("through the singular point", search, numbers["printed"]),
        Row(
            what="DLS: damping sets in (the plane of the circle was chosen for it)",
            published=f"about {ONSET:g} s",
            ours=f"{onset:g} s",
            difference=f"{onset - ONSET:+.2g} s",
            verdict=CHOSEN if abs(onset - ONSET) <= STEP else NOT,
        ),
        claim(
            "DLS: error near the singular point",
            "grows markedly",
            f"{shown(1e3 * dls['error_m'])} mm at {shown(dls['error_at_s'])} s",
            holds=dls["error_m"] > LARGE,
        ),
        claim(
            "DLS: joint speeds",
            "not smooth, but bounded",
            f"at most {shown(dls['speed_rad_s'])} rad/s and {shown(dls['acceleration_rad_s2'])} rad/s²",
            holds=dls["acceleration_rad_s2"] > 2 * search["acceleration_rad_s2"],
        ),
        alone(
            "circle begun towards +z: ours, with momentum and passes combined",
            f"{shown(upwards['search']['error_m'])} m, {_pace(upwards['search'])}",
        ),
        claim(
            "circle begun towards +z: DLS",
            "error grows markedly, not smooth",
            f"{shown(1e3 * upwards['dls']['error_m'])} mm, at most {shown(upwards['dls']['speed_rad_s'])} rad/s and "
            f"{shown(upwards['dls']['acceleration_rad_s2'])} rad/s²",
            holds=upwards["dls"]["error_m"] > LARGE
            and upwards["dls"]["acceleration_rad_s2"] > SMOOTH * search["acceleration_rad_s2"],
        ),
    ]


def _smooth_rows(where: str, ours: Numbers, printed: Numbers) -> list[Row]:
    """Whether the joints move smoothly: ours, and Algorithm 1 as printed."""
    return [
        claim(
            f"search as printed: smooth {where}",
            "smooth",
            _pace(printed),
            holds=printed["acceleration_rad_s2"] < SMOOTH * ours["acceleration_rad_s2"],
            difference=f"{shown(printed['acceleration_rad_s2'] / ours['acceleration_rad_s2'])} times ours",
        ),
        alone(f"ours, with momentum and passes combined: smooth {where}", _pace(ours)),
        alone(
            f"moves of a joint per sample {where}: as printed; rounds of ours",
            f"{shown(printed['iterations'])}; {shown(ours['iterations'])} rounds of at most three moves",
        ),
    ]


def _pace(run: Numbers) -> str:
    """How fast and how suddenly the joints move."""
    return f"at most {shown(run['speed_rad_s'])} rad/s and {shown(run['acceleration_rad_s2'])} rad/s²"


def line_rows(numbers: Numbers) -> list[Row]:
    """Search and damped least squares on the line."""
    search, dls = numbers["search"], numbers["dls"]
    return [
        circular("search: largest error (its tolerance)", search["error_m"], 1e-7, "m"),
        *_smooth_rows("on singular points", search, numbers["printed"]),
        claim(
            "DLS",
            "fails",
            f"strays by {shown(1e3 * dls['error_m'])} mm, {shown(dls['acceleration_rad_s2'])} rad/s²",
            holds=not dls["passed"] and dls["error_m"] > LARGE,
        ),
    ]


def limit_rows(numbers: Numbers) -> list[Row]:
    """Position limit, then speed limit."""
    position, speed = numbers["position"], numbers["speed"]
    low, high = position["q4_rad"]
    fastest = speed["q4_rad_s"]
    return [
        claim(
            "fourth joint within 0.60 .. 0.85 rad",
            "held",
            f"{low:g} .. {high:g} rad",
            holds=low >= 0.6 and high <= 0.85,
        ),
        circular("error with the limit of position (its tolerance)", position["error_m"], SEARCHED, "m"),
        claim("fourth joint within 0.5 rad/s", "held", f"at most {fastest:g} rad/s", holds=fastest <= 0.5),
        circular("error with the limit of speed (its tolerance)", speed["error_m"], SEARCHED, "m"),
    ]


def ellipse_rows(numbers: Numbers) -> list[Row]:
    """Who comes back after each cycle."""
    plain, closed, wide, tight = (numbers[name] for name in ("pseudo_inverse", "cyclic", "wide", "tightened"))
    return [
        claim(
            "pseudo-inverse",
            "not repetitive",
            f"drifts by up to {shown(plain['drift_deg'])} deg in a cycle, {shown(plain['in_all_deg'])} deg in all",
            holds=plain["drift_deg"] > CLOSED,
        ),
        claim(
            "recursive search, limits tightened",
            "repetitive",
            f"{shown(tight['first_drift_deg'])} deg in the first cycle, {shown(tight['later_drift_deg'])} deg later",
            holds=tight["later_drift_deg"] < CLOSED,
            difference="the first cycle" if tight["later_drift_deg"] < CLOSED else "see left",
        ),
        alone(
            "recursive search, wide limits",
            f"{shown(wide['first_drift_deg'])} deg in the first cycle, {shown(wide['last_drift_deg'])} in the third",
        ),
        circular("recursive search: error (its tolerance)", 1e-3 * tight["error_mm"], SEARCHED, "m"),
        alone(
            "pseudo-inverse, `cyclic`, 25 cycles",
            f"at most {shown(closed['drift_deg'])} deg in a cycle, error {shown(closed['error_mm'])} mm",
        ),
    ]


def pose_rows(numbers: Numbers) -> list[Row]:
    """Position and orientation."""
    return [
        circular("root of the cost (its tolerance)", numbers["cost"], 1e-8, "m"),
        _implied("position error", f"{shown(numbers['error_m'])} m", holds=numbers["error_m"] < 1e-8),
        _implied("orientation error", f"{shown(numbers['turn_rad'])} rad", holds=numbers["turn_rad"] < 1e-7),
        alone(
            "configuration at the end, which the thesis does not print",
            f"({', '.join(f'{angle:g}' for angle in numbers['end_deg'])}) deg",
        ),
    ]


def _implied(what: str, ours: str, *, holds: bool) -> Row:
    """An error that is negligible because the search stops no sooner."""
    return Row(what=what, published="negligible", ours=ours, difference="none", verdict=CIRCULAR if holds else NOT)
