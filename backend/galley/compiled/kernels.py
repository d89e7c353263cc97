"""One way to compile a function, a kernel, and to keep it on disk until anything it is made of changes."""

from __future__ import annotations

import functools
import hashlib
import os
import re
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from numba import config, njit
from numba.core.caching import InTreeCacheLocator, UserProvidedCacheLocator, UserWideCacheLocator

from galley.errors import GalleyError

Function = TypeVar("Function", bound=Callable[..., Any])

_SOURCES = Path(__file__).resolve().parents[2]
_COMMENT = re.compile(r"#.*")
_IMPORT = re.compile(
    r"^[ \t]*(?:from[ \t]+(galley[.\w]*)[ \t]+import[ \t]+(\([^)]*\)|.*)|import[ \t]+(galley[.\w]*))",
    re.MULTILINE,
)


def kernel(function: Function) -> Function:
    """The function compiled by Numba, kept on disk: see `KernelLocator` for where and for how long."""
    return _compiled(function, _nrt=True)


def lean_kernel(function: Function) -> Function:
    """As `kernel`, for a function that makes no arrays.

    Then nobody has to count who still holds the arrays that it is given. To count them for each of
    a brain's twenty arrays at each call, atomically, took three quarters of a plan. Numba has no public name
    for this option of `njit`, only `_nrt` (the example of its `register_jitable` has it). Whoever is called
    by a lean kernel inherits it unless it says otherwise, as `kernel` does.
    """
    return _compiled(function, _nrt=False)


def numeric_kernel(function: Function) -> Function:
    """As `kernel`, for sums whose order does not matter, run beside other threads of Python."""
    return _compiled(function, _nrt=True, fastmath=True, nogil=True)


def _compiled(function: Function, **options: bool) -> Function:
    compile_it: Any = njit  # `_nrt` is not in its annotations
    with _found_by_kernel_locator():
        compiled: Function = compile_it(cache=True, **options)(function)
    return compiled


class KernelLocator:
    """Where a kernel is kept and what it was made of: a cache locator, as Numba's notes on caching have it.

    Numba looks for a kernel in the folder of `NUMBA_CACHE_DIR`, beside its module, then in the user's cache;
    we then in a temporary folder of our own, for an account without a home. It counts what it finds as
    outdated when the kernel's own file has changed. Ours call each other across files and take in constants
    from others, so here it is outdated when the content of its module has changed or that of a module of ours
    which that imports, in one or more steps. When a file was written does not matter.
    """

    def __init__(self, function: Callable[..., Any], file: str, folder: str) -> None:
        self._line = function.__code__.co_firstlineno
        self._py_file = file  # Numba names it in its warnings
        self._folder = folder

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> KernelLocator:
        """The locator of a function in a file.

        Raises:
            GalleyError: there is no folder that can be written.
        """
        tried: list[Any] = [UserProvidedCacheLocator, InTreeCacheLocator]
        if "XDG_CACHE_HOME" in os.environ or Path(os.environ.get("HOME", "/")).is_absolute():
            tried.append(UserWideCacheLocator)  # would make a folder named ~ here otherwise
        for locator in tried:
            if found := locator.from_function(function, file):
                return cls(function, file, found.get_cache_path())
        return cls(function, file, _temporary_folder(file))

    def ensure_cache_path(self) -> None:
        """Make the folder."""
        Path(self._folder).mkdir(parents=True, exist_ok=True)

    def get_cache_path(self) -> str:
        """The folder of the kernel."""
        return self._folder

    def get_source_stamp(self) -> str:
        """A hash of all that the kernel is made of."""
        return _stamp(Path(self._py_file).resolve())

    def get_disambiguator(self) -> str:
        """What tells kernels of one name in one file apart."""
        return str(self._line)


@contextmanager
def _found_by_kernel_locator() -> Iterator[None]:
    """A moment in which Numba asks our locator: its setting of locators is for all functions of a process."""
    settings: Any = config
    before = settings.CACHE_LOCATOR_CLASSES
    settings.CACHE_LOCATOR_CLASSES = f"{__name__}.{KernelLocator.__name__}"
    try:
        yield
    finally:
        settings.CACHE_LOCATOR_CLASSES = before


def _temporary_folder(file: str) -> str:
    """A folder for the kernels of a file that nobody else could have put code into."""
    try:
        ours = Path(tempfile.gettempdir()) / f"galley-kernels-{os.getuid()}"
        ours.mkdir(mode=0o700, exist_ok=True)
        status = ours.lstat()
        if status.st_uid != os.getuid() or status.st_mode & 0o022:
            raise PermissionError(f"{ours} is writable by others")
        folder = ours / hashlib.sha256(file.encode()).hexdigest()
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise GalleyError(
            f"compiled code cannot be kept ({error}); set NUMBA_CACHE_DIR to a folder that can be written"
        ) from None
    return str(folder)


@functools.cache
def _stamp(file: Path) -> str:
    """A hash of the contents of a module and of all modules of ours that it imports, in one or more steps."""
    found: dict[Path, str] = {}
    ahead = [file]
    while ahead:
        module = ahead.pop()
        if module not in found:
            content, imported = _read(module)
            found[module] = content
            ahead += imported
    return hashlib.sha256("".join(sorted(found.values())).encode()).hexdigest()


@functools.cache
def _read(file: Path) -> tuple[str, tuple[Path, ...]]:
    """(hash of a module's content, the modules of ours that it imports)."""
    source = file.read_text(encoding="utf-8")
    imported = []
    for module, names, alone in _IMPORT.findall(_COMMENT.sub("", source)):
        package = _SOURCES / (module or alone).replace(".", "/")
        submodules = [package / f"{name}.py" for name in re.findall(r"\w+", names)]
        modules = [path for path in submodules if path.exists()]
        imported += modules or [
            path for path in (package.with_suffix(".py"), package / "__init__.py") if path.exists()
        ]
    return hashlib.sha256(source.encode()).hexdigest(), tuple(imported)
