"""Process statements of controllers: what makers have is allowed; motions, jumps and second statements are refused."""

from typing import Any

import pytest
from pydantic import ValidationError

from cellplan.model.settings.controllers import ControllerEntry

SLOTS = r"{point}, {speed}, seam1, weld1, {zone}, {tool} \WObj:={frame};"
ARC: dict[str, Any] = {"on": f"ArcLStart {SLOTS}", "inner": f"ArcL {SLOTS}", "off": f"ArcLEnd {SLOTS}"}
ALLOWED: list[tuple[str, dict[str, Any]]] = [
    ("abb", ARC),
    ("abb", {key: text.replace("weld1", "{data}") for key, text in ARC.items()} | {"data": {"seam": "weld7"}}),
    ("abb", {key: text.replace("weld1", r"weld1\Weave:=weave1") for key, text in ARC.items()}),
    (
        "abb",
        {key: text.replace("weld1", r"weld1 \Weave:=wv").replace(";", r"\Track:=tr;") for key, text in ARC.items()},
    ),
    ("abb", {key: text.replace("ArcL", "ArcL2").replace(";", r'\SeamName:="s1"') for key, text in ARC.items()}),
    (
        "abb",
        {
            "on": r"DispL\On, {point}, {speed}, bead1, {zone}, {tool}\WObj:={frame}",
            "inner": r"DispL {point}, {speed}, bead1, {zone}, {tool}\WObj:={frame}",
            "off": r"DispL\Off, {point}, {speed}, bead1, {zone}, {tool}\WObj:={frame}",
        },
    ),
    ("abb", {"on": ["SetDO doGas,1", "SetDO doArc, high;"], "off": ["SetDO doArc,low", "SetDO doGas,0"]}),
    ("fanuc", {"on": ["Weave Sine[1]", "Weld Start[1,1]"], "off": ["Weld End[1,1]", "Weave End"]}),
    (
        "fanuc",
        {"on": ["Arc Start[6]", "Weave Circle[1.0Hz,3.0mm,0.050s,0.050s]"], "off": ["Arc End[6]", "Weave End[1]"]},
    ),
    (
        "fanuc",
        {
            "on": ["Weave Sine[6]", "Track TAST[6] RPM[2]", "Weld Start E1[1,{data}]"],
            "off": ["Weld End E1[1,2]", "Track End", "Weave End"],
            "data": {"seam": "3"},
        },
    ),
    (
        "fanuc",
        {"on": ["Weave Sine[6]", "Track TAST[6]", "Arc Start[6]"], "off": ["Arc End[6]", "Weave End", "Track End"]},
    ),
    ("fanuc", {"on": ["DO[1]=ON", "CALL A", "DO[2]=ON"], "off": ["DO[1]=OFF", "DO[2]=OFF", "CALL B"]}),
    ("fanuc", {"on": "DO[5]=ON", "off": "DO[5]=OFF"}),
    ("fanuc", {"on": "DO[5]=ON", "off": "DO[5]=OFF", "on_lead_s": 0.29, "off_lead_s": 0.5}),
    ("fanuc", {"on": "CALL GUN(1,2)", "off": "CALL GUN(0)"}),
    ("kuka", {"on": "$OUT[7]=FALSE", "off": "$out[7] = true"}),
    ("kuka", {"on": ["$OUT[7]=TRUE", "GUN_ON()"], "off": ["GUN_OFF()", "$OUT[7]=FALSE"], "on_lead_s": 0.0}),
    ("abb", {"on": ["SetDO doA,1", "SetDO doB,1"], "off": ["SetDO doB,0", "SetDO doA,0"], "on_lead_s": 0.137}),
    (
        "kuka",
        {
            "on": "ArcMainNG(#ArcOnBefSeamStd, {data}, WP1)",
            "off": "ArcMainNG(#ArcOffStd, WDAT2, WP2)",
            "data": {"s": "W1"},
        },
    ),
    ("staubli", {"on": "doGlue=true", "off": "doGlue=false"}),
    ("staubli", {"on": "call glue:open(1.5)", "off": "call glue:close()"}),
    ("ur", {"on": "set_digital_out(3,True)", "off": "set_digital_out(3,False)"}),
    ("ur", {"on": "arc_on({data})", "off": "arc_off()", "data": {"seam": "4"}}),
    ("yaskawa", {"on": ["ARCON ASF#(1)", "WVON WEV#(1)"], "off": ["WVOF", "ARCOF AEF#(1)"]}),
    ("yaskawa", {"on": "ARCON AC=220 AVP=100 T=0.50", "off": "ARCOF"}),
    ("yaskawa", {"on": ["DOUT OT#(5) ON", "CALL JOB:GUN-ON"], "off": ["CALL JOB:GUN-OFF", "DOUT OT#(5) OFF"]}),
]
SMUGGLED: dict[str, list[str]] = {
    "abb": [
        "MoveL p1, v100, fine, tool0;",
        "SetDO doArc,1; MoveL p1, v100, fine, tool0;",
        "SetDO doArc,1;\nMoveAbsJ home, v1000, fine, tool0;",
        "SetDO doArc,1 ! on",
        "SetDO doArc,1;;",
        "SetDO doArc,reg1",
        "reg1:=1;",
        "GOTO again;",
        "again:",
        "Stop;",
        "SetDO döArc,1",
        f"ArcLStart {SLOTS} MoveL {SLOTS}",
        rf"ArcLStart \On, {SLOTS}",
        f"ArcL {SLOTS}",
        f"ArcCStart {SLOTS}",
        ARC["on"].replace(", {tool}", ", tool0"),
        ARC["on"].replace("{point}", "p1"),
        ARC["on"].replace("{speed}", "v100"),
        ARC["on"].replace("{frame}", "wobj0"),
        ARC["on"].replace(r" \WObj:={frame}", ""),
        ARC["on"].replace("{zone}", r"{zone}\Wrist"),
        ARC["on"].replace("weld1", "weld1, {point}"),
        ARC["on"].replace(";", r"\SeamName:=\"a;b\";"),
        ARC["on"].replace("weld1", "Offs(weld1,1,2,3)"),
    ],
    "fanuc": [
        "J P[1] 100% FINE",
        "Weld Start[1,1] ;\n2:J P[1] 100% FINE",
        "Weld Start[1,1] ; J P[1] 100% FINE",
        "Weld Start[R[1],1]",
        "JMP LBL[1]",
        "LBL[1]",
        "!Weld Start[1,1]",
        "//Weld Start[1,1]",
        "R[1]=1",
        "DO[1]=ON,JMP LBL[2]",
        "DO[1]=R[2]",
        "UFRAME_NUM=2",
        "OVERRIDE=100%",
        "CALL GUN(R[1])",
        "Weld End[1,1]",
        "ABORT",
    ],
    "kuka": [
        "PTP HOME",
        "LIN(XP1)",
        "ptp_rel(a)",
        "BAS(#VEL_CP,2)",
        "$OUT[1]=TRUE\r\nPTP HOME",
        "$OUT[1]=TRUE ; on",
        "$OUT[1]=$IN[2]",
        "$VEL.CP=2",
        "$BASE=$NULLFRAME",
        "GOTO AGAIN",
        "AGAIN:",
        "HALT",
        "RETURN(1)",
        "GUN_ON({A1 0})",
        "GUN_ON() PTP HOME",
        "PULSE($OUT[1],TRUE,1)",
        "X=GUN_ON()",
    ],
    "staubli": [
        "movej(j[0],t[0],m[0])",
        "call gunOn() movej(j[0],t[0],m[0])",
        "call start()",
        "doArc=true\n  movej(j[0],t[0],m[0])",
        "nSpeed=100",
        "bFlag=true",
        "doArc=diArc",
        "doArc=true // on",
        "doArc=true]]>",
        "resetMotion()",
        "return",
    ],
    "ur": [
        "movel(p1)",
        "servoj(q)",
        "stopj(2)",
        "set_tcp(p1)",
        "set_digital_out(0,True);movel(p1)",
        "set_digital_out(0,True)\nmovel(p1)",
        "set_digital_out(0,True) # on",
        "set_digital_out(8,True)",
        "halt()",
        "x=arc_on()",
        "end",
        "run(1)",
        "arc_on(movel(p1))",
        "socket_open(a,1)",
    ],
    "yaskawa": [
        "MOVJ C00001 VJ=50.00",
        "ARCON ASF#(1)\nMOVJ C00001 VJ=50.00",
        "ARCON ASF#(1) MOVJ C00001",
        "JUMP *A",
        "*A",
        "'on",
        "SET B000 1",
        "DOUT OT#(1) B000",
        "DOUT OT#(1) ON IF IN#(1)=ON",
        "CALL JOB:GUN ARGF1",
        "ARCON ASF#(B001)",
        "ABORT",
    ],
}
PAIRS = {
    "abb": ("SetDO doArc,1", "SetDO doArc,0"),
    "fanuc": ("DO[1]=ON", "DO[1]=OFF"),
    "kuka": ("$OUT[1]=TRUE", "$OUT[1]=FALSE"),
    "staubli": ("doArc=true", "doArc=false"),
    "ur": ("set_digital_out(0,True)", "set_digital_out(0,False)"),
    "yaskawa": ("DOUT OT#(1) ON", "DOUT OT#(1) OFF"),
}


