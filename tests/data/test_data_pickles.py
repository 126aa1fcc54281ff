# SPDX-License-Identifier: MIT
"""Other people's pickles: arrays come back bit for bit, and nothing that would run is even imported."""

from __future__ import annotations

import contextlib
import datetime
import io
import os
import pickle
import sys
from pathlib import Path
from typing import Any

import hypothesis.extra.numpy as numpy_strategies
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hybridreg.data.lists.pickles import globals_of, load, read_pickle
from hybridreg.data.lists.pth import read_pth

ARRAYS = numpy_strategies.arrays(
    dtype=st.sampled_from(["f4", "f8", "i2", "i8", "u1", ">f8", "?", "U5"]),
    shape=numpy_strategies.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=5),
)


def restored(content: Any, protocol: int) -> Any:
    return load(io.BytesIO(pickle.dumps(content, protocol=protocol)), "list.pkl")


@given(array=ARRAYS, protocol=st.integers(0, 5), fortran=st.booleans())
def test_arrays_come_back_bit_for_bit(array: np.ndarray, protocol: int, fortran: bool) -> None:
    kept = np.asfortranarray(array) if fortran and array.ndim else array
    back = restored({"T": kept, "list": [kept, "text", 3, 2.5, None, (True, b"x")]}, protocol)
    # numpy itself turns big-endian arrays to the machine's order as it unpickles them.
    expected = pickle.loads(pickle.dumps(kept, protocol=protocol)).dtype
    for each in (back["T"], back["list"][0]):
        assert each.dtype == expected
        assert each.shape == array.shape
        assert np.array_equal(each, array, equal_nan=array.dtype.kind == "f")
    assert back["list"][1:] == ["text", 3, 2.5, None, (True, b"x")]


@pytest.mark.parametrize("protocol", range(6))
def test_numbers_and_columns_of_text_come_back(protocol: int) -> None:
    record = {"overlap": np.float64(0.25), "id": np.int32(7), "names": np.array(["a", "bc"], dtype=object)}
    back = restored(record, protocol)
    assert back["overlap"] == 0.25
    assert back["id"] == 7
    assert list(back["names"]) == ["a", "bc"]


@pytest.mark.parametrize("package", ["core", "_core"])
@pytest.mark.parametrize("protocol", [0, 2])
def test_numpy_1_and_2_file_their_helpers_elsewhere(package: str, protocol: int) -> None:
    data = pickle.dumps([np.arange(6.0).reshape(2, 3), np.float32(2)], protocol=protocol)
    # Up to protocol 3 names are plain lines, so that either version's file can be made from the other's.
    data = data.replace(b"numpy._core.", b"numpy.core.").replace(b"numpy.core.", f"numpy.{package}.".encode())
    assert f"numpy.{package}.".encode() in data
    back = load(io.BytesIO(data), "list.pkl")
    assert np.array_equal(back[0], np.arange(6.0).reshape(2, 3))
    assert back[1] == 2


def test_numpy_1_file_of_protocol_4() -> None:
    data = pickle.dumps(np.arange(3.0), protocol=4)
    data = data[:2] + data[11:]  # without the frame, which holds a length
    new, old = b"numpy._core.multiarray", b"numpy.core.multiarray"
    data = data.replace(bytes([0x8C, len(new)]) + new, bytes([0x8C, len(old)]) + old)
    assert old in data
    assert np.array_equal(load(io.BytesIO(data), "list.pkl"), np.arange(3.0))


class Command:
    """Runs a shell command when it is unpickled by a reader that trusts it."""

    def __init__(self, function: Any, *arguments: Any) -> None:
        self.call = (function, arguments)

    def __reduce__(self) -> Any:
        return self.call


def hostile(marker: Path) -> dict[str, bytes]:
    """Pickles that would leave `marker` behind, or load code, if a reader trusted them."""
    touch = f"touch {marker}"
    code = f"open({str(marker)!r}, 'w')"
    dotted = b"\x80\x04\x8c\x0bnumpy._core\x94\x8c\x14multiarray.os.system\x94\x93\x94."
    return {
        "system": pickle.dumps([{"T": Command(os.system, touch)}]),
        "eval": pickle.dumps(Command(eval, code), protocol=2),
        "exec, as text": pickle.dumps(Command(exec, code), protocol=0),
        "getattr": b"cbuiltins\ngetattr\n(cos\nsystem\nS'x'\ntR.",
        "an import": b"cantigravity\nopen\n.",
        "numpy's own loader": b"cnumpy\nload\n(S'x.npy'\nNI01\ntR.",
        "a dotted way round": dotted,
        "a harmless class all the same": pickle.dumps(datetime.date(2025, 1, 1)),
        "inside an array of objects": pickle.dumps(np.array([Command(os.system, touch)], dtype=object)),
    }


