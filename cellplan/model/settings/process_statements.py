"""Process statements of controllers: what stands in programs where a process begins, goes on and ends.

A statement is allowed where the whole of it is one that its maker has for this: none moves but to the point of the row,
jumps, comments, ends a line or assigns anything but an output.
"""

import re
from collections.abc import Iterator, Mapping
from enum import StrEnum
from typing import Annotated, Final, Literal, NamedTuple

from pydantic import Field, StringConstraints, Tag

from cellplan.model.settings.entry import Entry, Name, by_kind, rule
from cellplan.model.settings.units import Mm, Within

MOST_STATEMENTS: Final = 8
LONGEST_STATEMENT: Final = 200  # characters; a line of RAPID or KRL holds more
WIDEST_MM: Final = 100.0  # no weave and no sensor moves a tool farther from its path
LARGEST_DATA: Final = 200  # tasks of a cell
LONGEST_LEAD_S: Final = 0.5  # no valve lags by more, and a RAPID program cannot say more
LEAD_STEPS: Final = {"abb": 1e-3, "fanuc": 1e-2, "kuka": 1e-3}  # [s] by kinds whose motions switch outputs ahead
IN_ANY_ORDER: Final = frozenset({"fanuc"})  # kinds whose programs end weave and tracking in the order of their starts
STEP_TOL: Final = 1e-6  # [-] of a time in steps, by rounding
DATA_SLOT: Final = "{data}"
STATEMENT_WORDS: Final = "a statement, or a list of statements"

_ID, _N, _NUMBER = r"[A-Za-z]\w{0,31}", r"\d{1,4}", r"-?\d{1,5}(?:\.\d{1,4})?"
_ARGUMENTS: Final = rf"\((?:(?:{_ID}|{_NUMBER})(?:, ?(?:{_ID}|{_NUMBER}))*)?\)"
_OPTIONS: Final = rf'(?: ?\\(?:(?:Weave|Track|D):={_ID}|SeamName:="\w{{1,32}}"|Corr))*'
_ABB_MOVE: Final = (
    rf" ?\{{point\}}, ?\{{speed\}}(?:, ?{_ID}{_OPTIONS}){{1,3}}, ?\{{zone\}}{_OPTIONS}, ?\{{tool\}}"
    rf" ?\\WObj:=\{{frame\}}{_OPTIONS};?"
)
_ABB_HEAD: Final = r"(?P<name>(?:Arc|Disp)L[12]?)"
_KRL_WORDS: Final = (
    "S?PTP|S?LIN|S?CIRC|SPL|BAS|IF|WHILE|UNTIL|SWITCH|FOR|RETURN|WAIT|HALT|GOTO|PULSE|INTERRUPT|TRIGGER|BRAKE|RESUME|"
    "EXIT|CONTINUE|CWRITE|ANIN|ANOUT|DEF|DECL|EXT|GLOBAL|SIGNAL|LOOP|REPEAT|NOT"
)
_UR_WORDS: Final = (  # with which functions of the language begin, or which are words of it
    "move|servo|speed|stop|optimove|set_|get_|force_|end_|start_|freedrive|teach|track_|conveyor|path_|halt|powerdown|"
    "popup|sleep|sync|socket_|rpc|interpreter|modbus|write_|read_|reset_|enter_|exit_|screw|zero_|"
    "(?:kill|join|run|return|if|elif|while|def|thread|end|for|not|assert)(?!\\w)"
)


class StatementForm(StrEnum):
    """How a statement stands in a program."""

    MOVE = "move"  # in place of the motion
    SUFFIX = "suffix"  # on the motion
    LINE = "line"  # after the motion


class Switch(NamedTuple):
    """What statements of a maker begin and end; groups other than ``state`` and ``routine`` are alike in both."""

    example: str
    on: str  # pattern of all of a statement
    off: str
    form: StatementForm = StatementForm.LINE
    is_output: bool = False
    has_case: bool = False  # whether capitals count

    def match(self, text: str, *, on: bool) -> re.Match[str] | None:
        """How a text begins or ends something; None if it does not."""
        flags = re.ASCII if self.has_case else re.ASCII | re.IGNORECASE
        return re.fullmatch(self.on if on else self.off, text, flags)


def _same(example: str, pattern: str, *, is_output: bool = False, has_case: bool = False) -> Switch:
    """An output that has one state and then the other, or a call of a routine and one of another."""
    return Switch(example, pattern, pattern, is_output=is_output, has_case=has_case)