def controller(kind: str, process: dict[str, Any]) -> ControllerEntry:
    """The entry as it is read: lists of a file are tuples."""
    values = {key: tuple(value) if isinstance(value, list) else value for key, value in process.items()}
    return ControllerEntry.model_validate({"kind": kind, "process": values})


def refusal(kind: str, process: dict[str, Any]) -> tuple[str, str]:
    """Key and text of the only finding about a controller."""
    with pytest.raises(ValidationError) as caught:
        controller(kind, process)
    (error,) = caught.value.errors()
    return error.get("ctx", {}).get("key", "") or ".".join(map(str, error["loc"])), error["msg"]


@pytest.mark.parametrize(("kind", "process"), ALLOWED)
def test_statements_of_the_makers_are_allowed(kind: str, process: dict[str, Any]) -> None:
    entry = controller(kind, process).process

    assert entry is not None
    assert list(entry.statements(on=True).values()) == (
        [process["on"]] if isinstance(process["on"], str) else process["on"]
    )
    assert ControllerEntry.model_validate({"kind": kind, "process": entry.model_dump()}).process == entry


@pytest.mark.parametrize(("kind", "text"), [(kind, text) for kind, texts in SMUGGLED.items() for text in texts])
def test_nothing_else_gets_into_a_program(kind: str, text: str) -> None:
    """Neither where a process begins, nor where it ends, whatever stands around it."""
    on, off = PAIRS[kind]

    key, message = refusal(kind, {"on": text, "off": off})
    assert key == "process.on"
    assert message.startswith(f"expected a statement of kind {kind} that begins a process, such as ")
    assert refusal(kind, {"on": [on, text], "off": [off]})[0] == "process.on[1]"
    if text not in {"Weld End[1,1]", ARC["inner"]}:
        assert refusal(kind, {"on": [on], "off": [text, off]})[0] == "process.off[0]"


