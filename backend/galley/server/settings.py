"""The server's settings: one table for the command line, the environment, docs/settings.md and the code."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from galley.errors import GalleyError
from galley.server.base_path import checked as checked_path

REACHED_AT = re.compile(r"([A-Za-z0-9._-]+|\[[0-9A-Fa-f:.]+\]):[0-9]{1,5}")
ORIGIN = re.compile(r"https?://[A-Za-z0-9.*-]+(:[0-9]{1,5})?")
LOG_LEVELS = ("error", "warning", "info", "debug")


@dataclass(frozen=True, slots=True)
class Setting:
    """A row of the table: field of Settings, environment variable, default, meaning, bounds of a number."""

    name: str
    env: str
    default: str | int
    about: str
    low: int | None = None
    high: int | None = None


def _row(default: Any, env: str, about: str, low: int | None = None, high: int | None = None) -> Any:
    more = {"default": default, "env": env, "about": about, "low": low, "high": high}
    return field(default=default, metadata=more)


@dataclass(frozen=True, slots=True)
class Settings:
    """Everything about a serving process that is not in the workspace."""

    host: str = _row("127.0.0.1", "HOST", "Address to listen on; 0.0.0.0 lets other machines in.")
    port: int = _row(8000, "PORT", "Port to listen on; 0 takes any free one.", 0, 65535)
    database: str = _row("", "DATABASE", "Database URL; empty means SQLite in the workspace.")
    reached_at: str = _row(
        "",
        "REACHED_AT",
        "HOST:PORT at which other replicas reach this one; empty finds it out. SQLite needs none.",
    )
    base_path: str = _row(
        "",
        "BASE_PATH",
        "Sub-path at which a proxy offers the site, such as /kitchen; empty takes `X-Forwarded-Prefix`.",
    )
    framed_by: str = _row(
        "",
        "FRAMED_BY",
        "Origins whose pages may show participants' pages in a frame, with spaces between; empty lets none.",
    )
    study: str = _row("", "STUDY", "The one study to serve; empty serves all of the workspace.")
    think_window_ms: int = _row(
        10, "THINK_WINDOW_MS", "How far apart batches of agents' decisions begin at least, ms.", 0, 50
    )
    max_form_kib: int = _row(
        256,
        "MAX_FORM_KIB",
        "Largest form that is read, KiB; more where questions need it.",
        1,
        10_240,
    )
    messages_per_s: int = _row(
        200,
        "MESSAGES_PER_S",
        "Websocket messages a second that the connections of one visit may keep up.",
        10,
        10_000,
    )
    address_messages_per_s: int = _row(
        2000,
        "ADDRESS_MESSAGES_PER_S",
        "The same for all connections of one address; an IPv6 /64 counts as one.",
        10,
        1_000_000,
    )
    requests_per_s: int = _row(
        300,
        "REQUESTS_PER_S",
        "Requests a second that one address may keep up; more wait their turn. 0 sets no limit.",
        0,
        1_000_000,
    )
    begins_per_min: int = _row(
        240, "BEGINS_PER_MIN", "Visits that one address may begin in a minute; 0 sets no limit.", 0, 1_000_000
    )
    debug: int = _row(0, "DEBUG", "1 checks every message to a browser against the protocol's table.", 0, 1)
    log_level: str = _row("warning", "LOG_LEVEL", "How much is logged: error, warning, info or debug.")


SETTINGS: tuple[Setting, ...] = tuple(Setting(row.name, **row.metadata) for row in fields(Settings))


def read_settings(environ: Mapping[str, str], **options: Any) -> Settings:
    """The settings: an option that is not None goes before the environment, which goes before the default.

    Raises:
        GalleyError: a value is not possible; it names the setting, the value and what it may be.
    """
    if unknown := set(options) - {setting.name for setting in SETTINGS}:
        raise TypeError(f"no such setting: {', '.join(sorted(unknown))}")
    chosen: dict[str, Any] = {}
    for setting in SETTINGS:
        value = options.get(setting.name)
        origin = f"--{setting.name.replace('_', '-')}"
        if value is None and environ.get(setting.env, "") != "":
            value, origin = environ[setting.env], setting.env
        if value is not None:
            chosen[setting.name] = _checked(setting, origin, value)
    return Settings(**chosen)


def _checked(setting: Setting, origin: str, value: Any) -> str | int:
    if setting.low is None or setting.high is None:
        if setting.name == "log_level" and value not in LOG_LEVELS:
            raise GalleyError(f"{origin}: '{value}' is no log level; use one of {', '.join(LOG_LEVELS)}")
        if setting.name == "framed_by" and (
            wrong := [one for one in str(value).split() if not ORIGIN.fullmatch(one)]
        ):
            raise GalleyError(f"{origin}: '{wrong[0]}' is no origin; write such as https://www.mturk.com")
        if setting.name == "base_path":
            return checked_path(str(value))
        if setting.name == "reached_at" and not REACHED_AT.fullmatch(str(value)):
            raise GalleyError(f"{origin}: '{value}' is no address; write HOST:PORT, such as 10.0.0.7:8000")
        return str(value)
    try:
        number = int(value)
    except ValueError:
        number = setting.low - 1
    if not setting.low <= number <= setting.high:
        raise GalleyError(
            f"{origin}: '{value}' is not possible; use a whole number from {setting.low} to {setting.high}"
        )
    return number


def settings_table() -> str:
    """The settings as a Markdown table, for docs/settings.md."""
    lines = ["| option | environment | default | meaning |", "|---|---|---|---|"]
    for setting in SETTINGS:
        shown = "" if setting.default == "" else f"`{setting.default}`"
        lines.append(f"| `{setting.name}` | `{setting.env}` | {shown} | {setting.about} |")
    return "\n".join(lines) + "\n"
