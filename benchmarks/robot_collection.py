"""Robots from other hands: ``python benchmarks/robot_collection.py``.

Every URDF of example-robot-data 6.0 is described by ``cellplan robots``; the lines that this prints are pasted into a
cell of its own, blanks filled with numbers, and ``cellplan check`` reads that cell. The kinematics of each robot that
is read is compared with pinocchio's own reading of the same file. The xacro files of rtb-data follow.

The two collections are taken from the package index (131 MB and 60 MB to download, 415 MB and 147 MB unpacked) and kept
in a folder outside of the project; nothing of them belongs to cellplan.
"""

import argparse
import io
import json
import os
import re
import subprocess
import sys
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import xacro
from xacro import substitution_args

from cellplan.cli.main import run
from cellplan.files.cell.load import load_cell
from cellplan.geometry.transforms import Array, inverse, rotation_vector
from cellplan.model.cell.cell import Robot
from cellplan.scene.kinematics.screw_chain import ScrewChain

URDFS: Final = ("example-robot-data==6.0.0", "131 MB to download, 415 MB unpacked")
XACROS: Final = ("rtb-data==2.0.0", "60 MB to download, 147 MB unpacked")
CONFIGURATIONS: Final = 20
SEED: Final = 20
MAX_SECONDS: Final = 10.0  # of processor time to read a robot
TOLERANCE: Final = 1e-9  # [m] and [rad] between two readings of the same kinematics
FILLED: Final[Mapping[str, float]] = {"lower": -90.0, "upper": 90.0, "velocity": 60.0}  # in place of blanks
NO_LIMIT: Final = 1e3  # [rad] or [m] limits beyond it are no limits
XACRO_FOLDER: Final = Path("rtbdata/xacro")
ARM: Final = re.compile(
    r"(abb|kuka|puma)[^_]*_.*/(?!.*_macro)(irb|kr(?!210)|lbr|puma)[^/]*$"
)  # kr210 has a fault of its own
SHARE: Final = Path("cmeel.prefix/share")
FOLDER: Final = Path(os.environ.get("CELLPLAN_COLLECTIONS", Path.home() / ".cache/cellplan-collections"))
HEAD: Final = """\
cellplan: 1
name: collection
"""
JOB: Final = """\
  worker:
    model: planar_3r
    base: {xyz_mm: [20000, 0, 2000]}
    tool: {xyz_mm: [0, 0, 50], geometry: {cylinder: {radius_mm: 3, length_mm: 50}}}
    start_deg: auto
part:
  geometry: {box: {size_mm: [200, 200, 20]}}
  at: {xyz_mm: [20700, 0, 1920]}
tasks:
  line:
    robot: worker
    path: {polyline: {points_mm: [[-30, 0], [30, 0]], plane: xy}, project: -z}
    axes: [x, y]
motion: {duration_s: 1, step_s: 0.01}
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One robot file.

    Attributes:
        name: Its name in the collection.
        reason: Why it was refused; empty if it was read.
        seconds: Processor time in [s] of describing and checking it, those of child processes included.
        error: Largest difference of the flange's pose from pinocchio's, in [m] and [rad]; NaN if it was not read.
    """

    name: str
    reason: str
    seconds: float
    error: float

    @property
    def is_read(self) -> bool:
        """Whether the file was read."""
        return not self.reason


class NoIndexError(Exception):
    """The collection cannot be downloaded."""


def fetch(requirement: str, size: str, folder: Path) -> Path:
    """Folder of an unpacked package of the index, downloaded unless it is there.

    Args:
        requirement: Name and version of the package.
        size: What it takes, which is printed before anything is downloaded.
        folder: Where packages are kept.

    Raises:
        NoIndexError: There is no index, or it does not have the package.
    """
    place = folder / requirement.replace("==", "-")
    if not place.exists():
        print(f"{requirement}: {size}, into {folder}", file=sys.stderr)
        with TemporaryDirectory() as wheels:
            command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "-d", wheels, requirement]
            got = subprocess.run(command, check=False, capture_output=True, text=True)
            if got.returncode:
                raise NoIndexError(got.stderr.strip().splitlines()[-1] if got.stderr.strip() else "pip failed")
            folder.mkdir(parents=True, exist_ok=True)
            draft = place.with_suffix(".draft")
            with zipfile.ZipFile(next(Path(wheels).glob("*.whl"))) as wheel:
                wheel.extractall(draft)
            draft.rename(place)
    return place


