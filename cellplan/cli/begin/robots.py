"""``cellplan robots``: the bundled robots, or one robot's file: flanges, joints, bodies and what a cell has to add."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cellplan.cli.options import shared
from cellplan.cli.options.completion import robot_models
from cellplan.cli.options.request import Options, argument, option
from cellplan.cli.terminal.output import say, say_json, show

if TYPE_CHECKING:
    from cellplan.model.robot.robot import RobotModel


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotsOptions(Options):
    """Which robots are listed or described."""

    SCHEMA = "cellplan.robots/1"

    model: Annotated[
        str | None,
        argument(
            "MODEL", "URDF, xacro file, joint-axis table or bundled robot to describe.", autocompletion=robot_models
        ),
    ] = None
    flange: Annotated[str | None, option("--flange LINK", "Take this link of a URDF as the flange.")] = None
    package_dirs: Annotated[
        tuple[Path, ...],
        option(
            "--package-dir DIR",
            "Look up package://NAME/... of a URDF as DIR/NAME/...; may be repeated.",
            exists=True,
            file_okay=False,
        ),
    ] = ()
    xacro_args: Annotated[
        tuple[str, ...], option("--xacro-arg NAME=VALUE", "Set an argument of a xacro file; may be repeated.")
    ] = ()
    as_json: shared.AsJson = False


def robots(options: RobotsOptions) -> None:
    """List the bundled robots, or describe what the file of one says.

    The list has reach, limits and source. Of one robot: the possible flanges, joints with limits, what is missing,
    bodies and their size, and the lines to write into a cell.
    """
    if options.model is None and (options.flange or options.package_dirs or options.xacro_args):
        raise typer.BadParameter("expected a URDF with --flange, --package-dir and --xacro-arg")
    arguments = _arguments(options.xacro_args)
    records = _listed() if options.model is None else [_described(options.model, options, arguments)]
    if options.as_json:
        say_json({"schema": options.schema, "robots": records})
    elif options.model is None:
        for number, record in enumerate(records):
            if number:
                say("")
            show(_lines(record))
    else:
        from cellplan.jobs.robot_description import description_lines

        show(description_lines(records[0]))


def _listed() -> list[dict[str, Any]]:
    """All bundled robots."""
    from cellplan.files.robots.joint_table import bundled_names, load_bundled

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


def _described(model: str, options: RobotsOptions, xacro_args: dict[str, str]) -> dict[str, Any]:
    """What one robot's file says."""
    from cellplan.files.cell.robot_file import describe_robot
    from cellplan.jobs.robot_description import description_record
    from cellplan.scene.kinematics.reach import arm_reach

    described = describe_robot(model, flange=options.flange, package_dirs=options.package_dirs, xacro_args=xacro_args)
    return description_record(described, None if described.model is None else arm_reach(described.model))


def _record(name: str, model: "RobotModel") -> dict[str, Any]:
    """One robot in printed units."""
    from cellplan.jobs.robot_description import published_reach
    from cellplan.report.record.sections.joints import joint_record
    from cellplan.report.record.sections.rests_on import zero_record
    from cellplan.scene.kinematics.reach import arm_reach

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
    from cellplan.report.record.sections.joints import limits_text

    lines = [record["name"], f"  reach {record['reach_mm']:g} mm from the first axis; {record['source']}"]
    if (published := record["published_reach"]) is not None:
        to = "" if published["to"] is None else f" to {published['to']}"
        lines.append(f"  published reach {published['mm']:g} mm{to} ({published['source']})")
    for joint in record["joints"]:
        limits, speed = limits_text(joint)
        lines.append(f"  {joint['name']:<10} {limits:<22} {speed}")
    zero = record["zero"]
    return [*lines, f"  {zero['line']}" + (f" ({zero['source']})" if zero["is_stated"] else "")]
