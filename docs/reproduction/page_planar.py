"""Lines of the page on the planar arm of Nicolato 2007, its camera and its brake; and on cooperating robots."""

from reproduction.runs import Numbers
from reproduction.verdicts import CHOSEN, CIRCULAR, NOT, Row, alone, claim, shown

PRINTED = 2e-9  # [m] of a search with a tolerance of 1e-9 m
PLOTTED = 1.0  # [deg] from one cycle to the next: less than a plot of measured joints shows
PIXEL = 1.0  # [px] printed error at the end
NAMES = ("first", "second", "third")


def planar_rows(numbers: Numbers) -> list[Row]:
    """Sections 5.4.1 to 5.4.3 and the brake of section 3.4."""
    point, weighted, circles = numbers["point"], numbers["weighted"], numbers["circles"]
    more = [abs(weighted["joints_deg"][i]) > abs(point["joints_deg"][i]) for i in (1, 2)]
    return [
        Row(
            what="a point from the singular start, within one sample",
            published="reached with no error",
            ours=f"{shown(point['error_m'])} m after {point['rounds']:g} rounds",
            difference="the order of the joints was chosen for it",
            verdict=CHOSEN if point["error_m"] < PRINTED else NOT,
        ),
        alone(
            "the same with the joints in the order 1, 2, 3",
            f"stops {shown(1e3 * numbers['other_order_error_m'])} mm from it: the arm stays stretched",
        ),
        Row(
            what="weight 0.5 on the first joint: the goal",
            published="reached with no error",
            ours=f"{shown(weighted['error_m'])} m after {weighted['rounds']:g} rounds",
            difference="as above",
            verdict=CHOSEN if weighted["error_m"] < PRINTED else NOT,
        ),
        claim(
            "the same: joints 2 and 3",
            "both move more",
            "; ".join(
                f"{name} {shown(point['joints_deg'][i])} without, {shown(weighted['joints_deg'][i])} deg with"
                for i, name in enumerate(NAMES)
            ),
            holds=all(more),
            difference="none" if all(more) else f"{sum(more)} of the two",
        ),
        claim(
            "circles for 50 s: joints",
            "periodic",
            f"{shown(circles['first_drift_deg'])} deg from the first cycle to the second, "
            f"{shown(circles['last_drift_deg'])} deg from the last but one to the last",
            holds=circles["last_drift_deg"] < PLOTTED,
            difference="less than a plot shows, not nothing" if circles["last_drift_deg"] < PLOTTED else "they drift",
        ),
        alone("the same: error of the search without a real arm", f"{shown(circles['error_m'])} m"),
        Row(
            what="brake in the middle, half-way and at the limit",
            published="4 (max - q) (q - min) / (max - min)²",
            ours=", ".join(f"{share:g}" for share in numbers["brake"]),
            difference="the printed formula itself",
            verdict=CIRCULAR if numbers["brake"] == [1.0, 0.75, 0.0] else NOT,
        ),
    ]


def camera_rows(numbers: Numbers) -> list[Row]:
    """Section 4.4 without the dynamics."""
    printed, nearer, other, half = (
        numbers["camera"][name] for name in ("printed", "nearer", "other_order", "other_order_half")
    )
    target = numbers["target"]
    return [
        claim(
            "the printed target, with the printed camera and arm",
            "error of about 1 pixel",
            f"{shown(printed['error_px'])} pixels: the target is {shown(1e3 * target['distance_m'])} mm away, "
            f"the arm reaches {shown(1e3 * target['reach_m'])} mm",
            holds=printed["error_px"] <= PIXEL,
            difference=f"{shown(printed['error_px'] - PIXEL)} pixels",
        ),
        Row(
            what="a target within reach: error at the end",
            published="about 1 pixel",
            ours=f"{shown(nearer['error_px'])} pixels, within one after {shown(nearer['within_a_pixel_after_s'])} s",
            difference="the target and the order of the joints were chosen for it",
            verdict=CHOSEN if nearer["error_px"] <= PIXEL else NOT,
        ),
        alone("the same without the camera's correction", f"{shown(nearer['uncorrected_px'])} pixels"),
        alone(
            "the same with the joints in the order 3, 2, 1",
            f"swings by {shown(other['error_px'])} pixels; {shown(half['error_px'])} with half of each correction",
        ),
    ]


def cooperation_rows(numbers: Numbers) -> list[Row]:
    """Cooperating robots by search, which the thesis leaves to later work."""
    return [
        alone(
            "two planar arms of Ribeiro 2010, Appendix E, by `recursive_search`",
            f"{shown(numbers['error_mm'])} mm, {'all checks pass' if numbers['passed'] else 'some check fails'}",
        )
    ]
