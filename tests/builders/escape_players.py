"""Escape programs as a controller would run them: their texts become Python generators of what is done.

Nothing of cellplan reads the texts here. A robot yields ``("move", numbers)``, ``("out", signal, state)``,
``("in", signal, state)``, ``("pause",)`` and ``("halt",)``.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from builders.tp_controller import Event, TpController

IGNORED = r"DECL .*|[;&!].*|BAS\(.*|\$(ADVANCE|TOOL|BASE)=.*|TPWrite .*|VAR (num|jointtarget) \w+;|"
KRL = (
    (IGNORED, "pass", 0),
    (r"DEF (\w+)\((.*)\)", "def {0}(M, {1}):", 1),
    (r"END|ENDIF|ENDFOR|ENDLOOP|ENDSWITCH", "", -1),
    (r"HERE=\$AXIS_ACT", "HERE = M.here()", 0),
    (r"\$OUT\[(\d+)\]=(TRUE|FALSE)", "yield ('out', '{0}', '{1}' == 'TRUE')", 0),
    (r"WAIT FOR (NOT )?\$IN\[(\d+)\]", "yield ('in', '{1}', not '{0}')", 0),
    (r"WAIT SEC 1", "yield ('pause',)", 0),
    (r"PTP (\w+)\[ROW\]", "yield ('move', list(vars({0}[ROW]).values()))", 0),
    (r"HALT", "yield ('halt',)", 0),
    (r"LOOP", "while True:", 1),
    (r"IF (.*) THEN", "if {0}:", 1),
    (r"FOR ROW=(.*) TO (\w+) STEP -1", "for ROW in range({0}, {1} - 1, -1):", 1),
    (r"FOR ROW=(\w+) TO (\w+)", "for ROW in range({0}, {1} + 1):", 1),
    (r"SWITCH cell_step", "if M.step < 0 or M.begin():", 1),
    (r"CASE (\d+)", "elif M.begun == {0}:", 2),
    (r"DEFAULT", "else:", 2),
    (r"cell_step=(\d+)", "M.step = {0}", 0),
    (r"(\w+)=(.*)", "{0} = {1}", 0),
    (r"(\w+)\((.*)\)", "yield from {0}(M, {1})", 0),
)
RAPID = (
    (IGNORED, "pass", 0),
    (r"(?:LOCAL )?PROC (\w+)\((.*)\)", "def {0}(M, {1}):", 1),
    (r"ENDPROC|ENDIF|ENDFOR|ENDTEST", "", -1),
    (r"here := CJointT\(\);", "here = M.here()", 0),
    (r"SetDO (\w+),([01]);", "yield ('out', '{0}', bool({1}))", 0),
    (r"WaitDI (\w+),([01]);", "yield ('in', '{0}', bool({1}))", 0),
    (r"WaitTime 1;", "yield ('pause',)", 0),
    (r"Move(?:Abs|Ext)J (\w+)\{row\},v_escape,fine.*;", "yield ('move', list(vars({0}[row]).values()))", 0),
    (r"EXIT;", "yield ('halt',)", 0),
    (r"IF at = 0 THEN", "if at == 0:", 1),
    (r"IF (.*) THEN", "if {0}:", 1),
    (r"FOR row FROM (.*) TO (\w+) STEP -1 DO", "for row in range({0}, {1} - 1, -1):", 1),
    (r"FOR row FROM (.*) TO (\w+) DO", "for row in range({0}, {1} + 1):", 1),
    (r"TEST cell_step", "if M.step < 0 or M.begin():", 1),
    (r"CASE (\d+):", "elif M.begun == {0}:", 2),
    (r"DEFAULT:", "else:", 2),
    (r"cell_step := (\d+);", "M.step = {0}", 0),
    (r"(?:VAR num )?(\w+) := (.*);", "{0} = {1}", 0),
    (r"(\w+) ?(.*);", "yield from {0}(M, {1})", 0),
)
URSCRIPT = (
    (r"#.*|", "pass", 0),
    (r"def (\w+)\((.*)\):", "def {0}(M, {1}):", 1),
    (r"end", "", -1),
    (r"here = get_actual_joint_positions\(\)", "here = M.here()", 0),
    (r"set_standard_digital_out\((\d+), (True|False)\)", "yield ('out', '{0}', {1})", 0),
    (r"wait (not )?(\d+)", "yield ('in', '{1}', bool('{0}'))", 0),
    (r"sleep\(1\.0\)", "yield ('pause',)", 0),
    (r"movej\((\w+)\(row\), .*\)", "yield ('move', (yield from {0}(M, row)))", 0),
    (r"halt", "yield ('halt',)", 0),
    (r"step = read_output_integer_register\(24\)", "step = M.begin() or M.step", 0),
    (r"write_output_integer_register\(24, (\d+)\)", "M.step = {0}", 0),
    (r"(if|while) (.*):", "{0} {1}:", 1),
    (r"(elif step == \d+|else):", "{0}:", 2),
    (r"return (.*)", "return {0}", 0),
    (r"(\w+) = (escape_rows)\((.*)\)", "{0} = yield from {1}(M, {2})", 0),
    (r"(\w+) = (.*)", "{0} = {1}", 0),
    (r"(\w+)\((.*)\)", "yield from {0}(M, {1})", 0),
)
VAL3 = (
    (r"//.*|resetMotion\(\)|waitEndMove\(\)|", "pass", 0),
    (r"nStep=\w+:cell_step", "M.begin()", 0),
    (r"def (\w+)\((.*)\)", "def {0}(M, {1}):", 1),
    (r"end|endIf|endFor|endWhile", "", -1),
    (r"jHere=herej\(\)", "jHere = M.here()", 0),
    (r"(\w+)=(true|false)", "yield ('out', '{0}', '{1}' == 'true')", 0),
    (r"wait\((\w+)==(true|false)\)", "yield ('in', '{0}', '{1}' == 'true')", 0),
    (r"delay\(1\)", "yield ('pause',)", 0),
    (r"popUpMsg\(.*\)", "yield ('halt',)", 0),
    (r"movej\((\w+)\[nRow-1\],tTool\[0\],mMove\[0\]\)", "yield ('move', list(vars({0}[nRow - 1]).values()))", 0),
    (r"while true", "while True:", 1),
    (r"for (\w+)=(.*) to (\w+) step -1", "for {0} in range({1}, {2} - 1, -1):", 1),
    (r"for (\w+)=(\w+) to (\w+)", "for {0} in range({1}, {2} + 1):", 1),
    (r"if nStep<0", "if M.step < 0:", 1),
    (r"elseIf nStep==(\d+)", "elif M.begun == {0}:", 2),
    (r"else", "else:", 2),
    (r"if (.*)", "if {0}:", 1),
    (r"\w+:cell_step=(\d+)", "M.step = {0}", 0),
    (r"call (\w+)\((.*)\)", "yield from {0}(M, {1})", 0),
    (r"(\w+)=(.*)", "{0} = {1}", 0),
)


class Robot:
    """A robot that runs its escape program.

    Attributes:
        q: Where it stands, as its controller shows it.
        ready: Time in [s] at which its next instruction is due.
        is_done: Whether its program has come to its end.
        is_halted: Whether it gave up.
        moved: Whether it has moved.
    """

    def __init__(self, files: Mapping[str, str], step: int, here: Sequence[float], ready: float = 0.0) -> None:
        """Begin with what its step register holds and where it stands."""
        self.q, self.ready, self.is_done, self.is_halted, self.moved = np.array(here), ready, False, False, False
        self.machine = SimpleNamespace(step=step, begun=step)
        self.machine.begin = lambda: setattr(self.machine, "begun", self.machine.step)
        self._events = robot_program(files, self.machine, here)
        self.event: Event | None = None
        self.take()

    def take(self) -> None:
        """Go on to the next instruction."""
        self.event = next(self._events, None)
        self.is_done = self.event is None
        self.is_halted = self.event == ("halt",)


PARTS = 4  # of a move, between which other robots may do something
SLOWEST = 0.02  # [s] of an instruction and a signal
NEVER = 30.0  # [s] after the last change of anything: nobody goes on any more


def play(
    robots: Mapping[str, Robot],
    wires: Mapping[tuple[str, str], Sequence[tuple[str, str]]],
    rng: np.random.Generator,
    seen: Callable[[], None] = lambda: None,
) -> None:
    """Run robots on their own clocks until all are done or none goes on; ``seen`` is called after each part of a move.

    ``wires`` lead from an output of a robot to inputs of others.
    """
    inputs: dict[tuple[str, str], bool] = {}
    last_change = 0.0
    waiting: list[tuple[float, tuple[str, str], bool]] = []
    while any(not (robot.is_done or robot.is_halted) for robot in robots.values()):
        name = min((n for n in robots if not (robots[n].is_done or robots[n].is_halted)), key=lambda n: robots[n].ready)
        robot = robots[name]
        now = robot.ready
        if now > last_change + NEVER:
            return
        for change in [change for change in waiting if change[0] <= now]:
            inputs[change[1]] = change[2]
            waiting.remove(change)
        event, robot.ready = robot.event, now + float(rng.uniform(0.0, SLOWEST))
        assert event is not None
        if event[0] == "in" and inputs.get((name, event[1]), False) is not event[2]:
            continue
        last_change = now
        if event[0] == "out":
            before = [change[0] for change in waiting if change[1] in wires[name, event[1]]]
            arrives = max([now + float(rng.uniform(0.0, SLOWEST)), *before])  # no signal overtakes another one
            waiting += [(arrives, end, event[2]) for end in wires[name, event[1]]]
            waiting.sort(key=lambda change: change[0])
        elif event[0] == "pause":
            robot.ready = now + 1.0
        elif event[0] == "move":
            robot.moved = True
            left = np.array(event[1]) - robot.q
            if np.abs(left).max() > 1e-9:
                step = robot.machine.part = getattr(robot.machine, "part", PARTS)
                robot.q = robot.q + left / step
                seen()
                robot.machine.part = step - 1
                robot.ready = now + float(rng.uniform(0.0, 0.3))
                if step > 1:
                    continue
            robot.machine.part = PARTS
        robot.take()


def robot_program(files: Mapping[str, str], machine: SimpleNamespace, here: Sequence[float]) -> Iterator[Event]:
    """The escape program of one robot, on a machine with a step register."""
    texts = {path.rpartition(".")[2]: text.replace("\r", "") for path, text in files.items()}
    if "ls" in texts:
        return TpController(files, machine, here).run(next(path for path in files if path.endswith("_ESC.ls"))[:-3], ())
    axes = [f"A{axis}" for axis in range(1, 7)] if "src" in texts else [f"rax_{axis}" for axis in range(1, 7)]
    names: dict[str, Any] = {}
    machine.here = lambda: SimpleNamespace(**dict(zip(axes, here, strict=True)))
    if "src" in texts:
        _translate(texts["src"].split("\n"), KRL, names)
        for table, row, numbers in re.findall(r"(X[RH])\[(\d+)\]=\{(.*)\}", texts["dat"]):
            values = re.findall(r"A\d (-?[\d.]+)", numbers)
            names.setdefault(table, {})[int(row)] = SimpleNamespace(**dict(zip(axes, map(float, values), strict=True)))
        begin = next(name for name in names if name.endswith("_esc"))
    elif "pgx" in texts:
        axes = [f"j{axis}" for axis in range(1, 7)]
        machine.here = lambda: SimpleNamespace(**dict(zip(axes, here, strict=True)))
        for table, values in re.findall(r'name="(jEsc|jHome)".*?>\n(.*?)</Data>', texts["dtx"], re.DOTALL):
            rows = [re.findall(r'j\d="(-?[\d.]+)"', row) for row in values.split("\n") if "j1=" in row]
            names[table] = [SimpleNamespace(**dict(zip(axes, map(float, row), strict=True))) for row in rows]
        wires = dict(
            re.findall(
                r'name="(\w+)"[^\n]* type="dio"[^\n]*\n *<Value key="0" link="BasicIO-1.%[IQ](\d+)"', texts["dtx"]
            )
        )
        _translate(
            [line for path, text in files.items() if path.endswith(".pgx") for line in _val3_lines(text, wires)],
            VAL3,
            names,
        )
        begin = "start"
    elif "script" in texts:
        waits = r"while (not )?get_standard_digital_in\((\d+)\):\n\s*sync\(\)\n\s*end"
        _translate(re.sub(waits, r"wait \1\2", texts["script"]).split("\n"), URSCRIPT, names)
        begin = next(name for name in names if name.endswith("_escape"))
        machine.here = lambda: here
    else:
        code = texts["mod"]
        for table in re.findall(r"LOCAL CONST jointtarget (\w+)\{\d+\} := \[(.*?)\];", code, re.DOTALL):
            rows = [row.split(",") for row in re.findall(r"\[\[([^\]]*)\],", table[1])]
            names[table[0]] = {
                place: SimpleNamespace(**dict(zip(axes, map(float, row), strict=True)))
                for place, row in enumerate(rows, start=1)
            }
        body = code[code.index("PROC cell_escape") : code.index("ENDMODULE")]
        plain = re.sub(r"\{(row(?:\+1)?)\}\.", r"[\1].", body).replace(".robax", "").replace("num ", "")
        plain = plain.replace("VAR at", "VAR num at")
        lines = [line for line in plain.split("\n") if not re.fullmatch(r"\s*VAR (?!num at)\w.*;", line)]
        _translate(lines, RAPID, names)
        begin = "cell_escape"
    program: Iterator[Event] = names[begin](machine)
    return program


def _val3_lines(text: str, wires: Mapping[str, str]) -> list[str]:
    """A program as a routine with its parameters, whose signals are named after their wires."""
    name = re.findall(r'<Program name="(\w+)"', text)[0]
    parameters = re.findall(r'<Parameter name="(\w+)" type="num" xsi:type="element"/>', text)
    code = text[text.index("CDATA[begin") + len("CDATA[begin") : text.index("]]>")]
    for signal, wire in wires.items():
        code = re.sub(rf"\b{signal}\b", wire, code)
    return [f"def {name}({','.join(parameters)})", *code.split("\n")]


def _translate(lines: Sequence[str], rules: Sequence[tuple[str, str, int]], names: dict[str, Any]) -> None:
    """Define the routines of a text as generators."""
    code, depth = list[str](), 0
    for line in map(str.strip, lines):
        pattern, template, change = next(rule for rule in rules if re.fullmatch(rule[0], line))
        match = re.fullmatch(pattern, line)
        groups = [(group or "").replace(":IN", "") for group in (match.groups() if match else ())]
        if template:
            code.append("    " * (depth - (change == 2)) + template.format(*groups))
            code += ["    " * (depth + 1) + "yield from ()"] if template.startswith("def ") else []
            code += ["    " * (depth + 1) + "pass"] if template.startswith("if M.step") else []
            code += ["    " * depth + "pass"] if change == 2 else []
        depth += change if change != 2 else 0
    exec("\n".join(code), names)  # noqa: S102
