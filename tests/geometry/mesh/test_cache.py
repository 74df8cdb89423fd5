"""A mesh that was kept is the mesh that was read, and a file that is refused is refused again."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from cellplan.cache import keep, key_of
from cellplan.cache.store import forget
from cellplan.errors import InputError
from cellplan.geometry.mesh.load import read_mesh, recall_mesh
from cellplan.geometry.shapes import Mesh

pytestmark = pytest.mark.usefixtures("cache_folder")


def fresh(path: Path, **options: object) -> Mesh:
    forget()
    return read_mesh(path, **options)


def assert_same(one: Mesh, other: Mesh) -> None:
    for first, second in ((one.vertices, other.vertices), (one.faces, other.faces)):
        assert first.tobytes() == second.tobytes()
        assert (first.dtype, first.shape, first.strides) == (second.dtype, second.shape, second.strides)
        assert first.flags.writeable == second.flags.writeable
    assert (one.source, one.is_closed) == (other.source, other.is_closed)


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply", "dae"])
@pytest.mark.parametrize("scale", [1.0, 0.001, (0.5, -0.5, 0.25)])
def test_a_mesh_is_the_same_when_it_was_kept(tmp_path: Path, cache_folder: Path, suffix: str, scale: object) -> None:
    path = tmp_path / f"part.{suffix}"
    trimesh.creation.annulus(1.1, 2.3, 3.7).export(path)

    read = fresh(path, scale=scale)
    entries = list(cache_folder.iterdir())
    made = fresh(path, scale=scale)

    assert len(entries) == 1
    assert list(cache_folder.iterdir()) == entries
    assert_same(read, made)


def test_name_scale_and_format_are_not_mixed_up(tmp_path: Path) -> None:
    first, second = tmp_path / "first.stl", tmp_path / "second.stl"
    trimesh.creation.box((1.0, 2.0, 3.0)).export(first)
    second.write_bytes(first.read_bytes())

    assert fresh(first).source == "first.stl"
    assert fresh(second).source == "second.stl"
    assert np.ptp(fresh(second, scale=2.0).vertices, axis=0) == pytest.approx([2.0, 4.0, 6.0], abs=1e-12)
    second.rename(tmp_path / "second.obj")
    with pytest.raises(InputError):
        fresh(tmp_path / "second.obj")


def test_a_file_that_was_changed_is_read_anew(tmp_path: Path) -> None:
    path = tmp_path / "part.stl"
    trimesh.creation.box((1.0, 1.0, 1.0)).export(path)
    fresh(path)
    trimesh.creation.box((1.0, 1.0, 2.0)).export(path)

    assert np.ptp(fresh(path).vertices[:, 2]) == pytest.approx(2.0, abs=1e-12)


def test_a_refused_file_is_refused_again_and_leaves_nothing(tmp_path: Path, cache_folder: Path) -> None:
    path = tmp_path / "part.stl"
    trimesh.creation.box((1.0, 1.0, 1.0)).export(path)
    path.write_bytes(path.read_bytes()[:-3])

    messages = []
    for _ in range(2):
        with pytest.raises(InputError) as caught:
            fresh(path)
        messages.append(str(caught.value))

    assert messages[0] == messages[1]
    assert not cache_folder.exists() or not list(cache_folder.iterdir())


def test_an_entry_that_is_damaged_is_made_again(tmp_path: Path, cache_folder: Path) -> None:
    path = tmp_path / "part.stl"
    trimesh.creation.box((1.0, 2.0, 3.0)).export(path)
    read = fresh(path)
    (entry,) = cache_folder.iterdir()
    whole = entry.read_bytes()
    entry.write_bytes(whole[:200])

    assert_same(fresh(path), read)
    assert entry.read_bytes() == whole


TRIANGLES = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])


@pytest.mark.parametrize(
    "arrays",
    [
        (np.eye(4, 3), TRIANGLES),
        (np.eye(4, 3, dtype=np.float32), TRIANGLES, np.array(True)),
        (np.eye(4, 3) * np.nan, TRIANGLES, np.array(True)),
        (np.eye(3, 3), TRIANGLES, np.array(True)),
        (np.eye(4, 3), TRIANGLES - 1, np.array(True)),
        (np.eye(4, 3), TRIANGLES[:, :2], np.array(True)),
        (np.eye(4, 3), TRIANGLES[:0], np.array(True)),
        (np.eye(4, 3), TRIANGLES, np.array([True, True])),
        (np.eye(4, 3), TRIANGLES, np.array(1.0)),
    ],
    ids=["two", "short", "nan", "out of range", "negative", "pairs", "none", "flags", "number"],
)
def test_arrays_that_are_no_mesh_are_none(arrays: tuple[np.ndarray, ...]) -> None:
    key = key_of("mesh", b"odd")
    keep(key, arrays)

    assert recall_mesh(key, source="part.stl") is None
