"""Lines of the page on single joints: what Ribeiro 2010 says in sections 5.3.2 to 5.6, also where it fails here."""

from collections.abc import Sequence

from reproduction.page_ribeiro import PUBLISHED
from reproduction.runs import Numbers
from reproduction.verdicts import Row, chosen, claim, shown

RANGE, SPEED, ACCELERATION = "range_deg", "speed_deg_s", "acceleration_deg_s2"
UNITS = {RANGE: "deg", SPEED: "deg/s", ACCELERATION: "deg/s²"}
NEAR = 20.0  # [deg] from a limit: operating close to it
FEW_PERCENT = 0.1  # [-] of the range of the joint that moves most: a joint that practically stands
TASKS = {"circle": "kuka", "rhombus": "abb", "rectangle": "staubli"}
NUMBERS = {"reis": 1, "kuka": 2, "abb": 3, "staubli": 4}


def joint_rows(modes: Numbers) -> list[Row]:
    """All claims on single joints."""
    joints = modes["joints"]
    return [
        *_layout_rows(joints["mode_1"]),
        *_positioner_rows(joints),
        *_mode_2_rows(modes, joints),
        *_mode_3_rows(joints),
        *_summary_rows(modes, joints),
    ]


def _layout_rows(first: Numbers) -> list[Row]:
    """Joints near their limits and joints that change their speed abruptly, in mode 1."""
    kuka, staubli = first["kuka"], first["staubli"]
    nearest = {name: min(joint["to_upper_deg"], joint["to_lower_deg"]) for name, joint in kuka.items()}
    upper = min(staubli, key=lambda name: float(staubli[name]["to_upper_deg"]))
    rows = [
        claim(
            "KUKA B2 and E2 in mode 1: close to their limits",
            "close",
            f"{shown(nearest['B2'])} and {shown(nearest['E2'])} deg from them",
            holds=max(nearest["B2"], nearest["E2"]) < NEAR,
            difference="our layout keeps them away",
        ),
        claim(
            "STAUBLI in mode 1: joint closest to its upper limit",
            "C4",
            f"{upper}, {shown(staubli[upper]['to_upper_deg'])} deg; C4 {shown(staubli['C4']['to_upper_deg'])} deg",
            holds=upper == "C4",
            difference="none" if upper == "C4" else upper,
        ),
    ]
    for robot, pair in (("abb", ("B3", "C3")), ("staubli", ("B4", "C4"))):
        hardest = sorted(first[robot], key=lambda name: -float(first[robot][name][ACCELERATION]))[:2]
        result = ", ".join(f"{name} {shown(first[robot][name][ACCELERATION])}" for name in hardest)
        rows.append(
            claim(
                f"{robot.upper()} in mode 1: joints whose speed changes most abruptly",
                " and ".join(pair),
                f"{result} deg/s²",
                holds=set(hardest) == set(pair),
                difference="none" if set(hardest) == set(pair) else "other joints",
            )
        )
    return rows


def _positioner_rows(joints: Numbers) -> list[Row]:
    """The positioner in mode 2 beside mode 1, task by task."""
    first, alone = joints["mode_1"]["reis"], joints["positioner"]
    few = ("B1", "D1", "E1")
    moving = sorted(alone["rhombus"], key=lambda name: -float(alone["rhombus"][name][RANGE]))
    most = alone["rhombus"][moving[0]][RANGE]
    busy = [name for name in moving if alone["rhombus"][name][RANGE] > FEW_PERCENT * most]
    rows = [
        _less("REIS B1, D1, E1: range with the circle alone and in mode 1", alone["circle"], first, RANGE, names=few),
        claim(
            "REIS with the rhombus alone: joints that move",
            "practically D1 and E1",
            ", ".join(f"{name} {shown(alone['rhombus'][name][RANGE])}" for name in busy) + " deg",
            holds=set(busy) == {"D1", "E1"},
            difference="none" if set(busy) == {"D1", "E1"} else f"{len(busy)} joints",
        ),
    ]
    speeds = [_less(f"REIS with the {task} alone and in mode 1: speeds", alone[task], first, SPEED) for task in TASKS]
    ranges = _less("REIS with the rectangle alone and in mode 1: ranges", alone["rectangle"], first, RANGE)
    return [*rows, *speeds, ranges]


def _mode_2_rows(modes: Numbers, joints: Numbers) -> list[Row]:
    """Operators in mode 2 beside mode 1."""
    first, second = joints["mode_1"], joints["mode_2"]
    nearer = first["kuka"]["B2"]["to_upper_deg"], second["kuka"]["B2"]["to_upper_deg"]
    return [
        _errors_row(modes),
        _less("KUKA B2, C2: range in mode 2 and 1", second["kuka"], first["kuka"], RANGE, names=("B2", "C2")),
        claim(
            "KUKA B2: nearer to its upper limit in mode 1 than in mode 2",
            "nearer",
            f"{shown(nearer[0])} and {shown(nearer[1])} deg from it",
            holds=nearer[0] < nearer[1],
            difference="none" if nearer[0] < nearer[1] else "farther",
        ),
        _less("KUKA: speeds in mode 2 and 1", second["kuka"], first["kuka"], SPEED),
        _less("ABB: ranges in mode 2 and 1", second["abb"], first["abb"], RANGE),
        _less("ABB: speeds in mode 2 and 1", second["abb"], first["abb"], SPEED),
    ]