_ARC_VALUES: Final = r"AC=\d{1,3} AVP?=\d{1,3}(?:\.\d)?(?: T=\d{1,2}(?:\.\d{1,2})?)?"
_WEAVE_VALUE: Final = rf"{_NUMBER}(?:Hz|mm|s)?"
INNER_MOVE: Final = rf"{_ABB_HEAD}{_ABB_MOVE}"
STATEMENTS: Final[Mapping[str, tuple[Switch, ...]]] = {
    "abb": (
        Switch(
            r"ArcLStart {point}, {speed}, seam1, weld1, {zone}, {tool} \WObj:={frame};",
            rf"{_ABB_HEAD}(?:Start| ?\\On,){_ABB_MOVE}",
            rf"{_ABB_HEAD}(?:End| ?\\Off,){_ABB_MOVE}",
            form=StatementForm.MOVE,
        ),
        _same("SetDO doArc,1;", rf"SetDO (?P<name>{_ID}), ?(?P<state>0|1|low|high);?", is_output=True),
    ),
    "fanuc": (
        Switch(
            "Weld Start[1,1]",
            rf"(?P<name>Arc|Weld) Start(?P<unit> E[1-4])?\[{_N}(?:,{_NUMBER})?\]",
            rf"(?P<name>Arc|Weld) End(?P<unit> E[1-4])?\[{_N}(?:,{_NUMBER})?\]",
            form=StatementForm.SUFFIX,
        ),
        Switch(
            "Weave Sine[1]",
            rf"Weave (?:Sine|Circle|Figure 8|L)\[{_WEAVE_VALUE}(?:,{_WEAVE_VALUE}){{0,5}}\]",
            rf"Weave End(?:\[{_N}\])?",
        ),
        Switch("Track TAST[1]", rf"Track (?:TAST|AVC)\[{_N}\](?: RPM\[{_N}\])?", "Track End"),
        _same("DO[1]=ON", rf"(?P<name>[DR]O\[{_N}\]) ?= ?(?P<state>ON|OFF)", is_output=True),
        _same("CALL GUN_ON", rf"CALL (?P<routine>{_ID})(?:\({_NUMBER}(?:, ?{_NUMBER})*\))?"),
    ),
    "kuka": (
        _same("$OUT[1]=TRUE", rf"(?P<name>\$OUT\[{_N}\]) ?= ?(?P<state>TRUE|FALSE)", is_output=True),
        _same(
            "GUN_ON()",
            rf"(?P<routine>(?!(?:{_KRL_WORDS})(?:_REL)?\b){_ID}) ?"
            + _ARGUMENTS.replace(rf"(?:{_ID}|", rf"(?:#?{_ID}|"),
        ),
    ),
    "staubli": (
        _same(
            "doArc=true",
            r"(?P<name>do\w{1,13}) ?= ?(?P<state>true|false)",
            has_case=True,
            is_output=True,
        ),
        _same("call gunOn()", rf"call (?P<routine>(?!(?:start|stop)\b)(?:{_ID}:)?{_ID}){_ARGUMENTS}", has_case=True),
    ),
    "ur": (
        _same(
            "set_digital_out(0,True)",
            r"(?P<name>set_(?:standard_|configurable_|tool_)?digital_out\([0-7]), ?(?P<state>True|False)\)",
            has_case=True,
            is_output=True,
        ),
        _same("gun_on()", rf"(?P<routine>(?!{_UR_WORDS}){_ID}){_ARGUMENTS}", has_case=True),
    ),
    "yaskawa": (
        Switch(
            "ARCON ASF#(1)",
            rf"ARCON(?: ASF#\({_N}\)| {_ARC_VALUES})?",
            rf"ARCOF(?: AEF#\({_N}\)| {_ARC_VALUES})?",
        ),
        Switch("WVON WEV#(1)", rf"WVON WEV#\({_N}\)", "WVOF"),
        _same("DOUT OT#(1) ON", rf"DOUT (?P<name>OT#\({_N}\)) (?P<state>ON|OFF)", is_output=True),
        _same("CALL JOB:GUN-ON", r"CALL JOB:(?P<routine>\w[\w-]{0,31})"),
    ),
}

Statement = Annotated[str, StringConstraints(max_length=LONGEST_STATEMENT)]
Statements = Annotated[
    Annotated[Statement, Tag(f"<{STATEMENT_WORDS}>")]
    | Annotated[tuple[Statement, ...], Field(min_length=1, max_length=MOST_STATEMENTS), Tag("<list>")],
    by_kind(STATEMENT_WORDS, list=tuple),
]
DataName = Annotated[str, StringConstraints(pattern=r"^(?:[A-Za-z][A-Za-z0-9_]{0,31}|[0-9]{1,3})$")]
Distance = Annotated[Mm, Within(ge=0.0, le=WIDEST_MM)]
Lead = Annotated[float, Field(ge=0.0, le=LONGEST_LEAD_S)]


