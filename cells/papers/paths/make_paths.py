"""Sample the papers' trajectories in time: ``python cells/papers/paths/make_paths.py`` writes the files anew."""

from collections.abc import Callable
from math import cos, pi, sin
from pathlib import Path

HERE = Path(__file__).resolve().parent
Point = tuple[float, float]


def vargas_1(t: float) -> Point:
    """Vargas 2012, Eq. 39, in [m]."""
    return 2.0 + 0.5 * sin(0.4 * t), 0.5 * cos(0.2 * t)


def vargas_2(t: float) -> Point:
    """Vargas 2012, Eq. 40, in [m]."""
    return 1.1 + sin(0.2 * t), 0.35 * cos(0.2 * t)


def nicolato_ellipse(t: float) -> Point:
    """Nicolato 2007, section 4.2: radii of 0.1 and 0.2 m in 2 s, from (0.2732, 0.2732) m on."""
    corner = 0.1 + 0.1 * 3.0**0.5
    return corner - 0.1 + 0.1 * cos(pi * t), corner + 0.2 * sin(pi * t)


PATHS: dict[str, tuple[Callable[[float], Point], float, int]] = {
    "vargas_case_1": (vargas_1, 35.0, 700),
    "vargas_case_2": (vargas_2, 35.0, 700),
    "nicolato_ellipse": (nicolato_ellipse, 2.0, 80),
}


def table(curve: Callable[[float], Point], duration: float, count: int) -> str:
    """Instants and positions as text."""
    lines = ["t_s,x_mm,y_mm,z_mm"]
    for index in range(count + 1):
        t = duration * index / count
        x, y = curve(t)
        lines.append(f"{t:.6g},{1e3 * x:.9f},{1e3 * y:.9f},0")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    for name, path in PATHS.items():
        (HERE / f"{name}.csv").write_text(table(*path), encoding="utf-8")
