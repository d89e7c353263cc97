"""The data dictionary: what every exported column and every column of the database means.

The page in the docs is its output:
`python -m galley.records.export.data_dictionary > docs/data-dictionary.md`
"""

from __future__ import annotations

import csv
import io
import sys
from collections.abc import Iterator

from galley.records.database.tables import METADATA
from galley.records.export.columns import SHEETS
from galley.records.export.human_data import HUMAN_DATA

_INTRO = """# Data dictionary

`galley export STUDY --out DIR` writes the files below; this page is generated from the table of columns that
the export itself uses, and travels with every export. Participants are named by an identifier made by the
server; the secret of their link is never exported.

- CSV as in RFC 4180: comma, double quotes where needed, CRLF; UTF-8 without byte order mark; one header line.
- Rows come in the order given, so two exports of the same records are equal byte for byte.
- An empty cell is a missing value. `true` and `false` are written out.
- Times are ISO 8601 in UTC by the server's clock, to the millisecond.
- **Guard against formulas.** A spreadsheet would run a text that begins with `=`, `+`, `-`, `@`, a tab or a
  line break. Texts that begin so, or with an apostrophe, have one apostrophe `'` put in front: take the
  first apostrophe away to get the text as it was given. In R: `sub("^'", "", x)`; in pandas:
  `x.str.replace(r"^'", "", regex=True)`. Numbers and times are never changed.
- JSON Lines (`--format jsonl`) and Parquet (`--format parquet`) hold the same rows under the same names,
  without the guard: JSON values stay JSON in JSON Lines and are text in Parquet, where times are timestamps.
- A person's own words, link parameters and notes about them are in the files as they are: treat them as such.
- Visits made to try a study out are left out unless `--tests` is given.
- A tick is counted from 0: row `tick` holds the joint action taken in that tick. `round_id` joins rounds,
  ticks, events, keys, pauses and clocks; `participant` joins everything.
"""

_TABLES = """
# The database

The export reads these tables; each round can be replayed from `rounds.layout_json` and `ticks` alone.
Times ending in `_ms` are milliseconds since 1970-01-01 UTC by the server's clock, unless said otherwise.
"""


def dictionary_markdown(notice: str = "") -> str:
    """The data dictionary as Markdown: a notice under its title, every exported file, then every table."""
    title, _, rest = _INTRO.partition("\n\n")
    intro = "\n\n".join([title, notice, rest]) if notice else _INTRO
    return "\n".join([intro, *_sheets(), _TABLES, *_tables()])


def dictionary_csv() -> str:
    """The exported files' columns as CSV: file, column, kind, meaning."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerow(["file", "column", "kind", "meaning"])
    for sheet in (*SHEETS, HUMAN_DATA):
        writer.writerows(
            [sheet.file, field.name, field.kind, field.meaning] for field in (*sheet.fields, *sheet.patterns)
        )
    return out.getvalue()


def _sheets() -> Iterator[str]:
    for sheet in (*SHEETS, HUMAN_DATA):
        yield f"## {sheet.file}\n\n{sheet.about} Order: {sheet.order}.\n"
        yield "| column | kind | meaning |\n|---|---|---|"
        columns = (*sheet.fields, *sheet.patterns)
        yield from (_line(field.name, field.kind, field.meaning) for field in columns)
        yield ""


def _tables() -> Iterator[str]:
    for table in METADATA.sorted_tables:
        yield f"## {table.name}\n\n{table.info['meaning'].capitalize()}.\n"
        yield "| column | type | meaning |\n|---|---|---|"
        for column in table.columns:
            kind = str(column.type).lower() + (", may be empty" if column.nullable else "")
            yield _line(column.name, kind, str(column.doc))
        yield ""


def _line(name: str, kind: str, meaning: str) -> str:
    return f"| `{name}` | {kind} | {meaning.replace('|', chr(92) + '|')} |"


if __name__ == "__main__":
    sys.stdout.write(dictionary_markdown())