def _errors_row(modes: Numbers) -> Row:
    """Section 5.4: errors of mode 2 are a little below those of mode 1."""
    first, second = (modes[f"mode_{mode}"]["errors_mm"] for mode in (1, 2))
    return claim(
        "errors in mode 2 and 1, task by task",
        "smaller in mode 2",
        "; ".join(f"{task} {shown(second[task])} and {shown(first[task])}" for task in PUBLISHED[1]) + " mm",
        holds=all(second[task] < first[task] for task in PUBLISHED[1]),
    )


def _mode_3_rows(joints: Numbers) -> list[Row]:
    """Operators in mode 3 beside the other two."""
    first, second, third = (joints[f"mode_{mode}"] for mode in (1, 2, 3))
    intermediate = {name: (first["abb"][name][RANGE], third["abb"][name][RANGE]) for name in ("C3", "E3", "F3")}
    rows = [
        _less(f"{robot.upper()}: ranges in mode 2 and 3", second[robot], third[robot], RANGE)
        for robot in TASKS.values()
    ]
    d4, f4 = third["staubli"]["D4"], third["staubli"]["F4"]
    return [
        *rows,
        _less("KUKA: ranges in mode 3 and 1", third["kuka"], first["kuka"], RANGE),
        _less("ABB: speeds in mode 2 and 3", second["abb"], third["abb"], SPEED),
        claim(
            "ABB C3, E3, F3: range in mode 1 and 3",
            "in between: farther at one end only",
            "; ".join(f"{name} {shown(one)} and {shown(three)}" for name, (one, three) in intermediate.items())
            + " deg",
            holds=all(_farther_at_one_end(first["abb"][name], third["abb"][name]) for name in intermediate),
            difference=_one_ended(first["abb"], third["abb"], tuple(intermediate)),
        ),
        claim(
            "STAUBLI D4 and F4 in mode 3: the limit that is passed",
            "upper of D4, lower of F4",
            f"D4 by {_passed(d4)}, F4 by {_passed(f4)}",
            holds=d4["to_upper_deg"] < 0.0 and f4["to_lower_deg"] < 0.0,
            difference="none" if d4["to_upper_deg"] < 0.0 and f4["to_lower_deg"] < 0.0 else "the other end",
        ),
    ]


def _summary_rows(modes: Numbers, joints: Numbers) -> list[Row]:
    """Section 5.6: errors of all modes, and the demand on all joints."""
    errors = [error for mode in PUBLISHED for error in modes[f"mode_{mode}"]["errors_mm"].values()]
    printed = [error for mode in PUBLISHED.values() for error in mode.values()]
    every = {(robot, name) for robot in TASKS.values() for name in joints["mode_1"][robot]}

    def harder(more: Numbers, less: Numbers, key: str) -> int:
        return sum(more[robot][name][key] > less[robot][name][key] for robot, name in every)

    first, second, third = (joints[f"mode_{mode}"] for mode in (1, 2, 3))
    counts = {key: (harder(first, second, key), harder(third, second, key)) for key in (RANGE, SPEED)}
    total = len(every)
    return [
        chosen(
            "errors in all modes: about a hundredth of a millimetre",
            "about 0.01 mm",
            f"{shown(min(errors))} .. {shown(max(errors))} mm",
            f"by the gain, as above; figures of the thesis {shown(min(printed))} .. {shown(max(printed))} mm",
        ),
        *(
            claim(
                f"all joints of the operators: {what}",
                f"harder in mode {mode}",
                f"range in {counts[RANGE][place]}, speed in {counts[SPEED][place]} of {total} joints",
                holds=counts[RANGE][place] == counts[SPEED][place] == total,
                difference="none" if counts[RANGE][place] == counts[SPEED][place] == total else "not in all joints",
            )
            for place, (mode, what) in enumerate(((1, "mode 1 and 2"), (3, "mode 3 and 2")))
        ),
    ]


def _less(what: str, less: Numbers, more: Numbers, key: str, names: Sequence[str] | None = None) -> Row:
    """A claim that something is smaller in every joint of a robot, in the order of the line."""
    used = list(less) if names is None else names
    smaller = [name for name in used if less[name][key] < more[name][key]]
    result = ", ".join(f"{name} {shown(less[name][key])} and {shown(more[name][key])}" for name in used)
    return claim(
        what,
        "smaller in the first",
        f"{result} {UNITS[key]}",
        holds=len(smaller) == len(used),
        difference="none" if len(smaller) == len(used) else f"holds for {', '.join(smaller) or 'no joint'}",
    )


def _farther_at_one_end(first: Numbers, third: Numbers) -> bool:
    """Whether a joint goes farther in the first of two modes at exactly one of its two ends."""
    upper, lower = (bool(first[end] < third[end]) for end in ("to_upper_deg", "to_lower_deg"))
    return upper != lower


def _one_ended(first: Numbers, third: Numbers, names: Sequence[str]) -> str:
    """For which joints that holds."""
    result = [name for name in names if _farther_at_one_end(first[name], third[name])]
    return "none" if len(result) == len(names) else f"holds for {', '.join(result) or 'no joint'}"


def _passed(joint: Numbers) -> str:
    """By how much a joint passes its limits."""
    ends = {"upper": -joint["to_upper_deg"], "lower": -joint["to_lower_deg"]}
    return " and ".join(f"{shown(by)} deg ({end})" for end, by in ends.items() if by > 0.0) or "nothing"
