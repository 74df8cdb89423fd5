"""Small URDF texts and what their refusal says, for tests of the reader."""

from pathlib import Path

import pytest

from cellplan.errors import InputError
from cellplan.files.robots.urdf.load import UrdfOptions, load_urdf

LIMIT = '<limit lower="-1" upper="2" velocity="3"/>'


def joint(name: str, parent: str, child: str, inside: str = LIMIT, *, kind: str = "revolute") -> str:
    """A joint about or along z where no other axis is written."""
    if kind != "fixed" and "<ax" not in inside:
        inside += '<axis xyz="0 0 1"/>'
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>'


def refusal(path: Path, options: UrdfOptions | None = None) -> str:
    with pytest.raises(InputError) as caught:
        load_urdf(path, options)
    message = str(caught.value)
    assert "\n" not in message
    return message


def refused(folder: Path, *lines: str, options: UrdfOptions | None = None) -> str:
    """Message for a robot whose elements stand in lines 2, 3, …"""
    path = folder / "r.urdf"
    path.write_text("\n".join(['<robot name="rig">', *lines, "</robot>"]), encoding="utf-8")
    return refusal(path, options)


ARM = ('<link name="base"/>', '<link name="tip"/>', joint("a1", "base", "tip"))


def boxed(name: str, size: str, xyz: str = "0 0 0") -> str:
    """A link with one box."""
    return (
        f'<link name="{name}"><collision><origin xyz="{xyz}"/><geometry><box size="{size}"/></geometry></collision>'
        "</link>"
    )


SLIDE = '<origin xyz="0 0 0.06"/><axis xyz="0 {sign} 0"/><limit lower="{low}" upper="{high}" velocity="1"/>{more}'
FOLLOWS = '<mimic joint="left" multiplier="{ratio}"/>'


def finger(
    side: str, *, sign: int, low: float = 0.0, high: float = 0.04, more: str = "", kind: str = "prismatic"
) -> str:
    """A finger on the palm, 20 mm long, whose inner face is at y = 0 when it is closed."""
    inside = SLIDE.format(sign=sign, low=low, high=high, more=more)
    y = 0.01 if side == "left" else -0.01
    return joint(side, "palm", f"{side}_finger", inside, kind=kind) + boxed(
        f"{side}_finger", "0.02 0.02 0.04", f"0 {y} 0"
    )


FINGERS = (finger("left", sign=1), finger("right", sign=-1, more=FOLLOWS.format(ratio=1)))
HAND_ARM = (
    boxed("base", "0.2 0.2 0.2", "0 0 0.1"),
    joint("lift", "base", "carriage", '<origin xyz="0 0 0.5"/><axis xyz="0 0 1"/>' + LIMIT, kind="prismatic"),
    boxed("carriage", "0.1 0.1 0.1"),
    joint("turn", "carriage", "arm", '<origin xyz="0.2 0 0"/><axis xyz="0 0 1"/>' + LIMIT),
    boxed("arm", "0.1 0.1 0.1"),
    joint("roll", "arm", "palm", '<origin xyz="0.3 0 0" rpy="0 1.5707963267948966 0"/><axis xyz="0 0 1"/>' + LIMIT),
    boxed("palm", "0.08 0.12 0.04", "0 0 0.02"),
    '<link name="flange"/><joint name="to_flange" type="fixed"><parent link="palm"/><child link="flange"/>'
    '<origin xyz="0 0 0.08"/></joint>',
)  # z of the flange, in the plane of the finger tips, is the x of the base while all joints read zero


def write_urdf(folder: Path, *lines: str, name: str = "arm.urdf") -> Path:
    """A robot whose elements stand in lines 2, 3, …"""
    path = folder / name
    path.write_text("\n".join(['<robot name="rig">', *lines, "</robot>"]), encoding="utf-8")
    return path