@pytest.mark.parametrize("text", ["MoveL {point}", ARC["on"], ARC["off"], ARC["inner"].replace("ArcL", "ArcL2")])
def test_an_inner_motion_is_one_of_the_family(text: str) -> None:
    key, message = refusal("abb", ARC | {"inner": text})

    assert key == "process.inner"
    assert message.startswith("expected a motion of the same name as 'ArcLStart {point}")


@pytest.mark.parametrize(
    ("kind", "process", "key", "words"),
    [
        (
            "fanuc",
            {"on": ["Weave Sine[1]", "Weld Start[1,1]"], "off": "Weld End[1,1]"},
            "on[0]",
            "ends 'Weave Sine[1]'",
        ),
        ("fanuc", {"on": "Weld Start[1,1]", "off": ["Weld End[1,1]", "Weave End"]}, "off[1]", "what 'Weave End' ends"),
        ("fanuc", {"on": "Weld Start[1,1]", "off": "Arc End[1]"}, "on", "ends 'Weld Start[1,1]'"),
        ("fanuc", {"on": "Weld Start E1[1,1]", "off": "Weld End E2[1,1]"}, "on", "ends 'Weld Start E1[1,1]'"),
        (
            "fanuc",
            {"on": ["Weld Start[1,1]", "Arc Start[1]"], "off": ["Arc End[1]", "Weld End[1,1]"]},
            "on[1]",
            "one such",
        ),
        ("fanuc", {"on": "DO[1]=ON", "off": "DO[1]=ON"}, "on", "ends 'DO[1]=ON'"),
        ("fanuc", {"on": "DO[1]=ON", "off": "DO[2]=OFF"}, "on", "ends 'DO[1]=ON'"),
        (
            "fanuc",
            {"on": ["DO[1]=ON", "DO[1]=ON", "DO[2]=ON"], "off": ["DO[1]=OFF", "DO[2]=OFF", "DO[2]=OFF"]},
            "off[2]",
            "ends 'DO[1]=ON', as each statement ends one, got 'DO[2]=OFF'",
        ),
        (
            "yaskawa",
            {"on": ["ARCON", "WVON WEV#(1)"], "off": ["ARCOF", "WVOF"]},
            "off[0]",
            "ends 'WVON WEV#(1)', as what",
        ),
        ("yaskawa", {"on": ["ARCON", "ARCON"], "off": ["ARCOF"]}, "off", "expected 2 statements"),
        ("yaskawa", {"on": "WVON WEV#(1)", "off": "ARCOF"}, "on", "ends 'WVON WEV#(1)'"),
        ("abb", {"on": ARC["on"], "off": ARC["off"]}, "inner", "missing"),
        ("abb", ARC | {"off": ARC["off"].replace("ArcL", "ArcL1")}, "on", "ends 'ArcLStart"),
        ("abb", ARC | {"on": [ARC["on"], "SetDO doArc,1"], "off": [ARC["off"]]}, "on[0]", "beside a motion"),
        ("abb", ARC | {"on": "SetDO doArc,1", "off": "SetDO doArc,0"}, "inner", "unexpected key"),
        ("abb", ARC | {"data": {"seam": "weld1"}}, "data", "unexpected key"),
        ("ur", {"on": "arc_on({data})", "off": "arc_off()"}, "data", "missing"),
        ("ur", {"on": "arc_on()", "off": "arc_off()", "feed_in": "{data}"}, "data", "missing"),
        ("fanuc", {"on": "CALL A({data})", "off": "CALL B", "data": {"a": "1", "b": "x"}}, "on", "with x in it"),
        ("reis", {"on": "a()", "off": "b()"}, "", "unexpected key, it applies to the kinds abb, fanuc, "),
    ],
)
def test_what_is_begun_ends_in_the_reverse_order(kind: str, process: dict[str, Any], key: str, words: str) -> None:
    place, message = refusal(kind, process)

    assert place == f"process.{key}".rstrip(".")
    assert words in message


