"""Curves, limits and marks of a figure, read back from its SVG text in the units of its axes."""

import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from typing import Any

import numpy as np

SVG = "{http://www.w3.org/2000/svg}"
STEP = re.compile(r"([MLHVZhvl])([^MLHVZhvl]*)")
NUMBER = re.compile(r"-?\d+")


@dataclass
class DrawnPanel:
    """What one panel shows: points of shape (K, 2) by curve, and the marks; values of its horizontal limits."""

    title: str
    resolution: tuple[float, float]  # of one coordinate along both axes; of logarithms on a logarithmic one
    curves: dict[str, Any] = field(default_factory=dict)
    marks: list[tuple[float, float]] = field(default_factory=list)
    limits: list[float] = field(default_factory=list)
    forbidden: list[tuple[float, float]] = field(default_factory=list)


def texts(svg: str | bytes) -> list[str]:
    """All words of a picture, in their order."""
    return [node.text or "" for node in ET.fromstring(svg).iter(f"{SVG}text")]  # noqa: S314


def panels(svg: str | bytes) -> list[DrawnPanel]:
    """All panels of a picture."""
    return [_panel(node) for node in ET.fromstring(svg).iter(f"{SVG}g") if node.get("class") == "panel"]  # noqa: S314


def _panel(node: ET.Element) -> DrawnPanel:
    box = node.find(f"{SVG}svg")
    assert box is not None
    _, _, width, height = map(float, box.get("viewBox", "").split())
    (left, right), (low, high) = (map(float, node.get(f"data-{axis}", "").split()) for axis in "xy")
    is_log = node.get("data-log") is not None
    low, high = (np.log10(low), np.log10(high)) if is_log else (low, high)

    def back(points: Any) -> Any:
        x, y = np.array(points, dtype=float).T
        values = high - (high - low) * y / height
        return np.stack([left + (right - left) * x / width, 10.0**values if is_log else values], axis=-1)

    words = [text.text or "" for text in node.findall(f"{SVG}text")]
    panel = DrawnPanel(words[0] if words else "", ((right - left) / width, (high - low) / height))
    for path in box.findall(f"{SVG}path"):
        kind, points = path.get("class"), back(corners(path.get("d", "")))
        if kind == "curve":
            panel.curves[path.get("data-name", "")] = points
        elif kind == "mark":
            panel.marks.append((points[0, 0], points[0, 1]))
        elif kind == "bound":
            panel.limits.append(float(points[0, 1]))
    for rect in box.findall(f"{SVG}rect"):
        top = float(rect.get("y", "0"))
        ends = back([(0.0, top + float(rect.get("height", "0"))), (0.0, top)])
        panel.forbidden.append((float(ends[0, 1]), float(ends[1, 1])))
    return panel


def corners(path: str) -> list[tuple[float, float]]:
    """Corners of a path."""
    points, x, y = [], 0, 0
    for letter, text in STEP.findall(path):
        numbers = [int(number) for number in NUMBER.findall(text)]
        for one, other in zip(numbers[::2], numbers[1::2], strict=True) if letter in "Ml" else ():
            x, y = (one, other) if letter == "M" else (x + one, y + other)
            points.append((x, y))
        if letter in "HhVv":
            (length,) = numbers
            x = {"H": length, "h": x + length}.get(letter, x)
            y = {"V": length, "v": y + length}.get(letter, y)
            points.append((x, y))
    return points
