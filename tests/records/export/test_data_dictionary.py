"""The data dictionary says what the code does."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from galley.records.database.tables import METADATA
from galley.records.export.columns import SHEETS
from galley.records.export.data_dictionary import dictionary_csv, dictionary_markdown
from galley.records.export.human_data import HUMAN_DATA

PAGE = Path(__file__).resolve().parents[3] / "docs" / "data-dictionary.md"


def test_the_page_in_the_docs_is_up_to_date() -> None:
    how = "run: python -m galley.records.export.data_dictionary > docs/data-dictionary.md"
    assert PAGE.read_text(encoding="utf-8") == dictionary_markdown(), how


def test_every_column_of_the_database_has_a_meaning() -> None:
    for table in METADATA.sorted_tables:
        assert table.info["meaning"], table.name
        for column in table.columns:
            assert column.doc, f"{table.name}.{column.name}"


def test_every_exported_column_is_explained_once() -> None:
    rows = list(csv.reader(io.StringIO(dictionary_csv()), strict=True))
    assert rows[0] == ["file", "column", "kind", "meaning"]
    assert [tuple(row) for row in rows[1:]] == [
        (sheet.file, field.name, field.kind, field.meaning)
        for sheet in (*SHEETS, HUMAN_DATA)
        for field in (*sheet.fields, *sheet.patterns)
    ]
    for sheet in (*SHEETS, HUMAN_DATA):
        names = [field.name for field in sheet.fields]
        assert len(names) == len(set(names)), sheet.file
        assert "token" not in names
        assert f"## {sheet.file}" in dictionary_markdown()
