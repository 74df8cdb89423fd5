"""Draw the four-robot cell at work: ``python docs/make_cell_picture.py`` writes ``docs/images/four_robots.png``.

A small painter of its own: perspective, depth buffers, one lamp with shadows, and lines where bodies end. The same cell
gives the same picture.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.colors import to_rgb
from PIL import Image, ImageDraw, ImageFont

from cellplan import Solution, load_cell, solve
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.mesh.topology import make_mesh
from cellplan.geometry.shapes import Capsule, Mesh
from cellplan.geometry.transforms import Array, frame_from_axes, inverse, pose_from, transform_points
from cellplan.model.cell.cell import Cell
from cellplan.report.plots.palette import INK, robot_colours
from cellplan.scene.bodies import Kind, body_poses, is_ground, scene_bodies
from cellplan.scene.kinematics.screw_chain import ScrewChain

ROOT: Final = Path(__file__).resolve().parent.parent
TARGET: Final = ROOT / "docs" / "images" / "four_robots.png"
INSTANT: Final = 1.5  # [s] on the clock of the cell
FINER: Final = 2  # pixels drawn per pixel shown, each way
TONES: Final = 85  # steps from black to white in the file: too fine to see, and smaller to store
SEGMENTS: Final = 64  # sides of a round body
CREASE: Final = np.cos(np.radians(40.0))  # faces that meet at less are drawn as one round surface

LENS: Final = 3.36  # focal length in half widths of the picture
LAMP: Final = np.array([0.30, -0.42, 0.86]) / np.linalg.norm([0.30, -0.42, 0.86])  # direction to the lamp
SHADOW_SIDE: Final = 2400  # pixels of the lamp's view, each way
SHADOW_ROOM: Final = 0.010  # [m] by which a surface does not shade itself
AMBIENT, FILL, SHADE, GLOSS = 0.44, 0.20, 0.30, 0.14  # light from everywhere and from the viewer, lamp in shadow, shine

GRID, GRID_LINE = 0.5, 0.005  # [m] between the lines on the floor, and half their width
FLOOR, LINE, PART, STAND, METAL = "#f3f5f8", "#cfd6de", "#c9ced4", "#aab2bc", "#525b66"
SHADES: Final = {
    Kind.PART: PART,
    Kind.TOOL: METAL,
    Kind.PEDESTAL: STAND,
    Kind.OBSTACLE: STAND,
}  # others have the colour of their robot
ROD, LINE_RADIUS = 0.010, 0.0055  # [m] radius of the line from flange to tip, and of the line that stands for a path


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class View:
    """Where a picture is taken from, in [m], and how large it is, in pixels.

    Attributes:
        eye: Place of the viewer.
        target: The middle of the picture.
        width: Pixels.
        height: Pixels.
        reach: Half width of what casts shadows.
        fade: Distances from the middle at which the floor begins and ends to vanish.
    """

    eye: Array
    target: Array
    width: int
    height: int
    reach: float
    fade: tuple[float, float]


FOUR_ROBOTS: Final = View(
    eye=np.array([5.0, -5.0, 3.9]),
    target=np.array([1.10, -0.02, 0.75]),
    width=1400,
    height=840,
    reach=2.6,
    fade=(2.3, 4.2),
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surface:
    """Corners and normals of triangles in the world, shape (M, 3, 3) each, and a colour for each of them."""

    corners: Array
    normals: Array
    colours: Array
    things: np.ndarray[Any, Any]


def surface_of(pieces: Iterator[tuple[Mesh, Array, str]]) -> Surface:
    """Join meshes with their poses and colours."""
    corners, normals, colours, things = [], [], [], []
    for index, (mesh, X_WS, colour) in enumerate(pieces):
        corners.append(transform_points(X_WS, mesh.vertices)[mesh.faces])
        normals.append(round_normals(mesh) @ X_WS[:3, :3].T)
        colours.append(np.tile(to_rgb(colour), (len(mesh.faces), 1)))
        things.append(np.full(len(mesh.faces), index))
    return Surface(
        corners=np.concatenate(corners),
        normals=np.concatenate(normals),
        colours=np.concatenate(colours),
        things=np.concatenate(things),
    )


def round_normals(mesh: Mesh) -> Array:
    """Unit normal at each corner of each triangle: the mean over the faces there that meet at no crease."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    weighted = np.cross(b - a, c - a)
    unit = weighted / np.maximum(np.linalg.norm(weighted, axis=1, keepdims=True), 1e-15)
    flat = mesh.faces.ravel()
    order = np.argsort(flat, kind="stable")
    normals = np.empty((len(flat), 3))
    for group in np.split(order, np.flatnonzero(np.diff(flat[order])) + 1):
        faces = group // 3
        normals[group] = (unit[faces] @ unit[faces].T > CREASE) @ weighted[faces]
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-15)
    return normals.reshape(-1, 3, 3)