@pytest.mark.parametrize("kind", sorted(hostile(Path("marker"))))
def test_forbidden_classes_are_named_and_not_run(kind: str, tmp_path: Path) -> None:
    marker = tmp_path / "was-run"
    file = tmp_path / "train.pkl"
    file.write_bytes(hostile(marker)[kind])
    before = set(sys.modules)
    with pytest.raises(ValueError, match=r"asks for .*; take the file") as caught:
        read_pickle(file)
    assert str(file) in str(caught.value)
    assert not marker.exists()
    assert not set(sys.modules) - before


def test_the_hostile_file_would_have_run(tmp_path: Path) -> None:
    # Otherwise the test above could not fail.
    marker = tmp_path / "was-run"
    pickle.loads(hostile(marker)["system"])
    assert marker.exists()


def test_a_pickle_cannot_bend_the_readers_own_helpers(tmp_path: Path) -> None:
    # BUILD with (None, {...}) sets attributes of what lies on the stack: of the stand-in for numpy.dtype.
    bend = b"\x80\x02cnumpy\ndtype\n(N}U\x0c__defaults__(I1\ntstb."
    for _ in range(2):
        with contextlib.suppress(ValueError):
            load(io.BytesIO(bend), "list.pkl")
        assert np.array_equal(restored(np.arange(4.0), 2), np.arange(4.0))


@given(data=st.data())
def test_damaged_pickles_raise_value_error_or_nothing(data: st.DataObject) -> None:
    whole = bytearray(pickle.dumps([{"seq_id": 8, "transform": np.eye(4), "pcd0": "a.npy"}] * 2, protocol=4))
    cut = data.draw(st.integers(0, len(whole)))
    for place in data.draw(st.lists(st.integers(0, len(whole) - 1), max_size=3)):
        whole[place] ^= data.draw(st.integers(1, 255))
    try:
        load(io.BytesIO(bytes(whole[:cut])), "list.pkl")
    except ValueError as error:
        assert "list.pkl" in str(error)


def test_globals_are_told_without_loading() -> None:
    for protocol in (0, 2, 4, 5):
        names = globals_of(pickle.dumps([np.eye(2), datetime.date(2025, 1, 1)], protocol=protocol))
        assert "datetime.date" in names
        assert any(name.startswith("numpy.") for name in names)


@pytest.mark.parametrize("zipped", [True, False])
@pytest.mark.parametrize("tensor", [True, False])
def test_pth_of_either_age_and_content(zipped: bool, tensor: bool, tmp_path: Path) -> None:
    import torch

    points = np.random.default_rng(0).normal(size=(50, 3)).astype(np.float32)
    content = torch.from_numpy(points) if tensor else points
    torch.save(content, tmp_path / "cloud_bin_0.pth", _use_new_zipfile_serialization=zipped)
    back = read_pth(tmp_path / "cloud_bin_0.pth")
    assert back.dtype == np.float64
    assert np.array_equal(back, points)


@pytest.mark.parametrize("zipped", [True, False])
def test_pth_runs_nothing(zipped: bool, tmp_path: Path) -> None:
    import torch

    marker, file = tmp_path / "was-run", tmp_path / "cloud_bin_0.pth"
    for content in (
        Command(os.system, f"touch {marker}"),
        [torch.zeros(3), Command(os.system, f"touch {marker}")],
    ):
        torch.save(content, file, _use_new_zipfile_serialization=zipped)
        with pytest.raises(ValueError, match=file.name):
            read_pth(file)
        assert not marker.exists()


def test_pth_that_is_none(tmp_path: Path) -> None:
    import torch

    torch.save({"a": 1}, tmp_path / "dict.pth")
    torch.save(np.zeros((4, 2)), tmp_path / "flat.pth")
    (tmp_path / "empty.pth").write_bytes(b"")
    (tmp_path / "noise.pth").write_bytes(b"PK\x03\x04 and no more")
    (tmp_path / "list.pth").write_bytes(pickle.dumps([1, 2]))
    for file in sorted(tmp_path.iterdir()):
        with pytest.raises(ValueError, match=file.name):
            read_pth(file)
