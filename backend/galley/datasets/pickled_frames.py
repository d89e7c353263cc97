"""Columns of a pickled pandas frame, read without pandas and without running anything that the file names.

A pickle is a small program that may call whatever it names. This reader answers to the few names that a
plain frame needs, each with a stand-in of ours that only keeps what it is given, and refuses all others.
"""

from __future__ import annotations

import math
import pickle
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from galley.errors import GalleyError

_PLAIN_TYPES: Final = {"b1": "bool", "f8": "<f8", "i8": "<i8", "f4": "<f4", "i4": "<i4", "u1": "u1"}
_OBJECTS: Final = ("O8", "O")
_LARGEST_ARRAY: Final = 100_000_000
_LARGEST_FILE_BYTES: Final = 500_000_000
_TOLD_CHARACTERS: Final = 200


class _Kept:
    """Stands in for an object of which only the state matters."""

    state: Any = None

    def __setstate__(self, state: Any) -> None:
        self.state = state


class _Frame(_Kept):
    """pandas.DataFrame."""


class _Blocks(_Kept):
    """pandas' BlockManager."""


class _Array(_Kept):
    """numpy.ndarray; `values` makes a real one."""

    def values(self) -> NDArray[Any]:
        """The array that was pickled.

        Raises:
            ValueError: its shape, type and contents do not agree.
        """
        _, shape, dtype, column_major, content = self.state
        sizes = list(shape)
        if not all(isinstance(size, int) and 0 <= size <= _LARGEST_ARRAY for size in sizes) or len(sizes) > 2:
            raise ValueError("an array whose shape is none of a table's")
        count = math.prod(sizes)
        if count > _LARGEST_ARRAY or not isinstance(dtype, _Dtype):
            raise ValueError(f"an array of shape {sizes}")
        if dtype.code in _OBJECTS:
            if not isinstance(content, list) or len(content) != count:
                raise ValueError("an array of objects without its objects")
            flat = np.empty(count, dtype=object)
            flat[:] = content
        elif dtype.code in _PLAIN_TYPES and isinstance(content, bytes):
            flat = np.frombuffer(content, dtype=_PLAIN_TYPES[dtype.code])
        else:
            raise ValueError(f"an array of type {dtype.code!r}")
        return flat.reshape(sizes, order="F" if column_major else "C")


class _Dtype(_Kept):
    """numpy.dtype."""

    def __init__(self, code: object = "", *_: object) -> None:
        self.code = code if isinstance(code, str) else ""


class _Index(_Kept):
    """A pandas index; `data` is what it was made from."""

    def __init__(self, _: object = None, parts: Any = None) -> None:
        self.data = parts["data"] if isinstance(parts, dict) and "data" in parts else None


def _array(*_: object) -> _Array:
    return _Array()


_STAND_INS: Final[dict[tuple[str, str], Any]] = {
    ("pandas.core.frame", "DataFrame"): _Frame,
    ("pandas.core.internals.managers", "BlockManager"): _Blocks,
    ("pandas.core.indexes.base", "_new_Index"): _Index,
    ("pandas.core.indexes.base", "Index"): _Kept,
    ("pandas.core.indexes.numeric", "Int64Index"): _Kept,
    ("pandas.core.indexes.range", "RangeIndex"): _Kept,
    ("numpy.core.multiarray", "_reconstruct"): _array,
    ("numpy._core.multiarray", "_reconstruct"): _array,
    ("numpy", "ndarray"): _Kept,
    ("numpy", "dtype"): _Dtype,
}


class _Unpickler(pickle.Unpickler):
    def __init__(self, file: Any, shown: str) -> None:
        super().__init__(file)
        self._shown = shown

    def find_class(self, module: str, name: str) -> Any:
        try:
            return _STAND_INS[module, name]
        except KeyError:
            wanted = f"{module}.{name}"[:_TOLD_CHARACTERS]
            told = f"{self._shown}: the pickle asks for {wanted}, which is refused"
            fix = "use a plain pandas frame, such as the human games of the overcooked-ai package"
            raise GalleyError(f"{told}; {fix}") from None


def read_frame(path: Path) -> dict[str, NDArray[Any]]:
    """The columns of a pickled pandas frame by name, all equally long.

    Raises:
        GalleyError: the file cannot be read, names something else than a frame needs, or is not a frame.
    """
    fix = "use the file as the overcooked-ai package ships it"
    try:
        size = path.stat().st_size
        if size > _LARGEST_FILE_BYTES:
            raise GalleyError(f"{path}: the file has {size} bytes, more than {_LARGEST_FILE_BYTES}; {fix}")
        with path.open("rb") as file:
            frame = _Unpickler(file, str(path)).load()
    except GalleyError:
        raise
    except OSError as error:
        raise GalleyError(f"{path}: cannot be read ({error.strerror or error}); check the path") from None
    except Exception as error:  # a damaged pickle may raise anything
        told = f"{type(error).__name__}: {error}"[:_TOLD_CHARACTERS]
        raise GalleyError(f"{path}: not a whole pickle ({told}); {fix}") from None
    try:
        return _columns(frame)
    except Exception as error:  # what stands where a part of a frame should may be anything
        told = str(error)[:_TOLD_CHARACTERS] or type(error).__name__
        raise GalleyError(f"{path}: not a pickled pandas frame ({told}); {fix}") from None


def _columns(frame: Any) -> dict[str, NDArray[Any]]:
    if not isinstance(frame, _Frame):
        raise TypeError(f"it holds a {type(frame).__name__}")
    blocks = frame.state["_data"] if "_data" in frame.state else frame.state["_mgr"]
    _, arrays, names, *_ = blocks.state
    columns = {}
    for array, index in zip(arrays, names, strict=True):
        for name, values in zip(index.data.values(), array.values(), strict=True):
            if not isinstance(name, str):
                raise TypeError(f"a column is named by a {type(name).__name__}")
            columns[name] = values
    if len({len(values) for values in columns.values()}) != 1:
        raise ValueError("its columns are not equally long")
    return columns
