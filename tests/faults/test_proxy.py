"""The proxy of docker-compose.yml without containers: Caddy itself, with our file, before two replicas."""

from __future__ import annotations

import os
import socket
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest

from galley.records import Store
from galley.records.store.researcher_accounts import Researchers
from galley.server.researcher.passwords import Passwords
from tests.faults import test_takeover as takeover
from tests.postgres import Postgres, running
from tests.server.helpers import wait_until
from tests.server.researcher.office import NAME, PASSWORD, csrf
from tests.serving import Server, served

ROOT = Path(__file__).parents[2]
REPLICAS = ("127.0.0.2", "127.0.0.3")
CADDY = Path(sys.executable).with_name("caddy")


@dataclass(frozen=True)
class Site:
    """The proxy and the replicas behind it."""

    proxy: Server
    replicas: tuple[Server, Server]
    database: str


def free_port() -> int:
    """A port that is free on every address of this machine."""
    with socket.create_server(("0.0.0.0", 0)) as free:
        return int(free.getsockname()[1])


@contextmanager
def name_server() -> Iterator[int]:
    """The port of a name server for whom every name has the addresses of the replicas, as Docker's has."""

    def answer(question: bytes) -> bytes:
        end = question.index(0, 12) + 5
        wants_ipv4 = question[end - 4 : end - 2] == b"\0\1"
        found = REPLICAS if wants_ipv4 else ()
        head = question[:2] + struct.pack(">HHHHH", 0x8180, 1, len(found), 0, 0)
        rows = [b"\xc0\x0c\0\1\0\1" + struct.pack(">IH", 1, 4) + socket.inet_aton(ip) for ip in found]
        return head + question[12:end] + b"".join(rows)

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listening:
        listening.bind(("127.0.0.1", 0))

        def serve() -> None:
            while True:
                question, asker = listening.recvfrom(512)
                if question == b"stop":
                    return
                listening.sendto(answer(question), asker)

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield int(listening.getsockname()[1])
        finally:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stopping:
                stopping.sendto(b"stop", listening.getsockname())
            thread.join()


@contextmanager
def proxied(folder: Path, port: int, names: int) -> Iterator[Server]:
    """Caddy with our configuration, but for where names are looked up and the replicas' port."""
    text = (ROOT / "proxy" / "Caddyfile").read_text("utf-8")
    assert text.count("name app\n") == text.count("port 8000\n") == 1
    here = text.replace("name app\n", f"name app\n\t\t\tresolvers 127.0.0.1:{names}\n")
    (folder / "Caddyfile").write_text(here.replace("port 8000\n", f"port {port}\n"), "utf-8")
    site = free_port()
    environment = {"SITE_ADDRESS": f":{site}", "CADDY_ADMIN": f"127.0.0.1:{free_port()}", "HOME": str(folder)}
    command = [str(CADDY), "run", "--config", "Caddyfile", "--adapter", "caddyfile"]
    log = folder / "log"
    with log.open("wb") as out:
        process = subprocess.Popen(
            command, cwd=folder, env={**os.environ, **environment}, stdout=out, stderr=subprocess.STDOUT
        )
    try:
        server = Server(f"http://127.0.0.1:{site}", process, log)

        def up() -> bool:
            assert process.poll() is None, log.read_text()
            try:
                return httpx.get(f"{server.url}/healthz").status_code == 200
            except httpx.HTTPError:
                return False

        wait_until(up)
        yield server
    finally:
        process.terminate()
        process.wait()


@pytest.fixture(scope="module")
def postgres() -> Iterator[Postgres]:
    with running() as server:
        server.execute("CREATE DATABASE behind")
        yield server


@pytest.fixture(scope="module")
def site(postgres: Postgres, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    folder = tmp_path_factory.mktemp("proxy")
    lab, url, port = takeover.lab(folder), postgres.url("behind"), free_port()
    with ExitStack() as up:
        one, two = (
            up.enter_context(served(lab, url, "--host", host, "--port", str(port))) for host in REPLICAS
        )
        names = up.enter_context(name_server())
        yield Site(up.enter_context(proxied(folder, port, names)), (one, two), url)


def test_pages_and_sockets_reach_the_replicas_whatever_the_proxy_chooses(site: Site) -> None:
    paths = takeover.two_at_the_round(site.proxy)
    with (
        takeover.player(site.proxy, paths[0], "a") as one,
        takeover.player(site.proxy, paths[1], "b") as two,
    ):
        takeover.play_together(one, two, 20)
        assert one.until("ended")["outcome"] == two.until("ended")["outcome"] == "finished"
    takeover.debrief(site.proxy, paths[0])
    takeover.whole(site.database, "both", paths[0])


def test_a_researcher_logs_in_and_cookies_are_secure_behind_https(site: Site) -> None:
    with Store.open(site.database) as store:
        Researchers(store).put(NAME, Passwords().hashed(PASSWORD), 1e12).result()
    with httpx.Client(base_url=site.proxy.url, timeout=30) as http:
        form = {"csrf": csrf(http.get("/researcher/login").text), "name": NAME, "password": PASSWORD}
        answer = http.post("/researcher/login", data={**form, "next": ""})
        assert answer.status_code == 303
        assert "secure" not in answer.headers["set-cookie"].lower(), "this site is plain HTTP"
        assert "Studies" in http.get("/researcher").text
    # What the proxy says of itself is believed: the same page over HTTPS sets a cookie for HTTPS only.
    login = httpx.get(f"{site.replicas[0].url}/researcher/login", headers={"x-forwarded-proto": "https"})
    assert "secure" in login.headers["set-cookie"].lower()


def test_a_round_goes_on_through_the_proxy_when_its_replica_dies(site: Site) -> None:
    path = takeover.at_the_round(site.proxy)
    with takeover.player(site.proxy, path) as before:
        takeover.play_until(before, 40)
        rounds = [httpx.get(f"{replica.url}/healthz").json()["rounds"] for replica in site.replicas]
        assert sorted(rounds) == [0, 1]
        dying = site.replicas[rounds.index(1)]
        dying.process.kill()
        dying.process.wait()
        before.closed_with()
    last = max(message["tick"] for message in before.received if message["type"] == "tick")
    frame, ended = takeover.until_it_goes(lambda: takeover.go_on(site.proxy, path))
    assert (frame["phase"], ended["outcome"]) == ("paused", "finished")
    assert last - takeover.ticks_of_a_second() <= frame["tick"] <= last + 1
    pages = [httpx.get(f"{site.proxy.url}/s/mine", timeout=30).status_code for _ in range(10)]
    assert pages == [200] * 10, "the dead replica is left out"
    takeover.debrief(site.proxy, path)
    takeover.checked(site.database, path)
