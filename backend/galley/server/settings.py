"""The server's settings: one table for the command line, the environment, docs/settings.md and the code."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from galley.errors import GalleyError


@dataclass(frozen=True, slots=True)
class Setting:
    """One row: field of Settings, environment variable, what it is for, and bounds when it is a number."""

    name: str
    env: str
    about: str
    low: int | None = None
    high: int | None = None


SETTINGS: tuple[Setting, ...] = (
    Setting("host", "HOST", "Address to listen on; 0.0.0.0 lets other machines in."),
    Setting("port", "PORT", "Port to listen on; 0 takes any free one.", 0, 65535),
    Setting("database", "DATABASE", "Database URL; empty means SQLite in the workspace."),
    Setting(
        "reached_at",
        "REACHED_AT",
        "HOST:PORT at which other replicas reach this one; empty finds it out. SQLite needs none.",
    ),
    Setting("study", "STUDY", "The one study to serve; empty serves all of the workspace."),
    Setting(
        "think_window_ms",
        "THINK_WINDOW_MS",
        "How far apart batches of agents' decisions begin at least, ms.",
        0,
        50,
    ),
    Setting("max_form_kib", "MAX_FORM_KIB", "Largest form that is read, KiB.", 1, 10_240),
    Setting(
        "messages_per_s",
        "MESSAGES_PER_S",
        "Websocket messages a second that one connection may keep up.",
        10,
        10_000,
    ),
    Setting("log_level", "LOG_LEVEL", "How much is logged: error, warning, info or debug."),
)
REACHED_AT = re.compile(r"([A-Za-z0-9._-]+|\[[0-9A-Fa-f:.]+\]):[0-9]{1,5}")
LOG_LEVELS = ("error", "warning", "info", "debug")


@dataclass(frozen=True, slots=True)
class Settings:
    """Everything about a serving process that is not in the workspace; see SETTINGS for each."""

    host: str = "127.0.0.1"
    port: int = 8000
    database: str = ""
    reached_at: str = ""
    study: str = ""
    think_window_ms: int = 10
    max_form_kib: int = 256
    messages_per_s: int = 200
    log_level: str = "warning"


def read_settings(environ: Mapping[str, str], **options: Any) -> Settings:
    """The settings: an option that is not None goes before the environment, which goes before the default.

    Raises: GalleyError naming the setting, its value and what it may be.
    """
    known = {field.name for field in fields(Settings)}
    if unknown := set(options) - known:
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
    defaults = Settings()
    lines = ["| option | environment | default | meaning |", "|---|---|---|---|"]
    for setting in SETTINGS:
        default = getattr(defaults, setting.name)
        shown = "" if default == "" else f"`{default}`"
        lines.append(f"| `{setting.name}` | `{setting.env}` | {shown} | {setting.about} |")
    return "\n".join(lines) + "\n"