LEADING = {kind: {"on": on, "off": off, "on_lead_s": 0.1} for kind, (on, off) in PAIRS.items()}


@pytest.mark.parametrize(
    ("kind", "process", "key", "words"),
    [
        *((kind, LEADING[kind], "on_lead_s", f"ahead, got {kind}: remove it") for kind in ("staubli", "ur", "yaskawa")),
        ("fanuc", LEADING["fanuc"] | {"on_lead_s": 0.105}, "on_lead_s", "expected a multiple of 0.01 s"),
        ("kuka", LEADING["kuka"] | {"off_lead_s": 0.0105}, "off_lead_s", "expected a multiple of 0.001 s"),
        ("fanuc", {"on": "CALL A", "off": "CALL B", "off_lead_s": 0.1}, "off", "(process.off_lead_s), got 'CALL B'"),
        ("fanuc", {"on": "Arc Start[1]", "off": "Arc End[1]", "on_lead_s": 0.1}, "on", "outputs only"),
        ("abb", ARC | {"on_lead_s": 0.1}, "on", "expected outputs only, as nothing else is switched ahead"),
        (
            "kuka",
            {"on": ["$OUT[7]=TRUE", "GUN_ON()"], "off": ["GUN_OFF()", "$OUT[7]=FALSE"], "on_lead_s": 0.1},
            "on[1]",
            "got 'GUN_ON()'",
        ),
        (
            "fanuc",
            {"on": ["DO[1]=ON", "DO[2]=ON"], "off": ["DO[2]=OFF", "DO[1]=OFF"], "off_lead_s": 0.1},
            "off[1]",
            "expected one output",
        ),
    ],
)
def test_outputs_lead_where_motions_switch_them(kind: str, process: dict[str, Any], key: str, words: str) -> None:
    place, message = refusal(kind, process)

    assert place == f"process.{key}"
    assert words in message


@pytest.mark.parametrize(
    ("process", "place"),
    [
        ({"on": (), "off": "b()"}, "process.on.<list>"),
        ({"on": ("a()",) * 9, "off": "b()"}, "process.on.<list>"),
        ({"on": "a()" + " " * 200, "off": "b()"}, "process.on.<a statement, or a list of statements>"),
        ({"on": "a({data})", "off": "b()", "data": {"seam": "1)\nmovel(p1"}}, "process.data.seam"),
        ({"on": "a()", "off": "b()", "feed_in": "weld1\nmovel(p1)"}, "process.feed_in."),
        ({"on": "a()", "off": "b()", "weave_mm": -1.0}, "process.weave_mm"),
        ({"on": "a()", "off": "b()", "on_lead_s": 0.6}, "process.on_lead_s"),
    ],
)
def test_texts_are_bounded(process: dict[str, Any], place: str) -> None:
    with pytest.raises(ValidationError) as caught:
        controller("ur", process)

    assert ".".join(map(str, caught.value.errors()[0]["loc"])).startswith(place)