def urdf_files(place: Path) -> list[Path]:
    """The URDFs of the collection that have a joint that moves, by name."""
    files = sorted((place / "cmeel.prefix/share/example-robot-data/robots").rglob("*.urdf"))
    return [file for file in files if re.search(r'type="(revolute|continuous|prismatic)"', file.read_text())]


def try_robot(file: Path, package_dirs: Sequence[Path], urdf: Callable[[], str]) -> Trial:
    """Describe a robot, paste the printed lines into a cell and read it.

    Args:
        file: URDF or xacro file.
        package_dirs: Folders in which its packages are looked up.
        urdf: Gives the text of its URDF, read by other means, for the comparison.
    """
    begin = _seconds()
    with TemporaryDirectory() as folder:
        options = [option for package_dir in package_dirs for option in ("--package-dir", str(package_dir))]
        status, text, errors = _command("robots", str(file), *options, "--json")
        if status != 0:
            return Trial(name=file.name, reason=_reason(errors), seconds=_seconds() - begin, error=np.nan)
        description = json.loads(text)["robots"][0]
        cell_file = Path(folder) / "cell.yaml"
        cell_file.write_text(_cell_text(description))
        allowed = [option for entry in (*package_dirs, file.parent) for option in ("--allow-dir", str(entry))]
        status, _, errors = _command("check", str(cell_file), *allowed, "--quiet")
        if status == 2:
            return Trial(name=file.name, reason=_reason(errors), seconds=_seconds() - begin, error=np.nan)
        seconds = _seconds() - begin
        robot = next(robot for robot in load_cell(cell_file, allow_dirs=(*package_dirs, file.parent)).robots)
        error = disagreement(robot, description["flange"], urdf())
        return Trial(name=file.name, reason="", seconds=seconds, error=error)


def _reason(errors: str) -> str:
    """The first line of an error without folders."""
    return re.sub(r"[\w./-]+/", "", errors.strip().splitlines()[0])


def disagreement(robot: Robot, flange: str, urdf: str) -> float:
    """Largest difference of the flange's pose from that of pinocchio's reading at random configurations.

    Joints that are held still are held where the cell holds them, and joints that mimic others follow these, also in
    pinocchio's model, in which all of them are free.

    Args:
        robot: The robot as the cell has it, its base in the origin of the world.
        flange: Name of the flange link.
        urdf: The text of its URDF.
    """
    model = robot.model
    lower = np.array([max(joint.lower, -1.5) for joint in model.joints])
    upper = np.array([min(joint.upper, 1.5) for joint in model.joints])
    q = np.random.default_rng(SEED).uniform(np.minimum(lower, upper), upper, (CONFIGURATIONS, len(lower)))
    ours = ScrewChain(robot).flange_poses(q)
    theirs = np.array([_flange_pose(urdf, flange, dict(zip(model.joint_names, row, strict=True))) for row in q])
    between = inverse(theirs) @ ours
    return float(max(np.abs(between[:, :3, 3]).max(), np.abs(rotation_vector(between[:, :3, :3])).max()))


def _flange_pose(urdf: str, flange: str, driven: Mapping[str, float]) -> Array:
    """The flange in the root link by pinocchio, shape (4, 4)."""
    model, data, mimics, rest = _pinocchio(urdf)
    values = {**rest, **driven}
    for _ in mimics:  # a leader may mimic another joint
        values |= {name: ratio * values[leader] + offset for name, (leader, ratio, offset) in mimics.items()}
    q = pin.neutral(model)
    for name, value in values.items():
        joint = model.joints[model.getJointId(name)]
        q[joint.idx_q : joint.idx_q + joint.nq] = value if joint.nq == 1 else (np.cos(value), np.sin(value))
    pin.framesForwardKinematics(model, data, q)
    return np.array(data.oMf[model.getFrameId(flange)].homogeneous)


@lru_cache(maxsize=1)
def _pinocchio(urdf: str) -> tuple[Any, Any, dict[str, tuple[str, float, float]], dict[str, float]]:
    """Model and data, the mimic joints with leader, ratio and offset, and the positions at which joints rest."""
    model = pin.buildModelFromXML(urdf)
    mimics, rest = {}, {}
    for joint in ElementTree.fromstring(urdf).findall("joint"):  # noqa: S314 - the text was read strictly before
        if joint.get("type") not in ("revolute", "continuous", "prismatic"):
            continue
        name, limit, mimic = joint.attrib["name"], joint.find("limit"), joint.find("mimic")
        low, high = (float((limit.attrib if limit is not None else {}).get(key, 0.0)) for key in ("lower", "upper"))
        is_limited = joint.get("type") != "continuous" and low < high and max(abs(low), abs(high)) < NO_LIMIT
        rest[name] = min(max(0.0, low), high) if is_limited else 0.0
        if mimic is not None:
            ratio, offset = float(mimic.get("multiplier", 1.0)), float(mimic.get("offset", 0.0))
            mimics[name] = (mimic.attrib["joint"], ratio, offset)
    return model, model.createData(), mimics, rest


