"""Parquet: typed columns, times as UTC timestamps; needs the extra `parquet`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from galley.errors import GalleyError
from galley.records.export.columns import Kind, Sheet
from galley.records.export.sheet_file import PartFile

ROWS_A_GROUP = 20_000
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def _arrow() -> Any:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise GalleyError("Parquet files need a library; pip install 'galley[parquet]'") from None
    return pyarrow


class ParquetFile(PartFile):
    """One file of an export as Parquet.

    Raises:
        GalleyError: PyArrow is not installed.
    """

    ending = "parquet"

    def __init__(self, folder: Path, sheet: Sheet) -> None:
        super().__init__(folder, sheet)
        self._arrow = arrow = _arrow()
        kinds: dict[Kind, Any] = {
            "text": arrow.string(),
            "whole number": arrow.int64(),
            "number": arrow.float64(),
            "true/false": arrow.bool_(),
            "time": arrow.timestamp("ms", tz="UTC"),
            "JSON": arrow.string(),
        }
        self._schema = arrow.schema(
            [arrow.field(f.name, kinds[f.kind], metadata={"meaning": f.meaning}) for f in sheet.fields]
        )
        self._file = arrow.parquet.ParquetWriter(self.part, self._schema, compression="zstd")
        self._columns: list[list[Any]] = [[] for _ in sheet.fields]

    def write(self, values: Mapping[str, Any]) -> None:
        """Add a row: a value, or None, for every column.

        Raises:
            KeyError: a column left out.
        """
        for column, field in zip(self._columns, self.sheet.fields, strict=True):
            column.append(_typed(field.kind, values[field.name]))
        self.rows += 1
        if len(self._columns[0]) >= ROWS_A_GROUP:
            self._write_group()

    def close(self) -> None:
        """Write what waits."""
        self._write_group()
        self._file.close()

    def _write_group(self) -> None:
        if self._columns[0]:
            self._file.write_table(self._arrow.table(self._columns, schema=self._schema))
            self._columns = [[] for _ in self.sheet.fields]


def _typed(kind: Kind, value: Any) -> Any:
    if value is None:
        return None
    match kind:
        case "text":
            # A lone surrogate cannot be UTF-8; it is spelt out as in the other formats.
            return str(value).encode("utf-8", "backslashreplace").decode("utf-8")
        case "whole number":
            return int(value)
        case "number":
            return float(value)
        case "true/false":
            return bool(value)
        case "time":
            return _EPOCH + timedelta(milliseconds=round(value))
        case "JSON":
            return json.dumps(value, ensure_ascii=True, sort_keys=True)
