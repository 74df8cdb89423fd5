"""A link whose bodies are far smaller than what is drawn of it is a remark: nothing protects the rest of it."""

from pathlib import Path

import pytest
import trimesh
from builders.urdf_texts import joint, write_urdf

from cellplan.files.robots.urdf.load import UrdfRobot, load_urdf


def box(size: str) -> str:
    return f'<geometry><box size="{size}"/></geometry>'


def mesh(name: str, scale: str = "1") -> str:
    return f'<geometry><mesh filename="{name}.stl" scale="{scale} {scale} {scale}"/></geometry>'


def link(name: str, collision: str, visual: str) -> str:
    return f'<link name="{name}"><visual>{visual}</visual><collision>{collision}</collision></link>'


def loaded(folder: Path, *links: str) -> UrdfRobot:
    """A base, an arm and a hand that carries the flange."""
    trimesh.creation.box((0.08, 0.06, 0.04)).export(folder / "hand.stl")
    trimesh.creation.box((8.0, 6.0, 4.0)).export(folder / "hand_mm.stl")
    fixed = joint("face", "hand", "tool0", '<origin xyz="0 0 0.02"/>', kind="fixed")
    joints = (joint("a1", "base", "arm"), joint("a2", "arm", "hand"), '<link name="tool0"/>', fixed)
    return load_urdf(write_urdf(folder, *links, *joints))


ARM = link("arm", box("0.1 0.1 0.5"), box("0.12 0.1 0.52"))
BASE = link("base", box("0.2 0.2 0.2"), box("0.2 0.2 0.2"))


@pytest.mark.parametrize(
    ("collision", "measures"),
    [
        (mesh("hand", "0.1"), "8 x 6 x 4"),
        (mesh("hand_mm", "0.001"), "8 x 6 x 4"),
        (box("0.08 0.06 0.004"), "80 x 60 x 4"),
    ],
)
def test_a_small_body_of_the_last_link_leaves_its_flange_bare(tmp_path: Path, collision: str, measures: str) -> None:
    robot = loaded(tmp_path, BASE, ARM, link("hand", collision, mesh("hand")))
    remark = f"its bodies measure {measures} mm, its drawing 80 x 60 x 40 mm: nothing protects its flange"
    assert robot.remarks == (f"arm.urdf: link 'hand': {remark}",)


def test_another_link_is_named_likewise(tmp_path: Path) -> None:
    robot = loaded(
        tmp_path, BASE, link("arm", box("0.1 0.1 0.1"), box("0.1 0.1 0.5")), link("hand", mesh("hand"), mesh("hand"))
    )
    assert robot.remarks == (
        "arm.urdf: link 'arm': its bodies measure 100 x 100 x 100 mm, its drawing 100 x 100 x 500 mm: "
        "nothing protects the rest of it",
    )


@pytest.mark.parametrize("visual", [box("0.09 0.07 0.05"), box("0.01 0.01 0.01"), mesh("lost"), box("0.01 x 1")])
def test_what_is_drawn_about_as_large_smaller_or_cannot_be_read_is_no_remark(tmp_path: Path, visual: str) -> None:
    assert loaded(tmp_path, BASE, ARM, link("hand", mesh("hand"), visual)).remarks == ()


def test_several_bodies_stand_for_a_drawing_together_and_drawings_are_no_inputs(tmp_path: Path) -> None:
    half = '<origin xyz="0 0 {}"/>' + box("0.08 0.06 0.02")
    hand = link("hand", half.format(0.01), mesh("hand")).replace(
        "</link>", f"<collision>{half.format(-0.01)}</collision></link>"
    )
    robot = loaded(tmp_path, BASE, ARM, hand)
    assert robot.remarks == ()
    assert robot.mesh_files == ()
