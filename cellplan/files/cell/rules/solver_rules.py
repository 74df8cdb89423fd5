"""Rules of solver and motion: stable feedback, joints that exist, goals that the method can pursue."""

from collections.abc import Iterator, Mapping
from typing import Final

from cellplan.files.input.findings import Finding, KeyPath, listed, shown, unknown_name
from cellplan.files.robots.rules import configuration_findings
from cellplan.files.schema.partial import ValidEntries
from cellplan.files.yaml.reader import YamlDocument
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.solver import SolverEntry
from cellplan.model.solver import ACCURATE_METHODS, METHODS, NULL_SPACE_METHODS

FEEDBACK_LIMIT: Final = 2.0  # gain_per_s * step_s at which Euler's steps become unstable
OR_EULER: Final = "or choose solver.integrator: euler"


def feedback_findings(valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """The error feedback is stable with Euler's steps."""
    if valid.motion is None or valid.solver is None or valid.solver.gain_per_s is None:
        return
    gain, step = valid.solver.gain_per_s, valid.motion.step_s
    if gain * step >= FEEDBACK_LIMIT:
        text = (
            f"expected a gain below {FEEDBACK_LIMIT / step:g} (2 / step_s), got {gain:g}; "
            "the error feedback would be unstable"
        )
        yield document.finding(("solver", "gain_per_s"), text)


def accurate_findings(valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """An explicit ``integrator: accurate`` must go with the method."""
    solver = valid.solver
    if solver is None or solver.integrator != "accurate":
        return
    if solver.method not in ACCURATE_METHODS:
        text = (
            f"expected {listed(ACCURATE_METHODS)} in the accurate mode, got {shown(solver.method)}, which "
            f"{METHODS[solver.method].steps_because}; choose {listed(ACCURATE_METHODS)}, {OR_EULER}"
        )
        yield document.finding(("solver", "method"), text)


def solver_findings(valid: ValidEntries, models: Mapping[str, RobotModel], document: YamlDocument) -> Iterator[Finding]:
    """Joints that the solver and the motion name exist; the method has a null space for goals besides the tasks."""
    solver, motion = valid.solver, valid.motion
    for index, lock in enumerate(motion.locked_joints if motion else ()):
        path: KeyPath = ("motion", "locked_joints", index)
        yield from _joint(path, lock.robot, lock.joint, valid=valid, models=models, document=document)
        earlier = [(other.robot, other.joint) for other in (motion.locked_joints if motion else ())[:index]]
        if (lock.robot, lock.joint) in earlier:
            yield document.finding(path, f"expected every joint once, got '{lock.robot}/{lock.joint}' again")
        clock = None if motion is None else motion.duration_s
        if clock is not None and lock.from_s >= clock:
            text = f"expected a time before the end at {clock:g} s, got {lock.from_s:g}"
            yield document.finding((*path, "from_s"), text)
    if solver is None:
        return
    for index, step in enumerate(solver.search.sequence or ()):
        path = ("solver", "search", "sequence", index)
        yield from _joint(path, step.robot, step.joint, valid=valid, models=models, document=document)
        if step in (solver.search.sequence or ())[:index]:
            yield document.finding(path, f"expected every joint once, got '{step.robot}/{step.joint}' again")
    yield from _configurations(solver, valid, models, document=document)
    if not METHODS[solver.method].has_null_space:
        yield from _without_null_space(solver, valid, document)


def _without_null_space(solver: SolverEntry, valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """Goals that a method without a null space cannot pursue."""
    text = f"expected a method with a null space besides the tasks ({listed(NULL_SPACE_METHODS)})"
    if solver.secondary.goals:
        yield document.finding(("solver", "secondary"), f"{text}, got '{solver.method}'")
    if valid.motion is not None and valid.motion.cyclic:
        yield document.finding(("motion", "cyclic"), f"{text}, got '{solver.method}'")


def _joint(
    path: KeyPath,
    robot: str,
    joint: str,
    *,
    valid: ValidEntries,
    models: Mapping[str, RobotModel],
    document: YamlDocument,
) -> Iterator[Finding]:
    """A named joint is one of the cell."""
    known = valid.names["robots"]
    if robot not in known:
        yield document.finding((*path, "robot"), unknown_name("a robot of this cell", robot, known))
    elif robot in models and joint not in models[robot].joint_names:
        names = models[robot].joint_names
        yield document.finding((*path, "joint"), unknown_name(f"a joint of '{robot}'", joint, names))


def _configurations(
    solver: SolverEntry, valid: ValidEntries, models: Mapping[str, RobotModel], *, document: YamlDocument
) -> Iterator[Finding]:
    """A desired configuration has one value for each joint of a robot of the cell."""
    goal = solver.secondary.posture
    for robot, given in goal.at.items() if goal else ():
        path = ("solver", "secondary", "posture", "at", robot)
        known = valid.names["robots"]
        if robot not in known:
            yield document.key_finding(path, unknown_name("a robot of this cell", robot, known))
        elif robot in models:
            yield from configuration_findings(path, given, models[robot], document)
