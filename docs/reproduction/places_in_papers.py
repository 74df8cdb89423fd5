"""The place of every published claim in its paper, by table of the page and by line."""

from reproduction.places_in_ribeiro import RIBEIRO
from reproduction.sources import Source, number, said

SECOND, THIRD = "vargas_2.filtered_inverse_ii", "vargas_3.filtered_inverse_ii"

VARGAS: dict[str, dict[str, Source]] = {
    "vargas_1": {
        "error after the transient (Fig. 6)": number("Fig. 6", None, "mm", "vargas_1.filtered_inverse.error_mm"),
        "the three paths (Fig. 5)": number("Fig. 5", None, "mm", "vargas_1.apart_mm"),
        "damping (section 4.1)": number("section 4.1", 1.0, "", "vargas_1.damped_least_squares.manipulability_min"),
    },
    "vargas_2": {
        "error near the singular point (Fig. 10)": number(
            "Fig. 10", None, "mm", f"{SECOND}.error_mm", at_s=20.0, ours_at=f"{SECOND}.error_at_s"
        ),
        "kept away from it beyond the path's 100 mm (Fig. 9)": number("Fig. 9", None, "mm", f"{SECOND}.kept_away_mm"),
        "smallest c (Fig. 11)": number("Fig. 11", None, "", f"{SECOND}.condition_min"),
    },
    "vargas_3": {
        "distance from the singular point (Fig. 13)": number("Fig. 13", None, "mm", f"{THIRD}.nearest_mm"),
        "joint speeds (section 4.3)": number("section 4.3", 4.0, "rad/s", f"{THIRD}.speed_rad_s"),
        "error from 30 s on (Fig. 14)": number("Fig. 14", None, "mm", f"{THIRD}.late_error_mm"),
        "law II leaves the point more smoothly than law I: the path (Fig. 13)": number(
            "section 4.3, Fig. 13", None, "deg", f"{THIRD}.turned_deg"
        ),
        "the same: the joints": number("section 4.3", None, "rad/s", f"{THIRD}.late_speed_rad_s"),
    },
    "vargas_filter": {
        "one constant k: time constant of the filter": number(
            "Eq. 18", None, "s", "vargas_filter.scalar.time_constant_s"
        ),
        "k that falls to zero: theta grows, slowly and without end": number(
            "Eqs. 19 to 23, Fig. 2", None, "", "vargas_filter.scalar.theta_at_end", ours_at="vargas_filter.scalar.end_s"
        ),
        "DLS in case II with half of lambda_0": number(
            "section 4.2", None, "mm", "vargas_filter.damping.lambda0_halved.nearest_mm"
        ),
        "DLS in case II with half of w_0": number(
            "section 4.2", None, "mm", "vargas_filter.damping.w0_halved.nearest_mm"
        ),
        "stretched start, Theta = 0": number("section 5", None, "m", "vargas_filter.singular_start.zero_I_m"),
        "the same, Theta with independent columns, law I": number(
            "section 5", None, "m", "vargas_filter.singular_start.chosen_I_m"
        ),
        "the same, law II": number("section 5", None, "m", "vargas_filter.singular_start.chosen_II_m"),
        "position and orientation at once": number("section 5", None, "mm", "vargas_filter.orientation.II_mm"),
        "position and orientation that cannot both be reached": number(
            "section 5", None, "m", "vargas_filter.unreachable.position.position_m"
        ),
        "cost against DLS: multiplications of one step": number(
            "section 5", None, "", "vargas_filter.products.planar.filtered"
        ),
    },
}

