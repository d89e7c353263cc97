"""`galley researchers`: the accounts of the researcher's pages, made where the server is administered."""

from __future__ import annotations

import subprocess
from pathlib import Path

from galley.records import Store
from galley.records.store.researcher_accounts import Researchers
from galley.server.researcher.passwords import Passwords
from tests.serving import START


def run(database: Path, *words: str, said: str = "") -> subprocess.CompletedProcess[str]:
    command = [*START, "researchers", *words, "--database", str(database)]
    return subprocess.run(command, input=said, capture_output=True, text=True, timeout=240, check=False)


def test_an_account_is_made_changed_and_removed(tmp_path: Path) -> None:
    database = tmp_path / "records.sqlite"
    assert "was added" in run(database, "add", " ada ", said="correct horse battery\n").stdout
    assert "has a new password" in run(database, "add", "ada", said="another good one\n").stdout
    with Store.open(database) as store:
        (account,) = Researchers(store).all().result()
    assert account.name == "ada"
    assert account.password_hash.startswith("$argon2id$")
    assert Passwords().right("another good one", account.password_hash)
    assert not Passwords().right("correct horse battery", account.password_hash)
    assert run(database, "list").stdout == "ada\n"
    wrong = run(database, "remove", "adda")
    assert (wrong.returncode, wrong.stderr.count("\n")) == (1, 1)
    assert "did you mean 'ada'" in wrong.stderr
    assert run(database, "remove", "ada").returncode == 0
    assert run(database, "list").stdout == ""


def test_a_poor_password_or_name_is_refused_in_one_line(tmp_path: Path) -> None:
    for words, said in (
        (["add", "ada"], "short\n"),
        (["add", "ada"], ""),
        (["add", "  "], "correct horse battery\n"),
    ):
        refused = run(tmp_path / "records.sqlite", *words, said=said)
        assert (refused.returncode, refused.stderr.count("\n")) == (1, 1)
        assert "characters" in refused.stderr
    assert not (tmp_path / "records.sqlite").exists()
