"""Draw the bundled robots, one picture each in ``docs/images``: ``python docs/make_robot_pictures.py [NAME ...]``."""

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from PIL import Image

from cellplan.files.robots.joint_table import load_bundled
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.transforms import Array, transform_points
from cellplan.model.cell.cell import Robot, Tool
from cellplan.model.robot.robot import RobotModel
from cellplan.scene.kinematics.screw_chain import ScrewChain

IMAGES = Path(__file__).resolve().parent / "images"
SEGMENTS = 36
RESOLUTION = 70  # [dots per inch]
COLOURS = 128  # of a picture, to keep the file small
LINK_COLOURS = ("#4d4d4d", "#c8642b", "#2f6fab", "#d6a03b", "#4c8f5b", "#8a5aa5", "#c03a4b", "#7f7f7f")
LIGHT = np.array([0.35, -0.6, 0.72])  # direction to the lamp, in the frame of each view
AMBIENT = 0.45
MARGIN = 60.0  # [mm] white round the robot
HEIGHT = 4.2  # [inch] of one view
LOWEST, WIDEST = 1.6, 14.0  # [inch] of a row of views with its titles, and across all views of a row

# Working configuration of each robot in [deg] or [mm], the arm bent as it stands in a cell.
WORKING_POSTURES = {
    "reis_rv20_16": (0, -93, 108, 0, -15, 0),
    "kuka_kr6": (20, -12, 17, 30, 85, 0),
    "kuka_kr6_maker_zero": (-20, -102, 107, -30, 85, 0),
    "abb_irb1600": (20, -12, 14, 30, 45, 0),
    "staubli_rx90l": (15, -20, 110, 30, 60, 0),
    "staubli_rx90l_as_printed": (15, -20, 110, 0, 60, 0),
    "planar_3r": (30, 60, -40),
    "kuka_kr16_2": (-20, -80, 95, 30, 60, 0),
    "abb_irb1600_8_145": (20, 15, 10, 30, 50, 0),
    "staubli_rx160": (15, 20, 100, 30, 50, 0),
    "kuka_lbr_iiwa_14_r820": (20, 30, 20, -80, -20, 70, 0),
    "kuka_lbr_iiwa_7_r800": (20, 30, 20, -80, -20, 70, 0),
    "franka_panda": (20, -10, 10, -125, 0, 125, 45),
    "ur5e": (20, -60, 80, -110, -90, 0),
    "ur10e": (20, -60, 80, -110, -90, 0),
    "motopos_d500": (40, 20),
    "rail_kl100_2": (600,),
}
# Axes of B drawn to the right and upwards, and the one that points out of the sheet.
VIEWS = {
    "side": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
    "front": np.array([[0, 1.0, 0], [0, 0, 1], [1, 0, 0]]),
    "top": np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1]]),
}

mpl.use("agg")
mpl.rcParams.update({"font.family": "DejaVu Sans", "font.size": 9})


def triangles_of(model: RobotModel, configuration: tuple[float, ...]) -> tuple[Array, list[int]]:
    """Triangles of all bodies in B, shape (M, 3, 3) in [mm], and the link of each; the base is 0."""
    n = len(model.joints)
    tool = Tool(X_FT=np.eye(4), bodies=())
    placed = Robot(name=model.name, model=model, X_WB=np.eye(4), tool=tool, start=None, weights=np.ones(n))
    q = [value / joint.display_unit.scale for joint, value in zip(model.joints, configuration, strict=True)]
    D = ScrewChain(placed).link_displacements(np.array([q]))[0]
    triangles, links = [], []
    for body in model.bodies:
        mesh = tessellate(body.shape, SEGMENTS)
        corners = finer(transform_points(D[body.link + 1] @ body.X_BS, mesh.vertices)[mesh.faces])
        triangles.append(1000.0 * corners)
        links += [body.link + 1] * len(corners)
    return np.concatenate(triangles), links


def finer(triangles: Array) -> Array:
    """Each triangle cut into sixteen, so that sorting them by depth hides what is hidden."""
    for _ in range(2):
        a, b, c = np.moveaxis(triangles, 1, 0)
        ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
        triangles = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return triangles


def draw(axes: Axes, triangles: Array, *, links: list[int], view: Array) -> None:
    """Paint the triangles that face the viewer, far ones first, brighter towards the lamp."""
    seen = triangles @ view.T
    normals = np.cross(seen[:, 1] - seen[:, 0], seen[:, 2] - seen[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    faces_viewer = normals[:, 2] > 1e-9 * lengths
    order = np.argsort(seen[:, :, 2].mean(axis=1), kind="stable")
    order = order[faces_viewer[order]]
    brightness = AMBIENT + (1.0 - AMBIENT) * np.clip(normals @ LIGHT / lengths, 0.0, 1.0)
    colours = np.array([to_rgb(LINK_COLOURS[link]) for link in links]) * brightness[:, None]
    axes.add_collection(
        PolyCollection(
            seen[order][:, :, :2], facecolors=colours[order], edgecolors="face", linewidths=0.5, antialiaseds=False
        )
    )


def limits_of(triangles: list[Array], view: Array) -> Array:
    """Smallest and largest co-ordinates in a view over several configurations, shape (2, 2), in [mm]."""
    points = np.concatenate(triangles).reshape(-1, 3) @ view[:2].T
    return np.array([points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN])


def draw_robot(model: RobotModel) -> None:
    """One picture: side, front and top view, at the reference configuration above and a working configuration below."""
    zero = (0.0,) * len(model.joints)
    configurations = {"reference configuration": zero, "working configuration": WORKING_POSTURES[model.name]}
    bodies = {name: triangles_of(model, configuration) for name, configuration in configurations.items()}
    boxes = [limits_of([triangles for triangles, _ in bodies.values()], view) for view in VIEWS.values()]
    widths = [float(box[1, 0] - box[0, 0]) for box in boxes]
    height = max(float(box[1, 1] - box[0, 1]) for box in boxes)  # one for all: every view has the same scale
    view_height = min(HEIGHT, WIDEST * height / sum(widths))
    size = (view_height * sum(widths) / height + 2.0, 2.0 * max(view_height, LOWEST))
    figure, sheet = plt.subplots(2, 3, figsize=size, width_ratios=widths, layout="constrained", dpi=RESOLUTION)
    for row, (configuration, (triangles, links)) in zip(sheet, bodies.items(), strict=True):
        for axes, (name, view), box in zip(row, VIEWS.items(), boxes, strict=True):
            draw(axes, triangles, links=links, view=view)
            middle = float(box[:, 1].mean())
            axes.set(xlim=box[:, 0], ylim=(middle - 0.5 * height, middle + 0.5 * height), aspect="equal")
            axes.set_title(f"{name},\n{configuration}")
            right, up = ("xyz"[int(np.argmax(np.abs(view[i])))] for i in (0, 1))
            axes.set(xlabel=f"{right} [mm]", ylabel=f"{up} [mm]")
            axes.grid(visible=True, color="#dddddd", linewidth=0.5)
            axes.set_axisbelow(True)
    path = IMAGES / f"robot_{model.name}.png"
    figure.savefig(path, metadata={"Software": None})
    plt.close(figure)
    Image.open(path).convert("RGB").quantize(COLOURS).save(path, optimize=True)


def main(names: list[str]) -> None:
    """Draw the bundled robots of these names, all of them for none."""
    IMAGES.mkdir(exist_ok=True)
    for name in names or WORKING_POSTURES:
        draw_robot(load_bundled(name))


if __name__ == "__main__":
    main(sys.argv[1:])
