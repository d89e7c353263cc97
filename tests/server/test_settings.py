"""Settings: one table for options, environment, docs and code."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import pytest

from galley.errors import GalleyError
from galley.server.settings import SETTINGS, Settings, read_settings, settings_table

ROOT = Path(__file__).parents[2]


def test_the_table_has_exactly_the_fields() -> None:
    assert [setting.name for setting in SETTINGS] == [field.name for field in fields(Settings)]


def test_without_anything_the_defaults_hold() -> None:
    assert read_settings({}) == Settings()


def test_an_option_goes_before_the_environment_and_that_before_the_default() -> None:
    environ = {"PORT": "9001", "DATABASE": "sqlite:///a", "HOST": ""}
    settings = read_settings(environ, port=9002, database=None)
    assert (settings.port, settings.database, settings.host) == (9002, "sqlite:///a", "127.0.0.1")


@pytest.mark.parametrize(
    ("environ", "told"),
    [
        ({"PORT": "eighty"}, "PORT: 'eighty' is not possible; use a whole number from 0 to 65535"),
        ({"PORT": "65536"}, "PORT: '65536'"),
        ({"THINK_WINDOW_MS": "-1"}, "THINK_WINDOW_MS: '-1'"),
        ({"REACHED_AT": "http://app:8000"}, "REACHED_AT: 'http://app:8000' is no address; write HOST:PORT"),
        ({"LOG_LEVEL": "loud"}, "LOG_LEVEL: 'loud' is no log level; use one of error, warning, info, debug"),
    ],
)
def test_what_is_not_possible_is_told_with_what_is(environ: dict[str, str], told: str) -> None:
    with pytest.raises(GalleyError) as error:
        read_settings(environ)
    assert str(error.value).startswith(told)


def test_a_wrong_option_is_told_by_its_name() -> None:
    with pytest.raises(GalleyError, match=r"--port: '70000'"):
        read_settings({}, port=70000)
    with pytest.raises(TypeError, match="speed"):
        read_settings({}, speed=1)


def test_the_settings_page_holds_the_table_as_it_is() -> None:
    page = (ROOT / "docs" / "settings.md").read_text(encoding="utf-8")
    assert settings_table() in page, "write the output of settings_table() into docs/settings.md"
