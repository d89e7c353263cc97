"""A file of an export that appears under its name only when it is whole."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, ClassVar, Self

from galley.files.whole import whole_path
from galley.records.export.columns import Sheet


class PartFile(ABC):
    """Written under another name first, so that a run that fails leaves no half of a file behind."""

    ending: ClassVar[str]

    def __init__(self, folder: Path, sheet: Sheet) -> None:
        self.sheet = sheet
        self.rows = 0
        self.path = folder / f"{sheet.name}.{self.ending}"
        self._whole = whole_path(self.path)
        self.part = self._whole.__enter__()

    @abstractmethod
    def write(self, values: Mapping[str, Any]) -> None:
        """Add a row: a value, or None, for every column.

        Raises:
            KeyError: a column left out.
        """

    @abstractmethod
    def close(self) -> None:
        """Write what is left and let the file go."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
        self._whole.__exit__(kind, error, trace)
