"""Tasks of one ABB controller that wait for one another without wires, also beside robots of other controllers."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from builders.export_jobs import NAMES, job_of, random_program
from builders.paced_pairs import pair_job
from builders.rapid_jobs import multimove_cell, named_signals
from builders.scene_builders import arm_model, placed

from cellplan.errors import InputError
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.report.exported import ExportFrame, ExportJob, Promise
from cellplan.model.settings.controllers import ControllerEntry, HandshakeEntry, RobotControlEntry
from cellplan.programs.elements.escapes import with_register
from cellplan.programs.elements.handshake import HandshakeStep, first_steps, handshake_steps, require_signals
from cellplan.programs.elements.paced import Switches
from cellplan.programs.formats.rapid.escape import RAPID_ESCAPE
from cellplan.programs.formats.rapid.paced import rapid_events
from cellplan.programs.formats.rapid.units import rapid_units
from cellplan.programs.formats.rapid.writer import RAPID
from cellplan.programs.judgement.compare_rows import other_rows

MARKS = (0, 7, 19)


def with_signals(robot: Robot, signals: HandshakeEntry | None) -> Robot:
    control = robot.control
    assert control is not None
    return replace(robot, control=control.model_copy(update={"handshake": signals}))


def two_tasks(*others: str, first: bool = False) -> Cell:
    """Two arms of one controller, which state no wires, and arms of other controllers, before them or behind them."""
    cell = multimove_cell({name: arm_model() for name in NAMES[:2]})
    tasks = [with_signals(robot, None) for robot in cell.robots]
    apart = [
        replace(placed(name, arm_model()), control=RobotControlEntry.model_construct(id=f"box_{name}"))
        for name in others
    ]
    robots = [*apart, *tasks] if first else [*tasks, *apart]
    if others:
        named = named_signals([tasks[0].name, *others])
        robots = [with_signals(robot, named.get(robot.name)) for robot in robots]
    boxes = {f"box_{name}": ControllerEntry(kind="abb") for name in others}
    return replace(cell, robots=tuple(robots), controllers={**cell.controllers, **boxes})


def job_with(cell: Cell, *, marks: Sequence[int] = MARKS) -> ExportJob:
    return job_of(cell, random_program(cell, rows=20, marks=marks), promise=Promise.SEQUENCE_ONLY)


def test_tasks_of_one_controller_need_no_wires() -> None:
    job = job_with(two_tasks())

    files = RAPID.render(job)
    read = RAPID.read(job.frame, files)

    assert list(other_rows(RAPID, job, read)) == []
    for name in NAMES[:2]:
        require_signals(job.frame, name)
        text = files[f"{name}.mod"]
        assert text.count("WaitSyncTask sync_mark,cell_tasks;") == len(MARKS)
        assert 'PERS tasks cell_tasks{2} := [["T_ROB1"],["T_ROB2"]];' in text
        assert "VAR syncident sync_mark;" in text
        assert not re.search(r"SetDO|WaitDI|sync_go", text)


def steps_of(job: ExportJob, robot: str) -> list[HandshakeStep | None]:
    """Moves, and what stands behind those at marks."""
    rows = range(len(job.programs[0].robots[robot]))
    steps = handshake_steps(job.frame, robot)
    return [*first_steps(job.frame, robot), *(s for row in rows for s in (None, *(steps if row in MARKS else ())))]


@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize("others", [(), ("gamma",), ("gamma", "delta")])
def test_none_passes_a_mark_before_all_have_come(others: tuple[str, ...], first: bool) -> None:
    """Whatever the order in which programs go on once all are started; and each comes to its end."""
    job = job_with(two_tasks(*others, first=first))
    cell, programs = job.frame.cell, {robot.name: steps_of(job, robot.name) for robot in job.frame.cell.robots}
    outputs = {str(r.control.handshake.output): True for r in cell.robots if r.control and r.control.handshake}
    wires = {f"di_{name}_{other}": f"do_{other}" for name in programs for other in programs}
    names = list(programs)
    for seed in range(8):
        rng = np.random.default_rng(seed)
        place, moved = dict.fromkeys(names, 0), dict.fromkeys(names, 0)
        speeds = rng.uniform(0.05, 1.0, len(names))
        turns = rng.choice(len(names), 6000, p=speeds / speeds.sum()).tolist()
        for name in (*names, *(names[turn] for turn in turns)):  # all are started before any goes on
            if place[name] == len(programs[name]):
                continue
            step = programs[name][place[name]]
            if step is None:
                moved[name] += 1
            elif step.meets:
                here = [programs[one][place[one]] for one in NAMES[:2] if place[one] < len(programs[one])]
                if here == [step, step]:
                    place[NAMES[0]] += 1
                    place[NAMES[1]] += 1
                continue
            elif not step.waits:
                outputs[step.signal] = step.is_on
            elif outputs[wires[step.signal]] != step.is_on:
                continue
            place[name] += 1
            assert all(moved[other] > mark for mark in MARKS if moved[name] > mark + 1 for other in names)
        assert place == {name: len(program) for name, program in programs.items()}


def test_only_the_first_task_is_wired_to_other_controllers() -> None:
    cell = two_tasks("gamma")
    frame = job_with(cell).frame
    unwired = replace(cell, robots=tuple(with_signals(robot, None) for robot in cell.robots))
    bare = replace(frame, cell=unwired)

    require_signals(bare, NAMES[1])
    for name, other in ((NAMES[0], "gamma"), ("gamma", NAMES[0])):
        with pytest.raises(InputError, match=rf"robots\.{name}\.controller\.handshake: .*inputs: {{{other}: …}}"):
            require_signals(bare, name)
    text = RAPID.render(job_with(cell))[f"{NAMES[1]}.mod"]
    assert re.findall(r"WaitSyncTask \w+", text)[:2] == ["WaitSyncTask sync_mark", "WaitSyncTask sync_go"]
    assert not re.search(r"SetDO|WaitDI", text)


def test_wires_that_are_stated_are_used() -> None:
    """As they were before: the controllers of such cells are wired already."""
    cell, named = two_tasks(), named_signals(NAMES[:2])
    wired = replace(cell, robots=tuple(with_signals(robot, named[robot.name]) for robot in cell.robots))

    text = "".join(RAPID.render(job_with(wired)).values())

    assert "WaitSyncTask" not in text
    assert "WaitDI di_" in text


CHANGES = {
    "another point": ("WaitSyncTask sync_mark,", "WaitSyncTask sync_go,", "expected syncident that is declared"),
    "point of another kind": ("WaitSyncTask sync_mark,", "WaitSyncTask v_rows,", "expected syncident that is declared"),
    "another list": (",cell_tasks;", ",all_tasks;", "expected tasks that is declared"),
    "tasks of no robot": ('["T_ROB2"]', '["T_ROB3"]', "expected the tasks T_ROB1, T_ROB2, got T_ROB1, T_ROB3"),
    "one task": ('{2} := [["T_ROB1"],["T_ROB2"]]', '{1} := [["T_ROB1"]]', "expected a list of 2 tasks"),
    "no list": ('  PERS tasks cell_tasks{2} := [["T_ROB1"],["T_ROB2"]];\r\n', "", "expected tasks that is declared"),
    "no point": ("  VAR syncident sync_mark;\r\n", "", "expected syncident that is declared"),
    "a wire": ("WaitSyncTask sync_mark,cell_tasks;", "WaitDI di,1;", "expected WaitSyncTask sync_mark,cell_tasks"),
    "left out": ("    WaitSyncTask sync_mark,cell_tasks;\r\n", "", r"expected waits at rows [0, 7, 19], read [7, 19]"),
    "in step": ("WaitSyncTask sync_mark,", "SyncMoveOn sync_mark,", "no SyncMoveOn"),
}


def noticed(frame: ExportFrame, job: ExportJob, files: dict[str, str]) -> str:
    try:
        return "\n".join(other_rows(RAPID, job, RAPID.read(frame, files)))
    except InputError as error:
        return str(error)


@pytest.mark.parametrize("name", CHANGES)
def test_a_change_is_noticed(name: str) -> None:
    job = job_with(two_tasks())
    files, (old, new, words) = RAPID.render(job), CHANGES[name]
    file = f"{NAMES[0]}.mod"
    assert old in files[file]

    assert words in noticed(job.frame, job, files | {file: files[file].replace(old, new, 1)})


def test_escape_programs_ask_for_wires() -> None:
    job = job_with(two_tasks())
    escaping = with_register(RAPID, RAPID_ESCAPE)

    findings = []
    for demand in escaping.demands(job.frame, lambda: 20):
        try:
            demand()
        except InputError as error:
            findings.append(str(error))

    (finding,) = findings
    assert finding.startswith(f"robots.{NAMES[0]}.controller.handshake: expected the inputs that '{NAMES[1]}' set")


def test_programs_of_lines_wait_in_the_same_words() -> None:
    frame = replace(job_with(two_tasks("gamma")).frame, promise=Promise.PACED)
    events = [rapid_events(frame, unit) for unit in rapid_units(frame)]
    first, second, _ = events

    meeting = ["WaitSyncTask sync_mark,cell_tasks;", "WaitSyncTask sync_go,cell_tasks;"]
    assert list(second.texts(None, Switches(waits=True))) == meeting
    assert second.before(True) == ()
    assert second.read(None, [text.lower() for text in meeting], None) == Switches(waits=True)
    assert second.read(None, meeting[:1], None) is None
    leading = first.texts(None, Switches(waits=True))
    assert [leading[0], leading[-1]] == meeting
    assert len(leading) == 6
    assert first.before(True) == ("SetDO do_alpha,0;",)


def test_tasks_of_one_controller_share_no_work_object() -> None:
    """Data that are PERS in two tasks are one, and the part stands elsewhere from the base of another arm."""
    _, job, _ = pair_job("rapid")
    cell = job.frame.cell
    alpha, beta = cell.robots
    assert alpha.control is not None
    tasks = {"T_ROB1": "ROB_1", "T_ROB2": "ROB_2"}
    robots = tuple(
        replace(robot, control=alpha.control.model_copy(update={"task": task, "handshake": None}))
        for robot, task in zip((alpha, beta), tasks, strict=True)
    )
    box = cell.controllers[alpha.control.id].model_copy(update={"tasks": tasks})
    cell = replace(cell, robots=robots, controllers={alpha.control.id: box})
    job = replace(job, frame=replace(job.frame, cell=cell))

    files = RAPID.render(job)

    assert RAPID.read(job.frame, files)[0].robots[alpha.name].seams == job.programs[0].robots[alpha.name].seams
    for name in ("alpha.mod", "beta.mod"):
        assert files[name].count("  TASK PERS wobjdata w_part_1 :=") == 1
        shared = files | {name: files[name].replace("TASK PERS wobjdata", "PERS wobjdata")}
        with pytest.raises(InputError, match="expected TASK PERS wobjdata"):
            RAPID.read(job.frame, shared)
