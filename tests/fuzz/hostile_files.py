"""Sound small robots, meshes and toolpaths as bytes, and injuries to them: cut off, torn, with other numbers."""

import struct
from collections.abc import Callable
from random import Random

CORNERS = [(x, y, z) for x in (0, 100) for y in (0, 100) for z in (0, 100)]
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
TRIANGLES = [corner for a, b, c, d in QUADS for corner in ((a, b, c), (a, c, d))]

NUMBERS = (
    *("nan", "NaN", "inf", "-inf", "1e400", "1e308", "-1e308", "1e-400", "1,5", "0x10", "1_000", "", "--1", "1e", "e1"),
    *("0", "-0", "-1", "1e6", "99999999999999999999", "4294967296", "2147483648", "-2147483649", "1/0", "½", "٣"),
    *("true", "None", "1;2", "'1'", '"1"', "1 2", "1\t2", "#", "<", "&", "%s", "{}", "\\", "$(x)"),
)


def stl_binary() -> bytes:
    facets = b"".join(
        struct.pack("<12fH", 0, 0, 0, *(float(v) for corner in face for v in CORNERS[corner]), 0) for face in TRIANGLES
    )
    return b"a box".ljust(80) + struct.pack("<I", len(TRIANGLES)) + facets


def stl_text() -> bytes:
    lines = ["solid box"]
    for face in TRIANGLES:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex {} {} {}".format(*CORNERS[corner]) for corner in face]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid box", ""]).encode()


def obj() -> bytes:
    lines = ["v {} {} {}".format(*corner) for corner in CORNERS]
    lines += ["f {} {} {} {}".format(*(corner + 1 for corner in face)) for face in QUADS]
    return "\n".join([*lines, ""]).encode()


def ply_text() -> bytes:
    lines = ["ply", "format ascii 1.0", "element vertex 8", "property float x", "property float y", "property float z"]
    lines += ["element face 6", "property list uchar int vertex_indices", "end_header"]
    lines += ["{} {} {}".format(*corner) for corner in CORNERS]
    lines += ["4 {} {} {} {}".format(*face) for face in QUADS]
    return "\n".join([*lines, ""]).encode()


def ply_binary() -> bytes:
    head = ply_text().partition(b"end_header")[0].replace(b"ascii", b"binary_little_endian") + b"end_header\n"
    body = b"".join(struct.pack("<3f", *corner) for corner in CORNERS)
    return head + body + b"".join(struct.pack("<B4i", 4, *face) for face in QUADS)


def urdf() -> bytes:
    limit = '<limit lower="-2" upper="2" velocity="3" effort="1"/>'
    lines = ['<?xml version="1.0"?>', '<robot name="arm">', '<link name="foot">']
    lines += ['<collision><origin xyz="0 0 0.1"/><geometry><box size="0.2 0.2 0.2"/></geometry></collision>', "</link>"]
    for number in range(1, 7):
        lines += [f'<link name="l{number}"><collision><geometry><sphere radius="0.05"/></geometry></collision></link>']
        before = "foot" if number == 1 else f"l{number - 1}"
        lines += [f'<joint name="j{number}" type="revolute"><parent link="{before}"/><child link="l{number}"/>']
        axis = "0 0 1" if number in (1, 4, 6) else "0 1 0"
        lines += [f'<origin xyz="0 0 0.3" rpy="0 0 0"/><axis xyz="{axis}"/>{limit}</joint>']
    return "\n".join([*lines, "</robot>", ""]).encode()


def csv_plain() -> bytes:
    rows = [f"{x},0,100,0,0,-1" for x in range(0, 100, 10)]
    return "\n".join(["x_mm,y_mm,z_mm,i,j,k", *rows, ""]).encode()


def csv_timed() -> bytes:
    rows = [f"{0.4 * n:g},{10 * n},0,100,1,0,0,0" for n in range(11)]
    return "\n".join(["t_s,x_mm,y_mm,z_mm,qw,qx,qy,qz", *rows, ""]).encode()


def zero_yaml() -> bytes:
    lines = ["zero_deg: {B4: 90, C4: -12.5}", "sign: {D4: -1}", "coupling: {C4: {B4: 1}}", 'source: "a handbook"', ""]
    return "\n".join(lines).encode()


SOUND: dict[str, Callable[[], bytes]] = {
    "binary.stl": stl_binary,
    "text.stl": stl_text,
    "box.obj": obj,
    "text.ply": ply_text,
    "binary.ply": ply_binary,
    "arm.urdf": urdf,
    "plain.csv": csv_plain,
    "timed.csv": csv_timed,
    "zero.yaml": zero_yaml,
}