def _cell_text(description: Mapping[str, Any]) -> str:
    """A cell with the printed lines, blanks filled, in which the robot stands still beside a small job."""
    lines = description["cell_lines"]
    for key, value in FILLED.items():
        lines = re.sub(rf"({key}_(?:deg|mm)(?:_s)?): …", rf"\1: {value}", lines)
    start = {}
    for joint in description["joints"]:
        unit = "mm" if joint["type"] == "prismatic" else "deg"
        low, high = joint.get(f"lower_{unit}"), joint.get(f"upper_{unit}")
        start[f"{joint['name']}_{unit}"] = 0.0 if low is None or high is None else 0.5 * (low + high)
    return f"{HEAD}{lines.rstrip()}\n    start: {json.dumps(start)}\n{JOB}"


def _command(*arguments: str) -> tuple[int, str, str]:
    """Status, output and errors of a command."""
    out, errors = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(errors):
        status = run(list(arguments))
    return status, out.getvalue(), errors.getvalue()


def _seconds() -> float:
    """Processor time in [s] of this process and of its children that have ended."""
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system


def xacro_files(place: Path) -> list[Path]:
    """Xacro files of whole industrial arms in the second collection, by name."""
    return sorted(file for file in (place / XACRO_FOLDER).rglob("*.xacro") if ARM.search(file.as_posix()))


def package_folders(place: Path) -> list[Path]:
    """Folders in which the packages of the second collection are looked up."""
    root = place / XACRO_FOLDER
    return [root, root / "kuka_description", *sorted(path for path in root.iterdir() if path.is_dir())]


def expanded(file: Path, folders: Sequence[Path]) -> str:
    """The URDF that the package xacro makes of a file by itself; packages are looked up in some folders.

    Args:
        file: The xacro file.
        folders: These folders; a package that none of them holds is taken to be the one above the file.
    """

    def find(package: str) -> str:
        return str(next((folder / package for folder in folders if (folder / package).is_dir()), file.parent.parent))

    usual, substitution_args._eval_find = substitution_args._eval_find, find
    try:
        with redirect_stderr(io.StringIO()):
            return str(xacro.process_file(str(file)).toprettyxml())
    finally:
        substitution_args._eval_find = usual


def table(trials: Iterable[Trial]) -> Iterator[str]:
    """A line for each robot, and a count."""
    every = list(trials)
    width = max((len(trial.name) for trial in every), default=0)
    for trial in every:
        read = f"{trial.error:.1e}" if trial.is_read else f"refused: {trial.reason}"
        yield f"{trial.name:<{width}}  {trial.seconds:5.1f} s  {read}"
    yield f"{sum(trial.is_read for trial in every)} of {len(every)} read"


def try_collection(name: str, folder: Path, only: str = "") -> list[Trial]:
    """Try all robots of a collection.

    Args:
        name: ``urdf`` or ``xacro``.
        folder: Where packages are kept.
        only: Only files whose path has this text.

    Raises:
        NoIndexError: It is not there and cannot be downloaded.
    """
    if name == "urdf":
        place = fetch(*URDFS, folder)
        return [try_robot(file, [place / SHARE], file.read_text) for file in urdf_files(place) if only in str(file)]
    place = fetch(*XACROS, folder)
    folders, files = package_folders(place), [file for file in xacro_files(place) if only in str(file)]
    return [try_robot(file, folders, partial(expanded, file, folders)) for file in files]


def main() -> None:
    """Try both collections and print a line for each robot."""
    parser = argparse.ArgumentParser(description="Read the robots of two public collections.")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="where downloaded packages are kept")
    parser.add_argument("--only", default="", help="only files whose path has this text")
    given = parser.parse_args()
    try:
        for name in ("urdf", "xacro"):
            print("\n".join(table(try_collection(name, given.folder, given.only))))
    except NoIndexError as error:
        print(f"skipped: {error}", file=sys.stderr)


if __name__ == "__main__":
    main()