class ProcessStatementsEntry(Entry):
    """How programs of a controller begin and end a process, and what the controller does there by itself."""

    on: Statements = Field(
        description="What begins a process, of the statements that the kind has: one statement or up to 8."
    )
    inner: Statement | None = Field(
        default=None, description="Motion to an inner point; required exactly where on and off are motions."
    )
    off: Statements = Field(
        description="What ends a process: all that on begins, in the reverse order; of kind fanuc in any."
    )
    data: dict[Name, DataName] = Field(
        default={},
        max_length=LARGEST_DATA,
        description="By task, what stands in the slot {data}: a name or a number; required exactly where the slot is "
        "used.",
    )
    feed_in: DataName | Literal["{data}"] | None = Field(
        default=None,
        description="Data from which the controller takes the speed of the tool, {data} for those of each task; "
        "absent: the speed of the motion.",
    )
    on_lead_s: Lead = Field(
        default=0.0,
        description="Time by which the outputs of on are switched before the tool is at the first point, as a valve or "
        "a gun lags; only for the kinds abb, fanuc and kuka.",
    )
    off_lead_s: Lead = Field(default=0.0, description="Likewise for the outputs of off and the last point.")
    weave_mm: Distance = Field(
        default=Mm(0.0), description="Amplitude of the controller's own weave, from its centre to its edge."
    )
    shift_mm: Distance = Field(default=Mm(0.0), description="Largest distance by which sensors shift the path.")

    def statements(self, *, on: bool) -> dict[str, str]:
        """Statements that begin or end a process, by their keys, in order."""
        key, given = ("on", self.on) if on else ("off", self.off)
        return {key: given} if isinstance(given, str) else {f"{key}[{at}]": text for at, text in enumerate(given)}

    def lead(self, *, on: bool) -> float:
        """Time in [s] by which outputs that begin or end a process are switched ahead."""
        return self.on_lead_s if on else self.off_lead_s


class ReadStatement(NamedTuple):
    """A statement as its maker's."""

    key: str  # its key in the entry
    text: str
    switch: Switch
    words: Mapping[str, str]  # what the groups of its pattern have, in lower case

    def is_ended_by(self, other: "ReadStatement") -> bool:
        """Whether another statement ends what this one begins."""
        states = self.words.get("state"), other.words.get("state")
        return self.switch is other.switch and _what(self) == _what(other) and (states[0] is None or _differ(*states))


def _what(statement: ReadStatement) -> dict[str, str]:
    return {key: word for key, word in statement.words.items() if key not in {"state", "routine"}}


def _differ(*states: str | None) -> bool:
    """Whether an output has one state and then the other."""
    return len({state in {"1", "high", "on", "true"} for state in states}) == 2


def read_statement(kind: str, text: str, *, on: bool, key: str = "") -> ReadStatement | None:
    """A statement that begins or ends a process, its slot ``{data}`` filled; None if the kind has no such one."""
    for switch in STATEMENTS[kind]:
        if match := switch.match(text, on=on):
            words = {name: word.lower() for name, word in match.groupdict().items() if word is not None}
            return ReadStatement(key, text, switch, words)
    return None


def require_process(process: ProcessStatementsEntry, kind: str) -> None:
    """Require statements that the kind of a controller has, and an end of all that is begun.

    Raises a rule that names the key within the entry of the controller.
    """
    if kind not in STATEMENTS:
        kinds = ", ".join(STATEMENTS)
        raise rule(f"unexpected key, it applies to the kinds {kinds} only, got {kind}", "process")
    texts = [*process.statements(on=True).values(), *process.statements(on=False).values(), process.inner or ""]
    has_slot = any(DATA_SLOT in text for text in [*texts, process.feed_in or ""])
    if has_slot and not process.data:
        raise rule(f"missing, expected by task what stands in the slot {DATA_SLOT}", "process.data")
    if process.data and not has_slot:
        raise rule(f"unexpected key, no statement has the slot {DATA_SLOT}", "process.data")
    for data in dict.fromkeys(process.data.values()) or ("",):
        begun, ended = (_read(process, kind, data, on=on) for on in (True, False))
        _require_forms(begun, ended)
        _require_ends(begun, ended, is_nested=kind not in IN_ANY_ORDER)
        _require_lead(process, kind, begun, on=True)
        _require_lead(process, kind, ended, on=False)
        _require_inner(process, begun[0], data)


def _read(process: ProcessStatementsEntry, kind: str, data: str, *, on: bool) -> list[ReadStatement]:
    """Statements that begin or end a process with some data."""
    return [_required(kind, key, text, data, on=on) for key, text in process.statements(on=on).items()]