def _cut(data: bytes, random: Random) -> bytes:
    return data[: random.randrange(len(data))]


def _flip(data: bytes, random: Random) -> bytes:
    place = random.randrange(len(data))
    return data[:place] + bytes([data[place] ^ 1 << random.randrange(8)]) + data[place + 1 :]


def _remove(data: bytes, random: Random) -> bytes:
    place = random.randrange(len(data))
    return data[:place] + data[place + random.randrange(1, 200) :]


def _repeat(data: bytes, random: Random) -> bytes:
    place = random.randrange(len(data))
    return data[: place + random.randrange(1, 200)] + data[place:]


def _insert(data: bytes, random: Random) -> bytes:
    place = random.randrange(len(data))
    return data[:place] + random.randbytes(random.randrange(1, 9)) + data[place:]


def _zeros(data: bytes, random: Random) -> bytes:
    place = random.randrange(len(data))
    width = random.randrange(1, 64)
    return data[:place] + bytes(width) + data[place + width :]


def _word(data: bytes, random: Random) -> bytes:
    words = data.split(b" ")
    words[random.randrange(len(words))] = random.choice(NUMBERS).encode()
    return b" ".join(words)


def _number(data: bytes, random: Random) -> bytes:
    digits = [place for place, byte in enumerate(data) if chr(byte).isdigit()]
    place = random.choice(digits) if digits else random.randrange(len(data))
    return data[:place] + random.choice(NUMBERS).encode() + data[place + 1 :]


def _swap_lines(data: bytes, random: Random) -> bytes:
    lines = data.split(b"\n")
    a, b = random.randrange(len(lines)), random.randrange(len(lines))
    lines[a], lines[b] = lines[b], lines[a]
    return b"\n".join(lines)


def _drop_line(data: bytes, random: Random) -> bytes:
    lines = data.split(b"\n")
    del lines[random.randrange(len(lines))]
    return b"\n".join(lines)


def _other_encoding(data: bytes, random: Random) -> bytes:
    return data.decode("latin-1").encode(random.choice(["utf-16", "utf-16-be", "utf-32", "utf-8", "cp037"]))


def _other_sign(data: bytes, random: Random) -> bytes:
    old, new = random.choice([(b".", b","), (b",", b";"), (b",", b"\t"), (b"\n", b"\r"), (b'"', b"'"), (b" ", b"\0")])
    return data.replace(old, new)


def _unclosed(data: bytes, random: Random) -> bytes:
    place = random.randrange(len(data))
    return (
        data[:place]
        + random.choice([b'"', b"'", b"<", b">", b"<!--", b"<![CDATA[", b"&x;", b"\xff\xfe"])
        + data[place:]
    )


INJURIES = (
    *(_cut, _flip, _remove, _repeat, _insert, _zeros, _word, _number, _number, _swap_lines, _drop_line),
    *(_other_encoding, _other_sign, _unclosed),
)


def injured(data: bytes, random: Random) -> tuple[str, bytes]:
    """The bytes after one injury, or now and then two, and its name."""
    injury = random.choice(INJURIES)
    spoilt = injury(data, random)
    if random.random() < 0.2 and spoilt:
        spoilt = random.choice(INJURIES[:6])(spoilt, random)
    return injury.__name__.removeprefix("_"), spoilt


CELL = """\
cellplan: 1
name: hostile
robots:
  holder:
    model: kuka_kr6
    start_deg: [0, -93, 108, 0, -15, 0]
  worker:
    model: {model}
    base: {{xyz_mm: [1500, 0, 0], rpy_deg: [0, 0, 180]}}
    start_deg: auto
part:
  geometry: {part}
  held_by:
    - {{robot: holder, at: {{xyz_mm: [-250, 0, 0]}}}}
tasks:
  line:
    robot: worker
    path: {path}
    tool_axis: -z
motion: {{duration_s: 4}}
"""


def cell_with(file: str) -> str:
    """A cell that names a file in the place where it belongs."""
    box = "{box: {size_mm: [200, 200, 200]}}"
    line = "{polyline: {points_mm: [[0, 0, 100], [50, 0, 100]]}}"
    model = file if file.endswith(".urdf") else "abb_irb1600"
    if file.endswith(".yaml"):
        model = f"staubli_rx90l\n    controller_zero: {file}"
    part = f"{{mesh: {file}, unit: mm}}" if file.endswith((".stl", ".obj", ".ply")) else box
    path = f"{{csv: {file}}}" if file.endswith(".csv") else line
    return CELL.format(model=model, part=part, path=path)
