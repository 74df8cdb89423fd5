"""``cellplan robots``: the bundled robots, or one robot's file: flanges, joints, bodies and what a cell has to add."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cellplan.cli.completion import robot_models
from cellplan.cli.options import AsJson
from cellplan.cli.output import json_failure, say, say_json, show

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cellplan.model.robot import RobotModel

SCHEMA = "cellplan.robots/1"


Model = Annotated[
    str | None,
    typer.Argument(
        metavar="MODEL",
        help="URDF, xacro file, joint-axis table or bundled robot to describe.",
        show_default=False,
        autocompletion=robot_models,
    ),
]
PackageDirs = Annotated[
    list[Path] | None,
    typer.Option(
        "--package-dir",
        metavar="DIR",
        help="Look up package://NAME/... of a URDF as DIR/NAME/...; may be repeated.",
        show_default=False,
        exists=True,
        file_okay=False,
    ),
]
XacroArgs = Annotated[
    list[str] | None,
    typer.Option(
        "--xacro-arg",
        metavar="NAME=VALUE",
        help="Set an argument of a xacro file; may be repeated.",
        show_default=False,
    ),
]
Flange = Annotated[str | None, typer.Option("--flange", metavar="LINK", help="Take this link of a URDF as the flange.")]


def robots(
    model: Model = None,
    flange: Flange = None,
    package_dir: PackageDirs = None,
    xacro_arg: XacroArgs = None,
    as_json: AsJson = False,
) -> None:
    """List the bundled robots, or describe what the file of one says.

    The list has reach, limits and source. Of one robot: the possible flanges, joints with limits, what is missing,
    bodies and their size, and the lines to write into a cell.
    """
    with json_failure(SCHEMA, desired=as_json):
        if model is None and (flange or package_dir or xacro_arg):
            raise typer.BadParameter("expected a URDF with --flange, --package-dir and --xacro-arg")
        arguments = _arguments(xacro_arg or [])
        records = _listed() if model is None else [_described(model, flange, package_dir or [], arguments)]
    if as_json:
        say_json({"schema": SCHEMA, "robots": records})
    elif model is None:
        for number, record in enumerate(records):
            if number:
                say("")
            show(_lines(record))
    else:
        from cellplan.report.text.robot_description import description_lines

        show(description_lines(records[0]))


def _listed() -> list[dict[str, Any]]:
    """All bundled robots."""
    from cellplan.io.robots.bundled import bundled_names, load_bundled

    return [_record(name, load_bundled(name)) for name in bundled_names()]


def _arguments(texts: Sequence[str]) -> dict[str, str]:
    """Values of the arguments of a xacro file, by name."""
    values: dict[str, str] = {}
    for text in texts:
        name, sign, value = text.partition("=")
        if not name or not sign:
            raise typer.BadParameter(f"--xacro-arg: expected NAME=VALUE, got '{text}'")
        if name in values:
            raise typer.BadParameter(f"--xacro-arg: expected every name once, got '{name}' again")
        values[name] = value
    return values


def _described(model: str, flange: str | None, package_dirs: list[Path], xacro_args: dict[str, str]) -> dict[str, Any]:
    """What one robot's file says."""
    from cellplan.io.cell.robot_file import describe_robot
    from cellplan.kinematics.reach import arm_reach
    from cellplan.report.record.robot_description import description_record

    described = describe_robot(model, flange=flange, package_dirs=package_dirs, xacro_args=xacro_args)
    return description_record(described, None if described.model is None else arm_reach(described.model))


def _record(name: str, model: RobotModel) -> dict[str, Any]:
    """One robot in printed units."""
    from cellplan.kinematics.reach import arm_reach
    from cellplan.report.record.controller import zero_record
    from cellplan.report.record.joint_limits import joint_record
    from cellplan.report.record.robot_description import published_reach

    return {
        "name": name,
        "source": model.source,
        "reach_mm": round(1e3 * arm_reach(model), 1),
        "published_reach": published_reach(model),
        "bodies": len(model.bodies),
        "zero": zero_record(model),
        "joints": [joint_record(joint) for joint in model.joints],
    }


def _lines(record: dict[str, Any]) -> list[str]:
    """One robot as text: joint, range, largest speed."""
    from cellplan.report.record.joint_limits import limits_text

    lines = [record["name"], f"  reach {record['reach_mm']:g} mm from the first axis; {record['source']}"]
    if (published := record["published_reach"]) is not None:
        to = "" if published["to"] is None else f" to {published['to']}"
        lines.append(f"  published reach {published['mm']:g} mm{to} ({published['source']})")
    for joint in record["joints"]:
        limits, speed = limits_text(joint)
        lines.append(f"  {joint['name']:<10} {limits:<22} {speed}")
    zero = record["zero"]
    return [*lines, f"  {zero['line']}" + (f" ({zero['source']})" if zero["is_stated"] else "")]
