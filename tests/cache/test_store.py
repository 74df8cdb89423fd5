"""What is kept comes back whole or not at all, and costs nothing but time when it does not."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cellplan.cache import as_here, keep, key_of, recall, store, without_cache
from cellplan.cache.store import forget
from cellplan.guard import Guard, in_child, isolated_call

ARRAYS = (np.arange(12.0).reshape(4, 3), np.array([[0, 1, 2]]), np.array(True))

pytestmark = pytest.mark.usefixtures("cache_folder")


def only_entry(folder: Path) -> Path:
    (path,) = folder.iterdir()
    return path


def assert_same(arrays: tuple[np.ndarray, ...] | None) -> None:
    assert arrays is not None
    for one, other in zip(arrays, ARRAYS, strict=True):
        assert (one.dtype, one.shape) == (other.dtype, other.shape)
        assert np.array_equal(one, other)
        assert not one.flags.writeable


def test_arrays_come_back_in_this_process_and_in_the_next() -> None:
    key = key_of("thing", b"content")
    assert recall(key) is None

    keep(key, ARRAYS)

    assert_same(recall(key))
    forget()
    assert_same(recall(key))


def test_odd_numbers_come_back_bit_for_bit() -> None:
    odd = np.array([-0.0, np.nan, np.inf, 5e-324, 0.1])
    keep(key_of("thing", b"odd"), (odd,))
    forget()

    recalled = recall(key_of("thing", b"odd"))

    assert recalled is not None
    assert recalled[0].tobytes() == odd.tobytes()


@pytest.mark.parametrize("contents", [(b"b", b"a"), (b"ab",), (b"", b"ab"), (b"a", b"b", b"")])
def test_other_contents_have_other_keys(contents: tuple[bytes, ...]) -> None:
    assert key_of("thing", *contents) != key_of("thing", b"a", b"b")
    assert key_of("thing", b"a", b"b") != key_of("other", b"a", b"b")


def test_every_damage_to_an_entry_makes_it_useless_and_nothing_else(cache_folder: Path) -> None:
    key = key_of("thing", b"content")
    keep(key, ARRAYS)
    path = only_entry(cache_folder)
    whole = path.read_bytes()
    injuries = [b"", whole[:-1], whole[: len(whole) // 2], whole + b"x", b"\0" * len(whole)]
    injuries += [whole[:k] + bytes([whole[k] ^ 1]) + whole[k + 1 :] for k in range(0, len(whole), 7)]

    for injured in injuries:
        path.write_bytes(injured)
        forget()
        assert recall(key) is None

    keep(key, ARRAYS)
    forget()
    assert_same(recall(key))


def test_objects_are_neither_kept_nor_brought_to_life(cache_folder: Path) -> None:
    """An array of objects would be a pickle, which can run anything; a right digest does not make it welcome."""
    key = key_of("thing", b"content")
    keep(key, (np.array([{"a": 1}], dtype=object),))
    assert recall(key) is None
    assert not cache_folder.exists() or not list(cache_folder.iterdir())

    import hashlib
    import io

    body = io.BytesIO()
    np.lib.format.write_array(body, np.array([{"a": 1}], dtype=object), allow_pickle=True)
    keep(key, ARRAYS)
    only_entry(cache_folder).write_bytes(store.FORMAT + hashlib.sha256(body.getvalue()).digest() + body.getvalue())
    forget()
    assert recall(key) is None


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="needs files that its user may not read")
def test_an_entry_that_cannot_be_read_is_none(cache_folder: Path) -> None:
    key = key_of("thing", b"content")
    keep(key, ARRAYS)
    only_entry(cache_folder).chmod(0)
    forget()

    assert recall(key) is None


def test_an_entry_that_is_a_folder_is_none(cache_folder: Path) -> None:
    key = key_of("thing", b"content")
    keep(key, ARRAYS)
    path = only_entry(cache_folder)
    path.unlink()
    path.mkdir()
    forget()

    assert recall(key) is None
    keep(key, ARRAYS)
    assert [path.suffix for path in cache_folder.iterdir()] == [".entry"]


def test_the_folder_stays_within_its_bounds_and_loses_what_was_not_used_for_longest(
    cache_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store, "MAX_FOLDER", 5500)
    keys = [key_of("thing", bytes([number])) for number in range(4)]
    for age, key in enumerate(keys[:3]):
        keep(key, (np.full(200, float(age)),))  # 1.6 kB and a head
    for age, key in enumerate(keys[:3]):
        os.utime(cache_folder / f"thing-{key.digest}.entry", (1000.0 + age, 1000.0 + age))
    forget()
    recall(keys[0])  # the oldest, but of use just now

    keep(keys[3], (np.full(200, 3.0),))

    forget()
    assert [recall(key) is not None for key in keys] == [True, False, True, True]


def test_what_is_too_large_is_not_written(cache_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "MAX_ENTRY", 100)
    keep(key_of("thing", b"content"), ARRAYS)

    assert not cache_folder.exists() or not list(cache_folder.iterdir())


def test_a_process_holds_no_more_than_its_share(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CELLPLAN_CACHE", "off")
    monkeypatch.setattr(store, "MAX_RECENT", 100)
    keep(key_of("thing", b"1"), (np.zeros(10),))
    keep(key_of("thing", b"2"), (np.ones(10),))
    keep(key_of("thing", b"3"), (np.ones(100),))

    assert [recall(key_of("thing", name)) is None for name in (b"1", b"2", b"3")] == [True, True, True]


def test_two_processes_that_write_the_same_entry_do_not_disturb_each_other(cache_folder: Path) -> None:
    code = (
        "import numpy as np; from cellplan.cache import *; from cellplan.cache.store import forget\n"
        "for n in range(200):\n"
        "    key = key_of('thing', bytes([n % 5])); keep(key, (np.full(5000, float(n % 5)),)); forget()\n"
        "    found = recall(key); assert found is not None and np.all(found[0] == n % 5)"
    )
    processes = [subprocess.Popen([sys.executable, "-c", code]) for _ in range(2)]

    assert [process.wait() for process in processes] == [0, 0]
    assert sorted(path.suffix for path in cache_folder.iterdir()) == [".entry"] * 5


def kept_entry(folder: Path) -> Path:
    keep(key_of("thing", b"content"), ARRAYS)
    forget()
    return only_entry(folder)


def test_a_pipe_in_the_place_of_an_entry_is_not_waited_for(cache_folder: Path) -> None:
    path = kept_entry(cache_folder)
    path.unlink()
    os.mkfifo(path)

    assert recall(key_of("thing", b"content")) is None


def test_a_link_in_the_place_of_an_entry_is_not_followed(cache_folder: Path, tmp_path: Path) -> None:
    path = kept_entry(cache_folder)
    path.rename(tmp_path / "elsewhere")
    path.symlink_to(tmp_path / "elsewhere")

    assert recall(key_of("thing", b"content")) is None


def test_an_entry_that_others_may_write_is_not_used(cache_folder: Path) -> None:
    path = kept_entry(cache_folder)
    path.chmod(0o666)
    assert recall(key_of("thing", b"content")) is None

    path.chmod(0o600)
    assert_same(recall(key_of("thing", b"content")))


@pytest.mark.skipif(os.getuid() != 0, reason="only the superuser can give a file away")
def test_an_entry_of_somebody_else_is_not_used(cache_folder: Path) -> None:
    os.chown(kept_entry(cache_folder), 4711, -1)

    assert recall(key_of("thing", b"content")) is None


def test_without_the_cache_only_what_this_process_made_is_used(cache_folder: Path) -> None:
    kept_entry(cache_folder)
    assert_same(recall(key_of("thing", b"content")))  # held from now on, but it came from the folder

    with without_cache():
        assert recall(key_of("thing", b"content")) is None
        keep(key_of("thing", b"other"), ARRAYS)
        assert_same(recall(key_of("thing", b"other")))

    assert_same(recall(key_of("thing", b"content")))
    assert len(list(cache_folder.iterdir())) == 1


def test_a_child_process_does_without_the_cache_where_its_parent_does(cache_folder: Path) -> None:
    guard = Guard(file="thing", worker="the worker")
    kept_entry(cache_folder)
    isolated_call._end_child()  # the next one knows this cache

    with without_cache():
        assert in_child(as_here(recall), key_of("thing", b"content"), guard=guard) is None
    assert in_child(as_here(recall), key_of("thing", b"content"), guard=guard) is not None
