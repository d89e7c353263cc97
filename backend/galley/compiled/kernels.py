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
    return _compiled(function, counted=True)


def lean_kernel(function: Function) -> Function:
    """As `kernel`, for a function that makes no arrays.

    Then nobody has to count who still holds the arrays that it is given. To count them for each of
    a brain's twenty arrays at each call, atomically, took three quarters of a plan.
    """
    return _compiled(function, counted=False)


def _compiled(function: Function, counted: bool) -> Function:
    compile_it: Any = njit  # `_nrt`, whether holders are counted, is not in its annotations
    compiled: Any = compile_it(cache=True, _nrt=counted)(function)
    files = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
    if files is not None:  # absent with NUMBA_DISABLE_JIT=1
        files._source_stamp = (files._source_stamp, _written())
    found: Function = compiled
    return found


@functools.cache
def _written() -> tuple[tuple[str, int, int], ...]:
    """Name, time of writing and size of each source file of kitchen and planning."""
    here = Path(__file__).parent
    files = sorted([*here.glob("*kernel.py"), Path(__file__), *(here.parent / "kitchen").glob("*.py")])
    return tuple((file.name, file.stat().st_mtime_ns, file.stat().st_size) for file in files)