def _required(kind: str, key: str, text: str, data: str, *, on: bool) -> ReadStatement:
    """A statement that the kind has."""
    statement = read_statement(kind, text.replace(DATA_SLOT, data), on=on, key=f"process.{key}")
    if statement is None:
        examples = ", ".join(switch.example for switch in STATEMENTS[kind])
        does = f"begins a process, such as {examples}" if on else "ends what a statement of on begins"
        filled = f" with {data} in it" if DATA_SLOT in text else ""
        raise rule(f"expected a statement of kind {kind} that {does}, got {text!r}{filled}", f"process.{key}")
    return statement


def _require_forms(begun: list[ReadStatement], ended: list[ReadStatement]) -> None:
    """A motion stands alone, and only one statement stands on a motion."""
    for statements in (begun, ended):
        for form in (StatementForm.MOVE, StatementForm.SUFFIX):
            those = [statement for statement in statements if statement.switch.form is form]
            if len(those) > 1 or (those and form is StatementForm.MOVE and len(statements) > 1):
                words = "no other statement beside a motion" if form is StatementForm.MOVE else "one such statement"
                raise rule(f"expected {words}, got {len(statements)}", those[-1].key)


def _require_ends(begun: list[ReadStatement], ended: list[ReadStatement], *, is_nested: bool) -> None:
    """All that is begun ends, nested: what is begun last first; a statement on a motion has no place in that order."""
    for first in begun:
        if not any(first.is_ended_by(last) for last in ended):
            raise rule(f"expected a statement of off that ends {first.text!r}, got none", first.key)
    for last in ended:
        if not any(first.is_ended_by(last) for first in begun):
            raise rule(f"expected a statement of on that begins what {last.text!r} ends, got none", last.key)
    if len(begun) != len(ended):
        raise rule(f"expected {len(begun)} statements, as many as on has, got {len(ended)}", "process.off")
    left = list(_lines(ended))
    for first in list(_lines(begun))[::-1]:
        ends = [last for last in (left[:1] if is_nested else left) if first.is_ended_by(last)]
        if not ends:
            why = "what is begun last ends first" if is_nested else "each statement ends one"
            raise rule(f"expected what ends {first.text!r}, as {why}, got {left[0].text!r}", left[0].key)
        left.remove(ends[0])


def _require_lead(process: ProcessStatementsEntry, kind: str, statements: list[ReadStatement], *, on: bool) -> None:
    """Only outputs lead, and of kinds whose motions switch outputs ahead, by a time that they can state."""
    key, lead = f"process.{'on' if on else 'off'}_lead_s", process.lead(on=on)
    if not lead:
        return
    if kind not in LEAD_STEPS:
        kinds = ", ".join(LEAD_STEPS)
        cure = "remove it, or let the tool rest at the point (delays of the task's process)"
        raise rule(f"unexpected key, motions of the kinds {kinds} only switch outputs ahead, got {kind}: {cure}", key)
    steps = lead / LEAD_STEPS[kind]
    if abs(steps - round(steps)) > STEP_TOL:
        raise rule(f"expected a multiple of {LEAD_STEPS[kind]:g} s, as kind {kind} states it, got {lead:g}", key)
    for statement in statements:
        if not statement.switch.is_output:
            text = f"expected outputs only, as nothing else is switched ahead ({key}), got {statement.text!r}"
            raise rule(text, statement.key)
    if kind == "fanuc" and len(statements) > 1:
        raise rule(
            f"expected one output, as a motion switches one ahead ({key}), got {len(statements)}", statements[1].key
        )


def _lines(statements: list[ReadStatement]) -> Iterator[ReadStatement]:
    """Statements that are lines of their own."""
    return (statement for statement in statements if statement.switch.form is StatementForm.LINE)


def _require_inner(process: ProcessStatementsEntry, first: ReadStatement, data: str) -> None:
    """Inner points have a motion exactly where the ends have one, of the same family."""
    is_move = first.switch.form is StatementForm.MOVE
    if process.inner is None:
        if is_move:
            raise rule("missing, expected the motion to an inner point, as on and off are motions", "process.inner")
        return
    if not is_move:
        raise rule("unexpected key, it applies where on and off are motions", "process.inner")
    match = re.fullmatch(INNER_MOVE, process.inner.replace(DATA_SLOT, data), re.ASCII | re.IGNORECASE)
    if match is None or match["name"].lower() != first.words["name"]:
        text = f"expected a motion of the same name as {first.text!r}, neither its start nor its end, "
        raise rule(f"{text}got {process.inner!r}", "process.inner")
