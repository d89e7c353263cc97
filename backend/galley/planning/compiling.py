"""How the kernels of planning are compiled and kept."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from numba import njit

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(function: Function) -> Function:
    """The function compiled by Numba, kept on disk until a kernel that it may call changes.

    Numba's cache looks at the file of the function alone. Ours call each other and the kitchen's rules across
    files, so what was compiled counts as outdated when any file of kitchen or planning was written since.
    """
    compiled: Any = njit(cache=True)(function)
    files = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
    if files is not None:  # absent with NUMBA_DISABLE_JIT=1
        files._source_stamp = (files._source_stamp, _written())
    found: Function = compiled
    return found


@functools.cache
def _written() -> tuple[tuple[str, int, int], ...]:
    """Name, time of writing and size of each source file of kitchen and planning."""
    here = Path(__file__).parent
    files = sorted([*here.glob("*kernel.py"), *(here.parent / "kitchen").glob("*.py")])
    return tuple((file.name, file.stat().st_mtime_ns, file.stat().st_size) for file in files)