def pieces_of(solution: Solution, instant: float = INSTANT) -> Iterator[tuple[Mesh, Array, str]]:
    """Everything that stands on the floor at an instant: bodies, pedestals, tools without a body, and the paths."""
    cell, motion = solution.cell, solution.runs[0].motion
    k = int(np.searchsorted(motion.times, instant))
    q = {robot.name: motion.q[k : k + 1, cell.columns(robot.name)] for robot in cell.robots}
    chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
    colours = robot_colours(cell)
    bodies = [body for body in scene_bodies(cell) if not is_ground(body)]
    poses = body_poses(bodies, chains, q)
    for body, R, p in zip(bodies, poses.R[:, 0], poses.p[:, 0], strict=True):
        colour = SHADES.get(body.kind) or colours[str(body.robot)]
        yield tessellate(body.shape, SEGMENTS), pose_from(R, p), colour
    for robot in cell.robots:
        flange = chains[robot.name].flange_poses(q[robot.name])[0]
        yield from rods(np.stack([flange[:3, 3], (flange @ robot.tool.X_FT)[:3, 3]]), radius=ROD, colour=METAL)
    yield from drawn_paths(solution, part_pose(cell, chains, q))


def part_pose(cell: Cell, chains: dict[str, ScrewChain], q: dict[str, Array]) -> Array:
    """Pose of the part in the world, shape (4, 4)."""
    if cell.part.X_WP is not None:
        return cell.part.X_WP
    grasp = cell.part.held_by[0]
    X_WP: Array = chains[grasp.robot].tool_poses(q[grasp.robot])[0] @ inverse(grasp.X_PT)
    return X_WP


def drawn_paths(solution: Solution, X_WP: Array) -> Iterator[tuple[Mesh, Array, str]]:
    """The path of every task as a line on the part, in the colour of its robot."""
    colours = robot_colours(solution.cell)
    for scheduled in solution.runs[0].schedule.tasks:
        points = transform_points(X_WP, scheduled.X_PT[::20, :3, 3])
        yield from rods(points, radius=LINE_RADIUS, colour=colours[scheduled.task.robot])


def rods(points: Array, *, radius: float, colour: str) -> Iterator[tuple[Mesh, Array, str]]:
    """Straight rods with round ends between neighbouring points."""
    for start, end in pairwise(points):
        length = float(np.linalg.norm(end - start))
        if length > 1e-6:
            z = (end - start) / length
            hint = np.eye(3)[int(np.argmin(np.abs(z)))]
            X_WS = pose_from(frame_from_axes(z, hint), 0.5 * (start + end))
            yield rod_mesh(radius, length), X_WS, colour


def rod_mesh(radius: float, length: float) -> Mesh:
    """A rod with round ends about z."""
    mesh = tessellate(Capsule(radius, length), 12)
    return make_mesh(mesh.vertices, mesh.faces, source="rod")


