"""Lines of the page on the simulated arm and its camera, Nicolato 2007, section 4.4."""

import math

from reproduction.runs import Numbers
from reproduction.verdicts import CHOSEN, NOT, Row, alone, claim, shown

PIXEL = 1.5  # [px] "of the order of 1 pixel"
SHORTEST, LONGEST = 1.5, 2.5  # [s] "about 2 s"
SMOOTH = 0.05  # [-] of the way: farther beyond the target the motion swings
NAMES = {
    "share_0.02": "2 % of each correction",
    "share_0.1": "10 % of each correction",
    "encoder_link": "positions measured behind the play",
    "order_1_2_3": "joints in the order 1, 2, 3",
    "dead_zone_first": "dead zone before saturation: at most 3, not 2 N m",
    "no_backlash": "without play",
    "no_dead_zone": "without dead zone",
    "height_1.15": "camera at 1.15 m",
}


def servo_rows(numbers: Numbers) -> list[Row]:
    """What the text claims, and what each reading gives."""
    whole, ours, target = (numbers[name] for name in ("whole", "chosen", "target"))
    length = math.hypot(320.0 - 240.0, 240.0 - 400.0 * 0.6 / 1.1 - 50.0)  # [px] from the start
    return [
        claim(
            "the printed target and camera: error at the end",
            "about 1 pixel",
            f"at least {shown(target['least_px'])} pixels, whatever controls it",
            holds=target["least_px"] <= PIXEL,
            difference=f"the target is {shown(1e3 * target['distance_m'])} mm away, the arm reaches 600 mm",
        ),
        claim(
            "whole corrections, as printed (Eq. 3.31), target within reach",
            "smooth, about 2 s, about 1 pixel",
            _words(whole),
            holds=not whole["lost"] and 0.0 <= whole["settled_s"] <= LONGEST and whole["error_px"] <= PIXEL,
            difference="see the text",
        ),
        _chosen(
            "3 % of each correction, camera at 1.1 m: time to within 5 % of the way",
            "about 2 s",
            f"{shown(ours['settled_s'])} s",
            holds=SHORTEST <= ours["settled_s"] <= LONGEST,
        ),
        _chosen(
            "the same: error that is left",
            "about 1 pixel",
            f"{shown(ours['error_after_10_s_px'])} pixels after 10 s, {shown(ours['error_px'])} after 50 s",
            holds=ours["error_after_10_s_px"] <= PIXEL and ours["error_px"] <= PIXEL,
        ),
        _chosen(
            "the same: smooth",
            "smooth",
            f"{shown(ours['beyond_px'])} of {shown(length)} pixels beyond the target, joints at most "
            f"{shown(ours['speed_rad_s'])} rad/s",
            holds=ours["beyond_px"] <= SMOOTH * length,
        ),
        alone(
            "the same: joints of the search less those of the arm at the end",
            f"{', '.join(shown(value) for value in ours['joint_errors_rad'])} rad; half the play is 0.02 rad, the dead "
            "zone over the gain 0.0067 rad",
        ),
        *(alone(f"10 s, {NAMES[name]}", _words(reading)) for name, reading in numbers["readings"].items()),
    ]


def _words(reading: Numbers) -> str:
    """What became of one reading."""
    if reading["lost"]:
        return "the search loses its path"
    settled = reading["settled_s"]
    when = "never within 5 % of the way" if settled < 0.0 else f"within 5 % of the way after {shown(settled)} s"
    return f"{when}, {shown(reading['error_px'])} pixels at the end, swings by {shown(reading['swing_px'])} pixels"


def _chosen(what: str, published: str, ours: str, *, holds: bool) -> Row:
    """A claim for which the share of each correction and the height of the camera were chosen."""
    difference = "share and height were chosen for it" if holds else "not even so"
    return Row(what=what, published=published, ours=ours, difference=difference, verdict=CHOSEN if holds else NOT)
