"""Which bodies of a robot grip the part, and which of a gripper work on it: names in a cell file become bodies."""

from collections.abc import Iterable, Iterator, Mapping

from cellplan.files.cell.build.mounting import attachment_names
from cellplan.files.input.findings import Finding, unknown_name
from cellplan.files.schema.partial import ValidEntries
from cellplan.files.schema.robot import RobotEntry
from cellplan.files.yaml.reader import YamlDocument
from cellplan.geometry.shapes import Mesh
from cellplan.model.cell.rod import tool_body_name
from cellplan.model.robot.robot import Body, RobotModel


def tool_names(entry: RobotEntry) -> tuple[str, ...]:
    """Names of the bodies of a robot's tool: ``tool``, ``tool_2``, …."""
    rod = entry.tool.rod
    count = len(entry.tool.bodies) + (entry.tool.geometry is not None)
    count += 0 if rod is None else 1 + (rod.holder is not None)
    return tuple(tool_body_name(number) for number in range(1, count + 1))


def gripper_bodies(entry: RobotEntry, model: RobotModel) -> tuple[str, ...]:
    """Names of the link bodies that may work on the part as those of a tool do, in the order of the model.

    Those with open meshes never do: how deep they are in the part cannot be judged.
    """
    if entry.gripper is None:
        return ()
    rigid = [body.name for body in model.bodies if body.link == model.flange_link and not _is_leaky(body)]
    if entry.gripper.bodies is None:
        return tuple(rigid)
    meant = {body.name for word in entry.gripper.bodies for body in model.bodies_named(word)}
    return tuple(name for name in rigid if name in meant)


def grip_bodies(
    words: Iterable[str] | None, robot: str, entry: RobotEntry, model: RobotModel
) -> tuple[str, ...] | None:
    """Names, as reports show them, of the bodies that a holder grips with; None for all rigid with its flange."""
    if words is None:
        return None
    known = _gripping(entry, model)
    return tuple(dict.fromkeys(f"{robot}/{name}" for word in words for name in known[_plain(word, robot)]))


def grip_findings(valid: ValidEntries, models: Mapping[str, RobotModel], document: YamlDocument) -> Iterator[Finding]:
    """Bodies that grip or work exist, and are rigid with the flange."""
    for name, model in models.items():
        gripper = valid.robots[name].gripper
        known = _rigid_links(model)
        for index, word in enumerate((gripper.bodies or ()) if gripper is not None else ()):
            if word not in known:
                text = unknown_name("a link body that is rigid with the flange", word, known)
                yield document.finding(("robots", name, "gripper", "bodies", index), text)
            elif any(map(_is_leaky, model.bodies_named(word))):
                text = f"expected closed meshes, got open edges of '{word}': its depth in the part cannot be judged"
                yield document.finding(("robots", name, "gripper", "bodies", index), text)
    for number, grasp in enumerate(valid.part.held_by if valid.part is not None else ()):
        if grasp.robot not in models:
            continue
        names = _gripping(valid.robots[grasp.robot], models[grasp.robot])
        for index, word in enumerate(grasp.grip_bodies or ()):
            if _plain(word, grasp.robot) not in names:
                text = unknown_name(f"a body of '{grasp.robot}' that is rigid with its flange", word, names)
                yield document.finding(("part", "held_by", number, "grip_bodies", index), text)


def _is_leaky(body: Body) -> bool:
    """Whether the mesh of a link is not closed."""
    return isinstance(body.shape, Mesh) and body.shape.is_leaky


def _plain(word: str, robot: str) -> str:
    """A body without the name of its robot."""
    return word.removeprefix(f"{robot}/")


def _rigid_links(model: RobotModel) -> dict[str, tuple[str, ...]]:
    """Names of bodies that are rigid with the flange, by the names of their links and by their own."""
    rigid = [body for body in model.bodies if body.link == model.flange_link]
    names = dict.fromkeys(word for body in rigid for word in (body.link_name or body.name, body.name))
    return {word: tuple(body.name for body in model.bodies_named(word) if body in rigid) for word in names}


def _gripping(entry: RobotEntry, model: RobotModel) -> dict[str, tuple[str, ...]]:
    """All that may grip: what is rigid with the flange, by the words that a cell may use."""
    on_flange = {link.name for link in model.links if link.index == model.flange_link}
    mounted = [
        name
        for name, attachment in zip(attachment_names(entry.attachments), entry.attachments, strict=True)
        if attachment.link in on_flange
    ]
    return _rigid_links(model) | {name: (name,) for name in (*tool_names(entry), *mounted)}