def rasterise(screen: Array, nearness: Array, shape: tuple[int, int]) -> tuple[np.ndarray[Any, Any], Array]:
    """The triangle nearest to the viewer at each pixel (-1: none) and how near it is.

    Args:
        screen: Corners in pixels, shape (M, 3, 2).
        nearness: A number at each corner that is linear over the screen and grows towards the viewer, shape (M, 3).
        shape: Rows and columns.
    """
    rows, columns = shape
    low = np.clip(np.floor(screen.min(axis=1)).astype(int), 0, (columns, rows))
    high = np.clip(np.ceil(screen.max(axis=1)).astype(int), 0, (columns, rows))
    extent = np.maximum(high - low, 0)
    counts = extent.prod(axis=1)
    best, nearest = np.full(rows * columns, -np.inf), np.full(rows * columns, -1)
    for chunk in np.array_split(np.arange(len(screen)), max(1, int(counts.sum() // 3_000_000) + 1)):
        triangle = np.repeat(chunk, counts[chunk])
        place = np.arange(len(triangle)) - np.repeat(np.cumsum(counts[chunk]) - counts[chunk], counts[chunk])
        x = low[triangle, 0] + place % extent[triangle, 0]
        y = low[triangle, 1] + place // extent[triangle, 0]
        shares = barycentric(screen[triangle], np.stack([x + 0.5, y + 0.5], axis=1))
        inside = (shares >= 0.0).all(axis=1)
        pixel, triangle = (y * columns + x)[inside], triangle[inside]
        depth = np.sum(shares[inside] * nearness[triangle], axis=1)
        np.maximum.at(best, pixel, depth)
        wins = depth >= best[pixel]
        nearest[pixel[wins]] = triangle[wins]
    return nearest.reshape(shape), best.reshape(shape)


def barycentric(corners: Array, points: Array) -> Array:
    """Shares of the three corners, shape (N, 3, 2), in points of shape (N, 2); negative outside."""
    a, b, c = np.moveaxis(corners, 1, 0)

    def area(p: Array, q: Array, r: Array) -> Array:
        return (q[:, 0] - p[:, 0]) * (r[:, 1] - p[:, 1]) - (q[:, 1] - p[:, 1]) * (r[:, 0] - p[:, 0])

    whole = area(a, b, c)
    whole = np.where(np.abs(whole) < 1e-9, np.inf, whole)
    shares = np.stack([area(b, c, points), area(c, a, points), area(a, b, points)], axis=1) / whole[:, None]
    return np.where(np.isinf(whole)[:, None], -1.0, shares)


class Lamp:
    """What the lamp sees: everything farther from it lies in shadow."""

    def __init__(self, surface: Surface, view: View) -> None:
        """Brightness of the surface as seen from the lamp."""
        self._shown = view
        self._R = frame_from_axes(LAMP, np.array([0.0, 0.0, 1.0])).T
        seen = self._view(surface.corners)
        side = (SHADOW_SIDE, SHADOW_SIDE)
        _, self._depth = rasterise(seen[:, :, :2], seen[:, :, 2], side)

    def _view(self, points: Array) -> Array:
        scale = 0.5 * SHADOW_SIDE / self._shown.reach
        seen = (points - self._shown.target) @ self._R.T
        return np.concatenate([seen[..., :2] * scale + 0.5 * SHADOW_SIDE, seen[..., 2:]], axis=-1)

    def light(self, points: Array) -> Array:
        """Share of the lamp's light that reaches points of shape (N, 3), soft at the border."""
        seen = self._view(points)
        x, y = seen[:, 0].astype(int), seen[:, 1].astype(int)
        offsets = range(-4, 5, 2)
        lit = np.zeros(len(points))
        for dx in offsets:
            for dy in offsets:
                u, v = np.clip(x + dx, 0, SHADOW_SIDE - 1), np.clip(y + dy, 0, SHADOW_SIDE - 1)
                lit += self._depth[v, u] <= seen[:, 2] + SHADOW_ROOM
        return lit / len(offsets) ** 2


def axes_of(view: View) -> Array:
    """Directions to the right, down and away from the viewer, one in each row."""
    forward = (view.target - view.eye) / np.linalg.norm(view.target - view.eye)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


def paint(surface: Surface, view: View) -> Array:
    """The picture, shape (height, width, 3), values 0 to 1."""
    rows, columns = view.height * FINER, view.width * FINER
    axes = axes_of(view)
    focus = 0.5 * LENS * columns
    seen = (surface.corners - view.eye) @ axes.T
    screen = focus * seen[:, :, :2] / seen[:, :, 2:] + (0.5 * columns, 0.5 * rows)
    nearest, nearness = rasterise(screen, 1.0 / seen[:, :, 2], (rows, columns))
    y, x = np.divmod(np.arange(rows * columns), columns)
    rays = np.stack([(x + 0.5 - 0.5 * columns) / focus, (y + 0.5 - 0.5 * rows) / focus, np.ones(len(x))], axis=1) @ axes
    lamp = Lamp(surface, view)
    image = floor_colours(rays, lamp, view)
    covered = np.flatnonzero(nearest.ravel() >= 0)
    triangle = nearest.ravel()[covered]
    points = view.eye + rays[covered] / nearness.ravel()[covered, None]
    shares = (
        barycentric(screen[triangle], np.stack([x[covered] + 0.5, y[covered] + 0.5], axis=1)) / seen[triangle, :, 2]
    )
    normals = np.einsum("nk,nkd->nd", shares, surface.normals[triangle])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    image[covered] = shaded(surface.colours[triangle], normals, lamp.light(points + 0.004 * normals), rays[covered])
    image = image.reshape(rows, columns, 3)
    ids = np.where(nearest >= 0, surface.things[nearest], -1)
    image[outlines(ids, nearness)] *= 0.55
    return image.reshape(view.height, FINER, view.width, FINER, 3).mean(axis=(1, 3))


def shaded(colours: Array, normals: Array, light: Array, rays: Array) -> Array:
    """Colours under light from everywhere, the lamp and its reflection."""
    lamp = np.clip(normals @ LAMP, 0.0, 1.0) * (SHADE + (1.0 - SHADE) * light)
    sky = AMBIENT * (0.80 + 0.20 * normals[:, 2])
    to_viewer = -rays / np.linalg.norm(rays, axis=1, keepdims=True)
    fill = FILL * np.clip(np.sum(normals * to_viewer, axis=1), 0.0, 1.0)
    half = LAMP + to_viewer
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    gloss = GLOSS * light * np.clip(np.sum(normals * half, axis=1), 0.0, 1.0) ** 28
    return np.clip(
        1.12 * colours * (sky + fill + (1.0 - AMBIENT - FILL) * 1.3 * lamp)[:, None] + gloss[:, None], 0.0, 1.0
    )


def floor_colours(rays: Array, lamp: Lamp, view: View) -> Array:
    """Colour along each ray where nothing stands in the way: a grid with shadows that fades into white."""
    image = np.ones((len(rays), 3))
    down = np.flatnonzero(rays[:, 2] < -1e-3)
    points = view.eye - rays[down] * (view.eye[2] / rays[down, 2])[:, None]
    away = np.linalg.norm(points[:, :2] - view.target[:2], axis=1)
    near = away < view.fade[1]
    down, points, away = down[near], points[near], away[near]
    to_line = np.abs((points[:, :2] + 0.5 * GRID) % GRID - 0.5 * GRID).min(axis=1)
    colours = np.where((to_line < GRID_LINE)[:, None], to_rgb(LINE), to_rgb(FLOOR))
    colours = colours * (0.80 + 0.20 * lamp.light(points))[:, None]
    fade = np.clip((away - view.fade[0]) / (view.fade[1] - view.fade[0]), 0.0, 1.0)[:, None]
    fade = fade * fade * (3.0 - 2.0 * fade)
    image[down] = colours * (1.0 - fade) + fade
    return image


def outlines(ids: np.ndarray[Any, Any], nearness: Array) -> np.ndarray[Any, Any]:
    """Pixels where one body ends before another, or before the floor."""
    edge = np.zeros(ids.shape, dtype=bool)
    distance = 1.0 / np.where(np.isfinite(nearness), nearness, 1e-3)
    for axis in (0, 1):
        here, there = np.moveaxis(ids, axis, 0), np.moveaxis(edge, axis, 0)
        far = np.moveaxis(distance, axis, 0)
        jump = (here[1:] != here[:-1]) & (np.abs(far[1:] - far[:-1]) > 0.012)
        there[1:] |= jump
        there[:-1] |= jump
    return edge


def with_legend(picture: Image.Image, solution: Solution) -> Image.Image:
    """Who is who, in the lower left corner."""
    cell = solution.cell
    fonts = Path(mpl.get_data_path()) / "fonts" / "ttf"
    bold, plain = (ImageFont.truetype(str(fonts / f"DejaVuSans{kind}.ttf"), 19) for kind in ("-Bold", ""))
    pen = ImageDraw.Draw(picture)
    work = {task.robot: f"draws the {task.name}" for task in cell.tasks}
    colours = robot_colours(cell)
    for index, robot in enumerate(cell.robots):
        y = FOUR_ROBOTS.height - 34 - 30 * (len(cell.robots) - 1 - index)
        pen.rounded_rectangle((28, y - 8, 44, y + 8), radius=3, fill=colours[robot.name])
        pen.text((56, y), robot.name, fill=INK, font=bold, anchor="lm")
        pen.text((150, y), work.get(robot.name, "carries the cylinder"), fill=INK, font=plain, anchor="lm")
    return picture


def picture_of(solution: Solution, view: View, instant: float = INSTANT) -> Image.Image:
    """The cell at an instant."""
    tones = np.round(TONES * paint(surface_of(pieces_of(solution, instant)), view)) / TONES
    return Image.fromarray(np.round(255.0 * tones).astype(np.uint8))


def main() -> None:
    """Solve the cell and draw it."""
    solution = solve(load_cell(ROOT / "cells" / "four_robots.yaml"))
    with_legend(picture_of(solution, FOUR_ROBOTS), solution).save(TARGET, optimize=True)


if __name__ == "__main__":
    main()
