"""Serves until told to stop: the socket, the records and the application, opened and closed in order."""

from __future__ import annotations

import logging
import os
import signal
import socket
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette

from galley.errors import GalleyError
from galley.files.scratch import Scratch
from galley.records import Store
from galley.records.reading.overdue import under_way
from galley.records.store.erase import finish_erasures
from galley.server.app import create_app
from galley.server.changed_files import kept_by, told_of_changes
from galley.server.content import load_content
from galley.server.logs import log_to
from galley.server.request_bounds import BoundedHttp
from galley.server.settings import Settings, read_settings
from galley.server.socket_bounds import BoundedWebSocket
from galley.workspace import Workspace

LOG = logging.getLogger(__name__)
MAX_FRAME_BYTES = 256 * 1024
PING_EVERY_S = 5.0
PING_WITHIN_S = 10.0
SHUTDOWN_WITHIN_S = 5
SWITCH_INTERVAL_S = 0.0005
BACKLOG = 1024


def serve(
    workspace: Path,
    *,
    study: str | None = None,
    host: str | None = None,
    port: int | None = None,
    database: str | None = None,
    debug: bool | None = None,
    environ: Mapping[str, str] | None = None,
) -> None:
    """Serve a workspace until SIGINT or SIGTERM; prints its URL and each study's once it listens.

    Options that are None come from the environment, see `galley.server.settings`.

    Raises:
        GalleyError: the port is taken, the database cannot be opened or served, or a study cannot be used.
    """
    settings = read_settings(
        os.environ if environ is None else environ,
        study=study,
        host=host,
        port=port,
        database=database,
        debug=debug,
    )
    place = Workspace(workspace)
    _end(_serve(place, settings, settings.database or place.database, preview=False))


def preview(
    workspace: Path,
    *,
    study: str,
    host: str | None = None,
    port: int | None = None,
    environ: Mapping[str, str] | None = None,
) -> None:
    """Serve one study as `serve` does, to walk through it: what is recorded is gone at the end.

    Raises:
        GalleyError: as `serve`.
    """
    settings = read_settings(os.environ if environ is None else environ, study=study, host=host, port=port)
    with Scratch("galley-preview-") as folder:
        database = str(folder / "preview.sqlite")
        ended = _serve(Workspace(workspace), replace(settings, database=database), database, preview=True)
    _end(ended)


def _serve(workspace: Workspace, settings: Settings, database: str, *, preview: bool) -> bool:
    """Serve until stopped; whether every agent stopped too."""
    listening = listen(settings)
    log = log_to(sys.stderr, settings.log_level)
    try:
        with Store.open(database, serving=True) as store:
            finish_what_was_begun(store)
            known = replace(
                settings, reached_at=settings.reached_at or reached_at(listening, store.engine.url)
            )
            content = load_content(workspace, known.study)
            has = kept_by(content.layouts, content.agents)
            told = told_of_changes(store.read(under_way).result(), content.studies, has)
            for line in told:
                LOG.warning(line)
            app = create_app(content, store, known, preview=preview)
            # A thread that wants the interpreter gets it sooner: a tick waits less for an agent that thinks
            # in Python.
            sys.setswitchinterval(SWITCH_INTERVAL_S)
            # After its own shutdown uvicorn raises the signal again; the records must be closed then too.
            signal.signal(signal.SIGTERM, signal.default_int_handler)
            try:
                config = server_config(app, settings)
                names = (settings.study,) if settings.study else workspace.names("studies")
                Announcing(config, settings, listening, names).run(sockets=[listening])
            except KeyboardInterrupt:
                pass
            return bool(getattr(app.state, "all_ended", True))
    finally:
        listening.close()
        logging.getLogger().removeHandler(log)
        log.close()


def finish_what_was_begun(store: Store) -> None:
    """Finish erasures that were interrupted; where somebody reads the old pages, the next start does."""
    try:
        finished = finish_erasures(store)
    except GalleyError as error:
        LOG.warning("an erasure that was interrupted could not be finished: %s", error)
        return
    if finished:
        LOG.warning("finished erasures that were interrupted: %d", finished)


def _end(all_ended: bool) -> None:
    """End the process at once when an agent still runs, in code that knows nothing of Python's end."""
    if not all_ended:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(0)


def server_config(app: Starlette, settings: Settings) -> uvicorn.Config:
    """How uvicorn runs the application: small uncompressed frames, dead connections found within seconds."""
    return uvicorn.Config(
        app,
        loop="auto",
        http=BoundedHttp,
        lifespan="on",
        ws=BoundedWebSocket,
        ws_max_size=MAX_FRAME_BYTES,
        ws_per_message_deflate=False,
        ws_ping_interval=PING_EVERY_S,
        ws_ping_timeout=PING_WITHIN_S,
        access_log=False,
        log_config=None,
        log_level=settings.log_level,
        server_header=False,
        timeout_graceful_shutdown=SHUTDOWN_WITHIN_S,
    )


class Announcing(uvicorn.Server):
    """A server that says where it is as soon as it can be reached."""

    def __init__(
        self, config: uvicorn.Config, settings: Settings, listening: socket.socket, studies: Sequence[str]
    ) -> None:
        super().__init__(config)
        self._settings = settings
        self._studies = studies
        self._port = listening.getsockname()[1]

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start, then print the URLs."""
        await super().startup(sockets)
        if self.started:
            host = self._settings.host
            anywhere = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # noqa: S104
            reached = anywhere.get(host, host)
            shown = f"[{reached}]" if ":" in reached else reached
            root = f"http://{shown}:{self._port}{self._settings.base_path}"
            # Each study's own link: what people are sent begins there, not at the root.
            links = [f"{root}/s/{name}" for name in self._studies]
            sys.stdout.write("".join(f"{url}\n" for url in (root, *links)))
            sys.stdout.flush()


def reached_at(listening: socket.socket, database: Any) -> str:
    """HOST:PORT at which other processes on the same database reach this one; "" if there are none.

    `database` is its URL. Who listens on every address is reached at the one that leads to the database.
    """
    if database.get_backend_name() == "sqlite":
        return ""
    host, port = listening.getsockname()[:2]
    if host in ("0.0.0.0", "::"):  # noqa: S104
        host = _own_address(database.host or "127.0.0.1", database.port or 5432)
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def _own_address(other: str, port: int) -> str:
    """This machine's address on the way to another host; no packet is sent."""
    try:
        family, kind, proto, _, there = socket.getaddrinfo(other, port, type=socket.SOCK_DGRAM)[0]
        with socket.socket(family, kind, proto) as probe:
            probe.connect(there)
            return str(probe.getsockname()[0])
    except OSError:
        return "127.0.0.1"


def listen(settings: Settings) -> socket.socket:
    """The listening socket.

    Raises:
        GalleyError: the address is taken or not this machine's.
    """
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    try:
        return socket.create_server((settings.host, settings.port), family=family, backlog=BACKLOG)
    except OSError as error:
        raise GalleyError(
            f"cannot listen on {settings.host} port {settings.port} ({error.strerror or error}); "
            "choose another with --port or --host"
        ) from None
