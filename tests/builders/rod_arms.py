"""Planar arms whose links are rods: masses and largest torques as values of a cell file."""

from collections.abc import Iterable, Mapping


def rod(begin: float, end: float, mass: float) -> dict[str, object]:
    """A rod along x between two places in [mm]."""
    across = mass * (1e-3 * (end - begin)) ** 2 / 12.0
    inertia = [1e-3, 0.0, 0.0, across, 0.0, across]
    return {"mass_kg": mass, "centre_mm": [0.5 * (begin + end), 0.0, 0.0], "inertia_kg_m2": inertia}


RODS = {"A": rod(0.0, 500.0, 4.0), "B": rod(500.0, 900.0, 3.0), "C": rod(900.0, 1100.0, 1.0)}


def rod_values(robots: Iterable[str], torques: Mapping[str, float]) -> dict[str, object]:
    """Arms of rods with nearly weightless tools, and their largest torques in [N m] by joint."""
    values: dict[str, object] = {}
    for robot in robots:
        values[f"robots.{robot}.tool.mass_kg"] = 1e-6
        values[f"robots.{robot}.inertias"] = {"links": RODS, "source": "rods"}
        values[f"robots.{robot}.limits"] = {joint: {"torque_nm": torque} for joint, torque in torques.items()}
    return values
