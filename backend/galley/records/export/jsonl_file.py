"""JSON Lines: one object a line, UTF-8, LF; values keep their kind, nothing is guarded or cut."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from galley.records.export.columns import Kind, Sheet
from galley.records.export.csv_file import utc
from galley.records.export.sheet_file import PartFile


def plain(kind: Kind, value: Any) -> Any:
    """`value` as JSON has it; times are ISO 8601 text."""
    if value is None:
        return None
    match kind:
        case "whole number":
            return int(value)
        case "number":
            return float(value)
        case "true/false":
            return bool(value)
        case "time":
            return utc(value)
    return value


class JsonLinesFile(PartFile):
    """One file of an export as JSON Lines."""

    ending = "jsonl"

    def __init__(self, folder: Path, sheet: Sheet) -> None:
        super().__init__(folder, sheet)
        self._file = self.part.open("w", encoding="utf-8", errors="backslashreplace", newline="")

    def write(self, values: Mapping[str, Any]) -> None:
        """Add a row: a value, or None, for every column.

        Raises:
            KeyError: a column left out.
        """
        row = {field.name: plain(field.kind, values[field.name]) for field in self.sheet.fields}
        json.dump(row, self._file, ensure_ascii=False, separators=(",", ":"))
        self._file.write("\n")
        self.rows += 1

    def close(self) -> None:
        """Write what is left and let the file go."""
        self._file.close()
