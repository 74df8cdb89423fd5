"""Lines of the page on Ribeiro 2010."""

from reproduction.runs import Numbers
from reproduction.verdicts import Row, bound, claim, figure, shown

PUBLISHED = {  # [mm] largest position errors
    1: {"circle": 0.0016, "rhombus": 0.0015, "rectangle": 0.0015},
    2: {"circle": 0.0013, "rhombus": 0.0003, "rectangle": 0.0010},
    3: {"circle": 0.0013, "rhombus": 0.00052, "rectangle": 0.0016},
}
ALLOWED = 0.1  # [mm] table 3 and text: largest error that the thesis allows
B2, C4 = 35.0, 150.0  # [deg] upper limits
B2_PUBLISHED = 73.0  # [deg] figure 34
OPERATORS = ("kuka", "abb", "staubli")


def mode_rows(numbers: Numbers) -> list[Row]:
    """Nine errors, and the allowed one."""
    rows = [
        figure(f"mode {mode}: {task}", numbers[f"mode_{mode}"]["errors_mm"][task], error, "mm")
        for mode, errors in PUBLISHED.items()
        for task, error in errors.items()
    ]
    largest = max(max(numbers[f"mode_{mode}"]["errors_mm"].values()) for mode in PUBLISHED)
    return [*rows, bound("all of them, as allowed", largest, ALLOWED, "mm")]


def work_rows(numbers: Numbers) -> list[Row]:
    """Travel and speed of the robots in the three modes."""
    first, second, third = (numbers[f"mode_{mode}"] for mode in PUBLISHED)
    worn = numbers["worn"]
    harder = all(third[key][robot] > second[key][robot] for key in ("travel_deg", "speed_deg_s") for robot in OPERATORS)
    return [
        claim(
            "positioner in mode 1 and 2",
            "harder in mode 1",
            f"travel {shown(first['travel_deg']['reis'])} and {shown(second['travel_deg']['reis'])} deg, "
            f"speed {shown(first['speed_deg_s']['reis'])} and {shown(second['speed_deg_s']['reis'])} deg/s",
            holds=all(first[key]["reis"] > second[key]["reis"] for key in ("travel_deg", "speed_deg_s")),
        ),
        claim(
            "travel of the operators in mode 3 and 2",
            "harder in mode 3",
            "; ".join(
                f"{robot.upper()} {shown(third['travel_deg'][robot])} and {shown(second['travel_deg'][robot])} deg"
                for robot in OPERATORS
            ),
            holds=harder,
        ),
        claim(
            "ABB's speeds in mode 3 and 1",
            "higher in mode 3",
            f"{shown(third['speed_deg_s']['abb'])} and {shown(first['speed_deg_s']['abb'])} deg/s",
            holds=third["speed_deg_s"]["abb"] > first["speed_deg_s"]["abb"],
            difference="as fast in both: our layout is another",
        ),
        *(_worn_row(name, worn[name]) for name in ("D4", "F4")),
    ]


def _worn_row(name: str, worn: Numbers) -> Row:
    """A wrist joint in mode 3."""
    return claim(
        f"STAUBLI {name} in mode 3",
        "beyond its limits of position and speed",
        f"{shown(worn['beyond_deg'])} deg beyond, {shown(worn['speed_share'])} times its top speed",
        holds=worn["beyond_deg"] > 0.0 and worn["speed_share"] > 1.0,
    )


def layout_rows(numbers: Numbers) -> list[Row]:
    """What breaks in the first layout."""
    b2, c4, floor, low = numbers["b2_deg"], numbers["c4_deg"], numbers["floor_mm"], numbers["low_base"]
    return [
        claim("KUKA B2", f"beyond {B2:g} deg", f"beyond, up to {shown(b2)} deg", holds=b2 > B2),
        figure("KUKA B2, largest", b2, B2_PUBLISHED, "deg"),
        claim("STAUBLI C4", f"beyond {C4:g} deg", f"beyond, up to {shown(c4)} deg", holds=c4 > C4),
        claim("no other joint", "none named", ", ".join(numbers["broken"]), holds=len(numbers["broken"]) == 2),
        claim(
            "REIS and the floor",
            "touch",
            f"{shown(floor)} mm apart ({numbers['floor_pair']})",
            holds=floor <= 0.0,
            difference=f"{shown(floor)} mm",
        ),
        claim(
            f"the same with the base of the REIS {shown(low['lowered_mm'])} mm lower",
            "touch",
            " and ".join(
                f"the part in its gripper touches it from {first:.3f} to {last:.3f} s" for first, last in low["hits_s"]
            )
            or "apart",
            holds=bool(low["hits_s"]),
        ),
    ]


def appendix_rows(numbers: Numbers) -> list[Row]:
    """Two planar arms."""
    return [
        bound("position error", numbers["error_mm"], 0.003, "mm"),
        claim(
            "orientation error",
            "about 3e-13 rad",
            "below 1e-12 rad" if numbers["turn_below_1e_12_rad"] else "above 1e-12 rad",
            holds=numbers["turn_below_1e_12_rad"],
            difference="both are rounding",
        ),
    ]