CIRCLE, LINE, LIMITS = "nicolato_circle", "nicolato_line", "nicolato_limits"
NICOLATO: dict[str, dict[str, Source]] = {
    "nicolato_circle": {
        "search: largest error": number(
            "section 4.1, Fig. 4.1", 4.5e-8, "m", f"{CIRCLE}.search.error_m", ours_at=f"{CIRCLE}.search.error_at_s"
        ),
        "search as printed: smooth through the singular point": number(
            "section 4.1, Fig. 4.1", None, "rad/s²", f"{CIRCLE}.printed.acceleration_rad_s2", at_s=3.0
        ),
        "DLS: damping sets in (the plane of the circle was chosen for it)": number(
            "section 4.1, Fig. 4.2", 2.85, "s", f"{CIRCLE}.dls.damped_from_s", at_s=2.85
        ),
        "DLS: error near the singular point": number(
            "section 4.1, Fig. 4.2", None, "m", f"{CIRCLE}.dls.error_m", ours_at=f"{CIRCLE}.dls.error_at_s"
        ),
        "DLS: joint speeds": number("section 4.1, Fig. 4.2", None, "rad/s", f"{CIRCLE}.dls.speed_rad_s"),
        "circle begun towards +z: DLS": number("section 4.1, Fig. 4.2", None, "m", f"{CIRCLE}.upwards.dls.error_m"),
    },
    "nicolato_line": {
        "search: largest error (its tolerance)": number("section 4.1", 1e-7, "m", f"{LINE}.search.error_m"),
        "search as printed: smooth on singular points": number(
            "section 4.1, Fig. 4.3", None, "rad/s²", f"{LINE}.printed.acceleration_rad_s2"
        ),
        "DLS": number("section 4.1", None, "m", f"{LINE}.dls.error_m", ours_at=f"{LINE}.dls.error_at_s"),
    },
    "nicolato_limits": {
        "fourth joint within 0.60 .. 0.85 rad": number(
            "section 4.2, Fig. 4.4", 0.85, "rad", f"{LIMITS}.position.q4_rad.1"
        ),
        "error with the limit of position (its tolerance)": number(
            "section 4.2, Fig. 4.4", 1e-5, "m", f"{LIMITS}.position.error_m"
        ),
        "fourth joint within 0.5 rad/s": number("section 4.2, Fig. 4.5", 0.5, "rad/s", f"{LIMITS}.speed.q4_rad_s"),
        "error with the limit of speed (its tolerance)": number(
            "section 4.2, Fig. 4.5", 1e-5, "m", f"{LIMITS}.speed.error_m"
        ),
    },
    "nicolato_ellipse": {
        "pseudo-inverse": number(
            "section 4.2, Fig. 4.6", None, "deg", "nicolato_ellipse.pseudo_inverse.in_all_deg", at_s=50.0
        ),
        "recursive search, limits tightened": number(
            "section 4.2, Fig. 4.7", None, "deg", "nicolato_ellipse.tightened.later_drift_deg", at_s=50.0
        ),
        "recursive search: error (its tolerance)": number(
            "section 4.2", 1e-5, "m", "nicolato_ellipse.tightened.error_mm", scale=1e-3
        ),
    },
    "nicolato_pose": {
        "root of the cost (its tolerance)": number("section 4.3", 1e-8, "m", "nicolato_pose.cost"),
        "position error": number("section 4.3, Fig. 4.8", None, "m", "nicolato_pose.error_m"),
        "orientation error": number("section 4.3, Fig. 4.8", None, "rad", "nicolato_pose.turn_rad"),
    },
    "nicolato_planar": {
        "a point from the singular start, within one sample": number(
            "section 5.4.1, Fig. 5.7", None, "m", "nicolato_planar.point.error_m"
        ),
        "weight 0.5 on the first joint: the goal": number(
            "section 5.4.2, Fig. 5.9", None, "m", "nicolato_planar.weighted.error_m"
        ),
        "the same: joints 2 and 3": said("section 5.4.2, Figs. 5.8 and 5.10"),
        "circles for 50 s: joints": number(
            "section 5.4.3, Fig. 5.13", None, "deg", "nicolato_planar.circles.last_drift_deg", at_s=50.0
        ),
        "brake in the middle, half-way and at the limit": said("Eq. 3.29, Fig. 3.2"),
    },
    "nicolato_camera": {
        "the printed target, with the printed camera and arm": number(
            "section 4.4, Fig. 4.11", 1.0, "px", "nicolato_planar.camera.printed.error_px", ours_at=""
        ),
        "a target within reach: error at the end": number(
            "section 4.4, Fig. 4.11", 1.0, "px", "nicolato_planar.camera.nearer.error_px", at_s=50.0
        ),
    },
    "nicolato_servo": {
        "the printed target and camera: error at the end": number(
            "section 4.4, Fig. 4.11", 1.0, "px", "nicolato_servo.target.least_px"
        ),
        "whole corrections, as printed (Eq. 3.31), target within reach": said("section 4.4, Figs. 4.10 and 4.11"),
        "3 % of each correction, camera at 1.1 m: time to within 5 % of the way": number(
            "section 4.4, Fig. 4.10", 2.0, "s", "nicolato_servo.chosen.settled_s"
        ),
        "the same: error that is left": number(
            "section 4.4, Fig. 4.11", 1.0, "px", "nicolato_servo.chosen.error_after_10_s_px", ours_at=""
        ),
        "the same: smooth": number("section 4.4, Fig. 4.10", None, "px", "nicolato_servo.chosen.beyond_px"),
    },
}

PLACES: dict[str, dict[str, Source]] = {**VARGAS, **NICOLATO, **RIBEIRO}
