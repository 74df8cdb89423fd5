"""A remedy and what it does, in words."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Final, TypedDict

from cellplan.model.cell import Cell
from cellplan.model.check_kinds import PASSED_BY_TIME
from cellplan.pipeline.repair.attempts import Attempt, RemedyKind, listed_names
from cellplan.pipeline.repair.neat import written_at
from cellplan.pipeline.repair.solved import MARGIN
from cellplan.report.record.common import Number, number

AXES: Final = {"x_mm": ("+x", "-x"), "y_mm": ("+y", "-y"), "z_mm": ("up", "down")}
TURNS: Final = ("roll_deg", "pitch_deg", "yaw_deg")
SHOWN: Final = 0.005  # [deg] below which a joint of a start posture counts as unchanged


class EffectRecord(TypedDict):
    """What a remedy does to a check that fails as the cell is given."""

    check: Annotated[str, "name of the check"]
    subject: Annotated[str, "robot and joint, task, or pair of bodies"]
    before: Annotated[Number, "figure in the given cell: a margin, a share of a limit, a distance or an error"]
    after: Annotated[Number, "figure with the remedy"]
    unit: Annotated[str, "unit of both"]
    text: Annotated[str, "one line of text"]


def change_text(cell: Cell, attempt: Attempt, values: Mapping[str, Any]) -> str:
    """What changes, in one line."""
    match attempt.kind:
        case RemedyKind.DURATION:
            motion = cell.motion.duration
            keys = {"motion.duration_s": motion}
            texts = [f"{old:g} s -> {values[key]:g} s" for key, old in keys.items() if key in values and old]
            return texts[0] if texts else "all times of the tasks longer"
        case RemedyKind.FREE_SPIN:
            return f"free the spin of the tool of {listed_names(attempt.robots)}, if the process allows it"
        case RemedyKind.METHOD | RemedyKind.STEP:
            return attempt.text
        case RemedyKind.BRANCH:
            return f"another start branch of {listed_names(attempt.robots)}"
        case _:
            texts = list(_changes(cell, attempt, values))
            return "; ".join(texts) if texts else "no change"


def _changes(cell: Cell, attempt: Attempt, values: Mapping[str, Any]) -> Iterator[str]:
    """What changes, one text for each base, tool, start posture and the like."""
    document = cell.origin.document
    groups: dict[str, dict[str, tuple[Any, Any]]] = {}
    for address, value in values.items():
        entry, _, component = address.rpartition(".")
        groups.setdefault(entry, {})[component] = (written_at(document, address), value)
    for entry, parts in groups.items():
        name = entry.removeprefix("robots.")
        if name.endswith((".base", ".mount")) or entry == "part.at" or ".held_by" in entry or entry.startswith("part."):
            yield from _of_pose(name.removesuffix(".base"), parts)
        elif name.endswith(".tool.rod"):
            yield f"rod of {name.removesuffix('.tool.rod')}: {_arrows(parts)}"
        elif entry.startswith("tasks."):
            yield f"tool of task {entry.removeprefix('tasks.')}: {_arrows(parts)}"
        else:
            yield from _of_robot(cell, name, attempt, parts)


def _of_pose(name: str, parts: Mapping[str, tuple[Any, Any]]) -> Iterator[str]:
    """A base, a grasp or the part that is moved and turned."""
    moved, turned = [], []
    for component, (old, new) in parts.items():
        by = float(new) - float(old or 0.0)
        if component in AXES:
            moved.append((abs(by), f"{abs(by):.4g} mm {AXES[component][by < 0.0]}"))
        elif component in TURNS:
            turned.append(f"{by:+.4g} deg {component.removesuffix('_deg')}")
    if moved:
        yield f"move {name} {', '.join(text for _, text in sorted(moved, key=lambda move: -move[0]))}"
    if turned:
        yield f"turn {name} {', '.join(turned)}"


def _of_robot(cell: Cell, name: str, attempt: Attempt, parts: Mapping[str, tuple[Any, Any]]) -> Iterator[str]:
    """Start posture and weights of a robot; start postures that follow from other changes are not named."""
    varies_start = any("start" in address and address.startswith(f"robots.{name}.") for address in attempt.addresses)
    for component, (old, new) in parts.items():
        if component == "path":
            rows = new.get("coefficients_deg") or new["coefficients"]
            yield f"joint path of {name}: {len(rows)} coefficients a joint"
        elif component == "weights":
            yield f"joint weights of {name}: {_by_joint(cell, name, old, new, '')}"
        elif component in {"start_deg", "start"} and varies_start:
            yield f"start of {name}: {_by_joint(cell, name, old, new, ' deg')}"


def _by_joint(cell: Cell, name: str, old: Any, new: Any, unit: str) -> str:
    """Joints whose number changes."""
    joints = cell.robot(name).model.joint_names
    before = _listed(old, len(joints))
    texts = [
        f"{joint} {was:.4g} -> {value:.4g}{unit}" if was is not None else f"{joint} {value:.4g}{unit}"
        for joint, was, value in zip(joints, before, _listed(new, len(joints)), strict=True)
        if value is not None and (was is None or abs(value - was) > SHOWN)
    ]
    return ", ".join(texts)


def _listed(values: Any, count: int) -> list[float | None]:
    """Numbers of a list or of a mapping; None for each where there are none."""
    listed: Sequence[Any] = list(values.values()) if isinstance(values, Mapping) else values
    if isinstance(listed, str) or listed is None or len(listed) != count:
        return [None] * count
    return [float(value) for value in listed]


def _arrows(parts: Mapping[str, tuple[Any, Any]]) -> str:
    """Old and new numbers."""
    texts = []
    for component, (old, new) in parts.items():
        unit = next((unit for unit in ("mm", "deg") if component.endswith(f"_{unit}")), "")
        texts.append(f"{component.removesuffix(f'_{unit}')} {float(old or 0.0):.4g} -> {float(new):.4g} {unit}")
    return ", ".join(texts)


def effects(given: Mapping[str, Any], figures: Mapping[str, Any]) -> list[EffectRecord]:
    """What a remedy does to the checks that fail as the cell is given."""
    after = {(check["name"], check["subject"]): check for check in figures["checks"]}
    effects: list[EffectRecord] = []
    for check in given["failed"]:
        subject = check["subject"]
        if check["name"] in {"joint_position", MARGIN}:
            old, new = (figures_of["margins"][subject] for figures_of in (given, figures))
            unit = given["units"][subject]
            text = f"{subject.replace('/', ' ')} margin {new - old:+.3g} {unit} to {new:.3g} {unit}"
            effects.append(_effect(check, old, new, unit, text))
            continue
        now = after.get((check["name"], subject))
        name, unit, old = _short_name(check["name"]), check["unit"], check["value"]
        if name == "collision":
            effects.append(_effect(check, old, 0.0, unit, f"{subject}: no contact"))
        elif now is not None and check["name"] in PASSED_BY_TIME:
            shares = [100.0 * values["value"] / values["limit"] for values in (check, now)]
            text = f"{subject.replace('/', ' ')} {name} {shares[0]:.4g} % -> {shares[1]:.4g} % of its limit"
            effects.append(_effect(check, shares[0], shares[1], "%", text))
        elif now is not None:
            effects.append(
                _effect(check, old, now["value"], unit, f"{name} {subject} {old:.3g} -> {now['value']:.3g} {unit}")
            )
    return effects


def _short_name(check: str) -> str:
    """The name of a check in words."""
    return check.removeprefix("joint_").removesuffix("_assumed").replace("_", " ")


def _effect(check: Mapping[str, Any], old: float, new: float, unit: str, text: str) -> EffectRecord:
    """One effect."""
    return {
        "check": check["name"],
        "subject": check["subject"],
        "before": number(old),
        "after": number(new),
        "unit": unit,
        "text": text,
    }
