"""Names of elements and attributes that the reader does not know.

Files of other programs are full of extensions: these are remarks. A name is refused only where it resembles a known one
that is missing and that the robot needs, as its default would then stand in for what was written.
"""

from collections.abc import Iterable, Iterator
from typing import Final

from cellplan.files.input.findings import did_you_mean
from cellplan.files.robots.urdf.document.xml import Element, Remarks

MOST_EXTRA: Final = 2  # characters by which a misspelt name is longer or shorter
CHILDREN: Final = {
    "link": ("inertial", "visual", "collision"),
    "joint": ("origin", "parent", "child", "axis", "limit", "mimic", "dynamics", "calibration", "safety_controller"),
    "visual": ("origin", "geometry", "material"),
    "collision": ("origin", "geometry", "material"),
}
NEEDED_CHILDREN: Final = {
    "fixed": ("origin", "parent", "child"),
    "moving": ("origin", "parent", "child", "axis", "limit", "mimic"),
    "visual": ("origin", "geometry"),
    "collision": ("origin", "geometry"),
}
ATTRIBUTES: Final = {
    "origin": ("xyz", "rpy", "quat_xyzw"),
    "axis": ("xyz",),
    "limit": ("lower", "upper", "velocity", "effort", "acceleration", "deceleration", "jerk"),
    "mimic": ("joint", "multiplier", "offset"),
    "mesh": ("filename", "scale"),
}  # of the elements in which a missing attribute has a default
UNUSED: Final = {
    "link": ("inertial",),
    "visual": ("material",),
    "collision": ("material",),
    "joint": ("dynamics", "calibration"),
}  # elements that are known and say nothing about what is planned or judged here
UNUSED_ATTRIBUTES: Final = {"limit": ("effort",), "safety_controller": ("k_position", "k_velocity")}
NEEDED_LIMITS: Final = {"continuous": ("velocity",)}  # of other moving joints the first three


def check_spelling(links: Iterable[Element], joints: Iterable[Element], remarks: Remarks) -> None:
    """Compare all names below links and joints with the known ones; unknown ones go into the remarks.

    ``InputError`` where one resembles a name that is missing and needed.
    """
    for link in links:
        owner = f"link '{link.attributes.get('name', '')}'"
        shapes = link.all("collision") or link.all("visual")
        needed = () if link.all("collision") else ("collision",) if shapes else ("collision", "visual")
        _check_children(link, needed, owner, remarks=remarks)
        for solid in shapes:
            _check_children(solid, NEEDED_CHILDREN[solid.tag], owner, remarks=remarks)
            for child in solid.children:
                _check_attributes(child, owner, remarks=remarks)
            for shape in (shape for geometry in solid.all("geometry") for shape in geometry.children):
                _check_attributes(shape, owner, remarks=remarks)
    for joint in joints:
        owner, kind = f"joint '{joint.attributes.get('name', '')}'", joint.attributes.get("type", "").strip()
        _check_children(joint, NEEDED_CHILDREN["fixed" if kind == "fixed" else "moving"], owner, remarks=remarks)
        for child in joint.children:
            _check_attributes(child, owner, kind=kind, remarks=remarks)


def unused_names(root: Element) -> Iterator[str]:
    """Elements and attributes that are known by name and not used, in the order of the file."""
    for element in root.children:
        if element.tag not in ("link", "joint"):
            yield f"<{element.tag}>"
            continue
        for parent in (element, *element.all("visual", "collision")):
            yield from (f"<{child.tag}>" for child in parent.all(*UNUSED[parent.tag]))
        for child in element.children if element.tag == "joint" else ():
            names = UNUSED_ATTRIBUTES.get(child.tag, ())
            yield from (f"{name} of <{child.tag}>" for name in names if name in child.attributes)


def _check_children(element: Element, needed: Iterable[str], owner: str, *, remarks: Remarks) -> None:
    """Names of the elements below one element."""
    missing = [tag for tag in needed if not element.all(tag)]
    for child in element.children:
        if child.tag in CHILDREN[element.tag]:
            continue
        bodies = ["collision"] if child.all("geometry") else []  # one of several would be lost
        hint = _misspelt(child.tag, missing + bodies)
        if hint:
            raise child.error(f"{owner}: unknown element <{child.tag}>{hint}")
        text = f"{owner}: element <{child.tag}> is not known and was not read"
        remarks.add(f"{element.tag} <{child.tag}>", text, child)


def _check_attributes(element: Element, owner: str, *, kind: str = "", remarks: Remarks) -> None:
    """Names of the attributes of one element; ``kind`` is the type of the joint that it belongs to."""
    known = ATTRIBUTES.get(element.tag)
    if known is None:
        return
    needed = NEEDED_LIMITS.get(kind, known[:3]) if element.tag == "limit" else known
    needed = () if kind == "fixed" and element.tag != "origin" else needed
    missing = [name for name in needed if name not in element.attributes]
    for name in element.attributes:
        if name in known:
            continue
        hint = _misspelt(name, missing)
        if hint:
            raise element.error(f"{owner}: unknown attribute '{name}' in <{element.tag}>{hint}")
        text = f"{owner}: attribute '{name}' of <{element.tag}> is not known and was not read"
        remarks.add(f"<{element.tag}> {name}", text, element)


def _misspelt(name: str, missing: Iterable[str]) -> str:
    """Which missing name was probably meant; empty for none."""
    return did_you_mean(
        name.lower(), [candidate for candidate in missing if abs(len(name) - len(candidate)) <= MOST_EXTRA]
    )
