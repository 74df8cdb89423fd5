"""The place of every claim of Ribeiro 2010 in the thesis, by table of the page and by line."""

from reproduction.sources import Source, number, said

MODES = "ribeiro_modes"
FIGURES = {
    1: {"circle": (37, 0.0016), "rhombus": (38, 0.0015), "rectangle": (39, 0.0015)},
    2: {"circle": (51, 0.0013), "rhombus": (52, 0.0003), "rectangle": (53, 0.0010)},
    3: {"circle": (69, 0.0013), "rhombus": (70, 0.00052), "rectangle": (71, 0.0016)},
}
JOINTS = f"{MODES}.joints"
FIRST = "ribeiro_first_layout"
APPENDIX = "ribeiro_appendix_d"
FED = "the same with feedback, K = 500 per second"

RIBEIRO: dict[str, dict[str, Source]] = {
    "ribeiro_main": {
        "position errors in 4 s (section 5.3.2)": number(
            "sections 5.3 and 5.3.2", 0.1, "mm", f"{MODES}.mode_1.errors_mm.rectangle"
        ),
        "orientation errors": number("sections 5.3 and 5.3.2", 0.01, "deg", f"{MODES}.mode_1.turn_deg"),
        "limits of joint positions and speeds": said("section 5.7, Figs. 43 to 50"),
        "collisions": said("section 5.3.2"),
    },
    "ribeiro_errors": {
        **{
            f"mode {mode}: {task}": number(f"Fig. {figure}", error, "mm", f"{MODES}.mode_{mode}.errors_mm.{task}")
            for mode, tasks in FIGURES.items()
            for task, (figure, error) in tasks.items()
        },
        "all of them, as allowed": number("section 5.3", 0.1, "mm", f"{MODES}.mode_3.errors_mm.rectangle"),
    },
    "ribeiro_work": {
        "positioner in mode 1 and 2": said("sections 5.4.1.1 and 5.4.1.2, Figs. 43, 44, 55, 56"),
        "travel of the operators in mode 3 and 2": said("section 5.6"),
        "operators in mode 1 and 2 (section 5.6)": said("section 5.6"),
        "ABB B3: range in mode 3 and 1": said("section 5.5.2.1, Figs. 47 and 74"),
        "ABB A3: range in mode 3 and 1": said("section 5.5.2.1, Figs. 47 and 74"),
        "ABB D3: range in mode 3 and 1": said("section 5.5.2.1, Figs. 47 and 74"),
        "ABB, all joints but E3 (printed E4): speed in mode 3 and 1": said("section 5.5.2.2, Figs. 48 and 75"),
        "STAUBLI D4 in mode 3": number("section 5.5.3, Figs. 76 and 77", None, "deg", f"{MODES}.worn.D4.beyond_deg"),
        "STAUBLI F4 in mode 3": number("section 5.5.3, Figs. 76 and 77", None, "deg", f"{MODES}.worn.F4.beyond_deg"),
    },
    "ribeiro_joints": {
        "KUKA B2 and E2 in mode 1: close to their limits": said("section 5.3.2.4, Fig. 45"),
        "STAUBLI in mode 1: joint closest to its upper limit": said("section 5.3.2.8, Fig. 49"),
        "ABB in mode 1: joints whose speed changes most abruptly": said("section 5.3.2.7, Fig. 48"),
        "STAUBLI in mode 1: joints whose speed changes most abruptly": said("section 5.3.2.9, Fig. 50"),
        "REIS B1, D1, E1: range with the circle alone and in mode 1": said("section 5.4.1.1, Figs. 43 and 55"),
        "REIS with the rhombus alone: joints that move": said("section 5.4.2.1, Fig. 60"),
        "REIS with the circle alone and in mode 1: speeds": said("section 5.4.1.2, Figs. 44 and 56"),
        "REIS with the rhombus alone and in mode 1: speeds": said("section 5.4.2.2, Figs. 44 and 61"),
        "REIS with the rectangle alone and in mode 1: speeds": said("section 5.4.3.2, Figs. 44 and 66"),
        "REIS with the rectangle alone and in mode 1: ranges": said("section 5.4.3.1, Figs. 43 and 65"),
        "errors in mode 2 and 1, task by task": said("section 5.4, Figs. 37 to 39 and 51 to 53"),
        "KUKA B2, C2: range in mode 2 and 1": said("section 5.4.1.3, Figs. 45 and 57"),
        "KUKA B2: nearer to its upper limit in mode 1 than in mode 2": number(
            "section 5.4.1.3, Figs. 45 and 57", None, "deg", f"{JOINTS}.mode_1.kuka.B2.to_upper_deg"
        ),
        "KUKA: speeds in mode 2 and 1": said("section 5.4.1.4, Figs. 46 and 58"),
        "ABB: ranges in mode 2 and 1": said("section 5.4.2.3, Figs. 47 and 62"),
        "ABB: speeds in mode 2 and 1": said("section 5.4.2.4, Figs. 48 and 63"),
        "KUKA: ranges in mode 2 and 3": said("section 5.5.1.1, Figs. 57 and 72"),
        "ABB: ranges in mode 2 and 3": said("section 5.5.2.1, Figs. 62 and 74"),
        "STAUBLI: ranges in mode 2 and 3": said("section 5.5.3.1, Figs. 67 and 76"),
        "KUKA: ranges in mode 3 and 1": said("section 5.5.1.1, Figs. 45 and 72"),
        "ABB: speeds in mode 2 and 3": said("section 5.5.2.2, Figs. 63 and 75"),
        "ABB C3, E3, F3: range in mode 1 and 3": said("section 5.5.2.1, Figs. 47 and 74"),
        "STAUBLI D4 and F4 in mode 3: the limit that is passed": said("section 5.5.3.1, Fig. 76"),
        "errors in all modes: about a hundredth of a millimetre": number(
            "section 5.6", 0.01, "mm", f"{MODES}.mode_3.errors_mm.rectangle"
        ),
        "all joints of the operators: mode 1 and 2": said("section 5.6"),
        "all joints of the operators: mode 3 and 2": said("section 5.6"),
    },
    "ribeiro_first_layout": {
        "KUKA B2": number("section 5.3.1, Fig. 32", 35.0, "deg", f"{FIRST}.b2_deg"),
        "KUKA B2: by how much, and when (Fig. 34)": number(
            "section 5.3.1, Fig. 34", 73.0, "deg", f"{FIRST}.b2_deg", at_s=1.3, ours_at=f"{FIRST}.b2_at_s"
        ),
        "STAUBLI C4": number("section 5.3.1, Fig. 33, table 7", 150.0, "deg", f"{FIRST}.c4_deg"),
        "no other joint": said("section 5.3.1"),
        "REIS and the floor (Fig. 35)": number("section 5.3.1, Fig. 35", None, "mm", f"{FIRST}.floor_mm"),
    },
    "ribeiro_appendix_e": {
        "position error": number("section E.1.7, Fig. 110", 0.003, "mm", "ribeiro_appendix_e.error_mm"),
        "orientation error": number("section E.1.7, Fig. 110", 3e-13, "rad", ""),
    },
    "ribeiro_appendix_d": {
        "N_p^-1 N_s is the Jacobian, with N_p of Eq. E.8": said("Eqs. C.21, E.8 and E.11"),
        "the same with N_p as Eq. C.19 prints it": number("Eq. C.19", None, "m/s", f"{APPENDIX}.jacobian.c19"),
        "one arm, 40 s: Euler's method alone drifts": number(
            "Eq. D.4, Fig. 100", None, "mm", f"{APPENDIX}.alone.euler.error_mm", at_s=40.0
        ),
        FED: number("Eqs. D.7 and D.11, Fig. 102", None, "mm", f"{APPENDIX}.alone.feedback.error_mm", at_s=40.0),
        "two arms, 12 s: without feedback": number(
            "Eq. E.15, Fig. 107", None, "mm", f"{APPENDIX}.together.e15.error_mm", at_s=12.0
        ),
        "two arms with feedback, K = 500 per second": number(
            "Eq. E.16", None, "mm", f"{APPENDIX}.together.e16.error_mm", at_s=12.0
        ),
    },
    "ribeiro_load_sharing": {
        "second holder: its grasp stays where it is in the part": number(
            "section 4.5", None, "mm", "ribeiro_load_sharing.position_mm"
        ),
    },
}
