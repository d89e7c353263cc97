"""CSV as RFC 4180 describes it: UTF-8, CRLF, one header line; safe to open in a spreadsheet."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Any

from galley.records.export.columns import Kind, Sheet
from galley.records.export.sheet_file import PartFile

# Spreadsheets take a cell that begins so for a formula. Source: OWASP, "CSV Injection".
# The apostrophe is among them so that a guarded text is always told from one that began with it.
FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r", "\n", "'", "\uff1d", "\uff0b", "\uff0d", "\uff20")


def guarded(text: str) -> str:
    """`text` with an apostrophe in front if a spreadsheet could run it; taking one away gives `text` back."""
    return f"'{text}" if text.startswith(FORMULA_STARTS) else text


def utc(ms: float) -> str:
    """A time in milliseconds since 1970 as ISO 8601 in UTC, to the millisecond."""
    seconds, rest = divmod(round(ms), 1000)
    return f"{datetime.fromtimestamp(seconds, UTC):%Y-%m-%dT%H:%M:%S}.{rest:03d}Z"


def cell(kind: Kind, value: Any) -> str:
    """What stands in a cell for `value`; nothing at all for None."""
    if value is None:
        return ""
    match kind:
        case "text":
            return guarded(value) if isinstance(value, str) else str(value)
        case "whole number":
            return str(int(value))
        case "number":
            return format(float(value), ".15g")
        case "true/false":
            return "true" if value else "false"
        case "time":
            return utc(value)
        case "JSON":
            return guarded(json.dumps(value, ensure_ascii=False, sort_keys=True))


class CsvFile(PartFile):
    """One file of an export as CSV."""

    ending = "csv"

    def __init__(self, folder: Path, sheet: Sheet) -> None:
        super().__init__(folder, sheet)
        # A lone surrogate cannot be UTF-8; it is spelt out rather than losing the export.
        self._file: IO[str] = self.part.open("w", encoding="utf-8", errors="backslashreplace", newline="")
        self._csv = csv.writer(self._file, lineterminator="\r\n")
        self._csv.writerow([guarded(field.name) for field in sheet.fields])

    def write(self, values: Mapping[str, Any]) -> None:
        """Add a row: a value, or None, for every column.

        Raises:
            KeyError: a column left out.
        """
        self._csv.writerow([cell(field.kind, values[field.name]) for field in self.sheet.fields])
        self.rows += 1

    def close(self) -> None:
        """Write what is left and let the file go."""
        self._file.close()
