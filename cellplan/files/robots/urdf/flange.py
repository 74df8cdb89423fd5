"""The flange of a URDF: a link is taken without being named only where its z points along the last axis."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.files.input.findings import listed
from cellplan.files.robots.urdf.document.document import UrdfJoint
from cellplan.files.robots.urdf.tree import UrdfTree, known_link, links_in_order, moving_leaves
from cellplan.geometry.transforms import Array

CONTROLLER_FRAME: Final = "tool0"  # the tool frame of a controller whose tool data are all zero
FLANGE_NAMES: Final = (CONTROLLER_FRAME, "flange")  # taken in this order when the user names none
ALONG: Final = 0.999  # [-] cosine between z and the last axis: 2.6 deg, rounding of angles in files
SAME_PLACE: Final = 1e-6  # [m] between two frames on one mounting face
STATED_TURN: Final = 1e-3  # [rad] a smaller turn about z is the rounding of a file


def choose_flange(tree: UrdfTree, desired: str | None) -> str:
    """Name of the flange link: the desired one, else ``tool0``, else ``flange``, else the only moving leaf.

    One that is not named by the user has z along the axis of the last joint, or gives way to the link at its place that
    has: with x out of the mounting face (REP 199) tools would stick out sideways. After a sliding joint only ``tool0``
    is no guess.
    """
    if desired is not None:
        return known_link(tree, desired, "flange")
    usual = usual_flange(tree)
    last = last_joint(tree, usual)
    is_frame_of_controller = usual == CONTROLLER_FRAME
    if last is None or is_along(tree, usual) or (last.kind == "prismatic" and is_frame_of_controller):
        return usual
    others = [] if last.kind == "prismatic" else list(_upright_there(tree, usual, last))
    if others and all(np.allclose(_on_last(tree, other), _on_last(tree, others[0])) for other in others):
        return others[0]
    raise _no_guess(tree, usual, last)


def usual_flange(tree: UrdfTree) -> str:
    """``tool0``, else ``flange``, else the only moving leaf; ``InputError`` where there is none, or several."""
    for name in FLANGE_NAMES:
        if name in tree.document.links:
            return name
    leaves = moving_leaves(tree)
    if not leaves:
        raise InputError(f"{tree.document.file}: expected a joint that moves a link, got none")
    if len(leaves) > 1:
        names = listed(leaves)
        raise InputError(f"{tree.document.file}: flange: expected the name of a link, as it could be any of: {names}")
    return leaves[0]


def flange_remarks(tree: UrdfTree, flange: str, *, is_named: bool) -> Iterator[str]:
    """What a user has to know about the orientation of a flange."""
    last, file = last_joint(tree, flange), tree.document.file
    if last is None or last.kind == "prismatic":
        return
    if not is_along(tree, flange):
        yield f"{file}: flange '{flange}': its z is {_angle(tree, flange):.3g} deg off the axis of '{last.name}'"
    at = _on_last(tree, flange)
    inward = -float(at[:3, 3] @ at[:3, 2])
    if is_along(tree, flange) and inward > SAME_PLACE:
        yield (
            f"{file}: flange '{flange}': its z points back to '{last.child}', {1e3 * inward:.4g} mm behind it: tools "
            f"would stick into the arm"
        )
    usual = flange if is_named else usual_flange(tree)
    if usual != flange:
        yield f"{file}: flange '{flange}' is taken, as {_lean(tree, usual, last)}"
    if flange != CONTROLLER_FRAME in tree.document.links and last_joint(tree, CONTROLLER_FRAME) is last:
        R = _on_last(tree, CONTROLLER_FRAME)[:3, :3].T @ _on_last(tree, flange)[:3, :3]
        turn = float(np.arctan2(R[1, 0], R[0, 0]))
        if R[2, 2] > ALONG and abs(turn) > STATED_TURN:
            against = f"'{CONTROLLER_FRAME}', the frame of the controller"
            yield f"{file}: flange '{flange}' is turned by {np.degrees(turn):.6g} deg about z against {against}"


def axis_along(tree: UrdfTree, link: str) -> str:
    """Which axis of a link lies along that of the last joint: ``x``, ``y``, ``z``; empty for none."""
    last = last_joint(tree, link)
    if last is None or last.kind == "prismatic":
        return ""
    cosines = np.abs(_on_last(tree, link)[:3, :3].T @ last.axis_J)
    return "xyz"[int(np.argmax(cosines))] if np.max(cosines) > ALONG else ""


def is_along(tree: UrdfTree, link: str) -> bool:
    """Whether z of a link lies along the axis of the last joint, which turns."""
    return axis_along(tree, link) == "z"


def last_joint(tree: UrdfTree, link: str) -> UrdfJoint | None:
    """The last joint that moves a link; None for a link that stands still."""
    return next((joint for joint in reversed(tree.path_to(link)) if not joint.is_fixed), None)


def _upright_there(tree: UrdfTree, usual: str, last: UrdfJoint) -> Iterator[str]:
    """Links at the place of the usual flange whose z points out along the last axis."""
    X = _on_last(tree, usual)
    for link in links_in_order(tree):
        if last_joint(tree, link.name) is not last or not is_along(tree, link.name):
            continue
        there = _on_last(tree, link.name)
        is_inward = axis_along(tree, usual) == "x" and float(there[:3, 2] @ X[:3, 0]) < 0.0  # x is out, by REP 199
        if np.linalg.norm(there[:3, 3] - X[:3, 3]) < SAME_PLACE and not is_inward:
            yield link.name


def _on_last(tree: UrdfTree, link: str) -> Array:
    """Pose of a link in the frame of the last joint that moves it, when that joint reads zero."""
    X = np.eye(4)
    for joint in reversed(tree.path_to(link)):
        if not joint.is_fixed:
            break
        X = joint.X_PJ @ X
    return X


def _angle(tree: UrdfTree, link: str) -> float:
    """Degrees between z of a link and the axis of the last joint."""
    last = last_joint(tree, link)
    cosine = 0.0 if last is None else abs(float(_on_last(tree, link)[:3, 2] @ last.axis_J))
    return float(np.degrees(np.arccos(min(1.0, cosine))))


def _lean(tree: UrdfTree, link: str, last: UrdfJoint) -> str:
    """How z of a link stands to the last axis."""
    if last.kind == "prismatic":
        return f"the last joint '{last.name}' slides, which says nothing about z of '{link}'"
    return f"z of '{link}' is {_angle(tree, link):.3g} deg off the axis of '{last.name}'"


def _no_guess(tree: UrdfTree, usual: str, last: UrdfJoint) -> InputError:
    """The links that may be meant, and what to write for each."""
    rigid = [link.name for link in links_in_order(tree) if last_joint(tree, link.name) is last]
    along = {link: axis_along(tree, link) for link in rigid}
    texts = [f"`flange: {link}`" + (f" ({axis} along that axis)" if axis else "") for link, axis in along.items()]
    what = f"expected the name of the link whose z points out of the flange, as {_lean(tree, usual, last)}"
    return InputError(f"{tree.document.file}: flange: {what}: write {' or '.join(texts)}")
