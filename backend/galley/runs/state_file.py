"""How the states of runs are kept in files: what a run folder needs of a format, and the one of NumPy."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.files.whole import whole_file


class StateFormat(Protocol):
    """A kind of file for nested dicts and lists of numbers, texts and arrays."""

    ending: str

    def write(self, path: Path, content: Mapping[str, Any]) -> None:
        """Write `content` to `path`, whole or not at all."""

    def read(self, path: Path) -> dict[str, Any]:
        """What was written to `path`; no code in the file is run.

        Raises:
            GalleyError: the file is missing or damaged.
        """


class NumpyStates:
    """`.npz`: JSON as the array `tree`, in which `{"array": N}` stands for the file's array N."""

    ending = ".npz"

    def write(self, path: Path, content: Mapping[str, Any]) -> None:
        """Write `content`, whose keys are texts, to `path`, whole or not at all; tuples become lists."""
        arrays: dict[str, NDArray[Any]] = {}

        def kept(value: Any) -> Any:
            if not isinstance(value, np.ndarray):
                return value.item()
            name = str(len(arrays))
            arrays[name] = value
            return {_ARRAY: name}

        tree = np.array(json.dumps(content, default=kept))
        with whole_file(path) as file:
            np.savez(file, tree=tree, **arrays)  # type: ignore[arg-type]

    def read(self, path: Path) -> dict[str, Any]:
        """What was written to `path`; no code in the file is run.

        Raises:
            GalleyError: the file is missing or damaged.
        """
        try:
            with path.open("rb") as opened, np.load(opened, allow_pickle=False) as file:

                def found(value: dict[str, Any]) -> Any:
                    return file[value[_ARRAY]] if value.keys() == {_ARRAY} else value

                content: dict[str, Any] = json.loads(str(file["tree"]), object_hook=found)
                return content
        except FileNotFoundError:
            raise GalleyError(f"{path}: there is no such file") from None
        except (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile) as error:
            raise unreadable(path, error) from None


def unreadable(path: Path, error: Exception) -> GalleyError:
    """The error to raise for a damaged file of a run."""
    told = (str(error).splitlines() or [type(error).__name__])[0]
    return GalleyError(f"{path}: cannot be read ({told}); remove the run's folder to start anew")


_ARRAY: Final = "array"
