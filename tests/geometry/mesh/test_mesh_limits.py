"""Meshes with far too much in them are refused before they fill the memory."""

from pathlib import Path

import pytest

from cellplan.errors import InputError
from cellplan.geometry.mesh.formats import stl_obj
from cellplan.geometry.mesh.load import read_mesh

PLY = "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
FACES = "element face {}\nproperty list uchar int vertex_indices\nend_header\n"


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("m.obj", "v 0 0 0\n" * 15_001, "m.obj:15001: expected at most 15000 vertices, got more"),
        ("m.obj", "v 0 0 0\n" * 3 + "f 1 2 3\n" * 5_001, "m.obj:5004: expected at most 5000 faces, got more"),
        ("m.obj", "f" + " 1" * 60_000, "m.obj:1: expected at most 100000 characters in a line, got more"),
        ("m.obj", "f" + " 1 2\\\n" * 60_000, "m.obj:50000: expected at most 100000 words in a line, got more"),
        (
            "m.stl",
            "solid\n" + "vertex 0 0 0\n" * 15_001,
            "m.stl:15002: expected at most 15000 'vertex' lines, got more",
        ),
        (
            "m.ply",
            PLY.format(2_000_000) + FACES.format(1),
            "m.ply: expected at most 1500000 rows of 'vertex', got 2000000",
        ),
        ("m.ply", PLY.format(3) + FACES.format(600_000), "m.ply: expected at most 500000 rows of 'face', got 600000"),
    ],
    ids=["vertices", "faces", "long line", "joined lines", "stl", "ply vertices", "ply faces"],
)
def test_too_much_is_refused_where_it_begins_to_be(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, text: str, message: str
) -> None:
    """Triangles are counted up to a hundredth of what is allowed: the files are that much smaller."""
    assert stl_obj.MAX_TRIANGLES == 500_000
    monkeypatch.setattr(stl_obj, "MAX_TRIANGLES", 5_000)
    (tmp_path / name).write_text(text, encoding="utf-8")

    with pytest.raises(InputError) as caught:
        read_mesh(tmp_path / name)

    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("m.obj", "v 1_0 0 0\n", "m.obj:1: expected 3 numbers, got '1_0 0 0'"),
        ("m.obj", "v ٣ 0 0\n", "m.obj:1: expected 3 numbers, got '٣ 0 0'"),
        ("m.obj", "v 0 0 0\nf 1 1 99999999999999999999\n", "m.obj:2: expected a vertex number from 1 to 1, got"),
        (
            "m.ply",
            PLY.format(1) + FACES.format(1) + "1_0 0 0\n3 0 0 0\n",
            "m.ply: expected the numbers that the PLY header",
        ),
    ],
)
def test_words_that_only_python_takes_for_numbers_are_refused(
    tmp_path: Path, name: str, text: str, message: str
) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")

    with pytest.raises(InputError) as caught:
        read_mesh(tmp_path / name)

    assert str(caught.value).startswith(message)
