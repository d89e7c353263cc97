"""CSV files: RFC 4180, safe in a spreadsheet, whole or not there."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from galley.records.export.columns import Field, Sheet
from galley.records.export.csv_file import FORMULA_STARTS, CsvFile, cell, guarded, utc

SHEET = Sheet("notes", "Notes.", "none", (Field("who", "text", "who"), Field("at", "time", "when")))


def read(path: Path) -> list[list[str]]:
    return list(csv.reader(io.StringIO(path.read_bytes().decode("utf-8"), newline=""), strict=True))


def test_a_file_is_rfc_4180_in_utf_8(tmp_path: Path) -> None:
    with CsvFile(tmp_path, SHEET) as file:
        file.write({"who": 'said "yes, chef"\nand left', "at": 1_760_000_000_001})
        file.write({"who": "厨师", "at": None, "more": "is not in the sheet"})
    assert (tmp_path / "notes.csv").read_bytes() == (
        b'who,at\r\n"said ""yes, chef""\nand left",2025-10-09T08:53:20.001Z\r\n' + "厨师,\r\n".encode()
    )


def test_a_file_that_fails_on_the_way_is_not_there(tmp_path: Path) -> None:
    (tmp_path / "notes.csv").write_text("from before")

    def fail() -> None:
        with CsvFile(tmp_path, SHEET) as file:
            file.write({"who": "a", "at": None})
            file.write({"who": "b"})

    with pytest.raises(KeyError):
        fail()
    assert [path.name for path in tmp_path.iterdir()] == ["notes.csv"]
    assert (tmp_path / "notes.csv").read_text() == "from before"


@given(st.text())
def test_any_text_comes_back(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    folder = tmp_path_factory.mktemp("csv")
    with CsvFile(folder, SHEET) as file:
        file.write({"who": text, "at": None})
    stored = read(folder / "notes.csv")[1][0]
    assert not stored.startswith(tuple(start for start in FORMULA_STARTS if start != "'"))
    assert stored.removeprefix("'") == text


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "\n=1", "'=1", "＝1"])
def test_what_a_spreadsheet_would_run_is_guarded(text: str) -> None:
    assert guarded(text) == f"'{text}"
    assert cell("text", text) == f"'{text}"


@pytest.mark.parametrize("text", ["", "5", "a=1", " =1", "é"])
def test_other_texts_stay_as_they_are(text: str) -> None:
    assert guarded(text) == text


@pytest.mark.parametrize(
    ("kind", "value", "written"),
    [
        ("text", -5, "-5"),
        ("text", 0.1, "0.1"),
        ("whole number", -3, "-3"),
        ("number", -0.5, "-0.5"),
        ("number", 1 / 3, "0.333333333333333"),
        ("number", 1_760_000_000_123.25, "1760000000123.25"),
        ("true/false", 0, "false"),
        ("true/false", True, "true"),
        ("JSON", {"b": "é", "a": 1}, '{"a": 1, "b": "é"}'),
        ("number", None, ""),
        ("true/false", None, ""),
    ],
)
def test_cells(kind: str, value: object, written: str) -> None:
    assert cell(kind, value) == written  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("ms", "written"),
    [
        (0, "1970-01-01T00:00:00.000Z"),
        (999.6, "1970-01-01T00:00:01.000Z"),
        (1_709_164_799_999, "2024-02-28T23:59:59.999Z"),
    ],
)
def test_times_are_iso_8601_in_utc(ms: float, written: str) -> None:
    assert utc(ms) == written


def test_a_lone_surrogate_is_spelt_out(tmp_path: Path) -> None:
    with CsvFile(tmp_path, SHEET) as file:
        file.write({"who": "a\ud800b", "at": None})
    assert read(tmp_path / "notes.csv")[1][0] == r"a\ud800b"
