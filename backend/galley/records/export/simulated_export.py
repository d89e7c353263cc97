"""An export of people who are not there, to write an analysis with before anybody comes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import Connection, select, update

from galley.errors import GalleyError
from galley.files.whole import whole_folder
from galley.records.database.tables import VISITS
from galley.records.export.whole_export import Wanted, write_files
from galley.records.reading.flags import SIMULATED
from galley.records.store.store import Store


@contextmanager
def new_folder(out: Path) -> Iterator[Path]:
    """A folder to fill that is at `out` when the block ends, and nowhere after an error.

    Raises:
        GalleyError: there is something at `out` already, or nothing can be put there.
    """
    if out.exists() and not (out.is_dir() and not any(out.iterdir())):
        raise GalleyError(f"{out}: is not empty; name a new folder with --out")
    try:
        with whole_folder(out.resolve()) as folder:
            yield folder
    except OSError as error:
        raise GalleyError(f"{out}: {error.strerror or error}; name another folder with --out") from None


def write_simulated(database: Path, study: str, folder: Path, command: str) -> dict[str, str]:
    """What was written to a folder from the records that a command simulated, by the names of files.

    Every participant's name begins with SIMULATED, in every file, and every visit carries the flag; the data
    dictionary says first that nobody was there.

    Raises:
        GalleyError: nobody began a visit, or the folder cannot be written.
    """
    notice = (
        f"> **Simulated.** Nobody took part: `{command}` made these records. Answers, keys and times\n"
        f"> are a program's; each name in `participant` begins with `{SIMULATED}`.\n"
    )
    with Store.open(database, must_exist=True) as store:
        store.write(_rename).result()
        written = write_files(store, study, folder, Wanted(), notice)
    return {file.name: count for file, count in written.items()}


def _rename(connection: Connection) -> None:
    for visit_id, number in connection.execute(select(VISITS.c.id, VISITS.c.visit_no)).all():
        name = f"{SIMULATED}{number + 1:04}"
        connection.execute(update(VISITS).where(VISITS.c.id == visit_id).values(participant=name))
