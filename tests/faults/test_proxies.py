"""The site behind a real nginx and a real Caddy: root, port, sub-path, http and https (F8, F9)."""

from __future__ import annotations

import re
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import httpx
import pytest
from playwright.sync_api import Browser, Page

from galley.records.store.researcher_accounts import Researchers
from galley.server.researcher.passwords import Passwords
from tests.browser.conftest import browser as browser
from tests.server.helpers import ONE_ROUND, serving, wait_until
from tests.study.workspaces import study_workspace

TESTS = Path(__file__).parents[1]
CADDY = Path(sys.executable).with_name("caddy")
NAME, PASSWORD = "ada", "correct horse battery"
PLAYS = {
    "nginx, Host without its port": "http://127.0.0.1:{nginx_host}/",
    "nginx, nothing but Host": "http://127.0.0.1:{nginx_http_host}/",
    "nginx, https": "https://127.0.0.1:{nginx_tls}/",
    "nginx, sub-path taken off": "http://127.0.0.1:{nginx_prefix}/kitchen/",
    "nginx, sub-path left on": "http://127.0.0.1:{nginx_left}/lab/kitchen/",
    "nginx, sub-path, https": "https://127.0.0.1:{nginx_tls}/kitchen/",
    "Caddy": "http://127.0.0.1:{caddy}/",
    "Caddy, https": "https://127.0.0.1:{caddy_tls}/",
    "Caddy, sub-path taken off": "http://127.0.0.1:{caddy_prefix}/kitchen/",
    "Caddy, sub-path, https": "https://127.0.0.1:{caddy_prefix_tls}/kitchen/",
}
ALWAYS = ("nginx, Host without its port", "nginx, sub-path, https", "Caddy, https")
"""Walked whole in a browser each time; the others with `make verify`."""
BLOCKED = {
    "nginx, Host left out": ("http://127.0.0.1:{nginx_plain}/", "header Host"),
    "nginx, no websockets": ("http://127.0.0.1:{nginx_deaf}/", "websockets"),
}
PORTS = sorted(set(re.findall(r"\{(\w+)\}", str([*PLAYS.values(), *BLOCKED.values()]))))


@contextmanager
def running(*command: str | Path) -> Iterator[None]:
    process = subprocess.Popen([str(part) for part in command])
    try:
        yield
    finally:
        process.terminate()
        process.wait(20)


def free_ports(count: int) -> list[int]:
    with ExitStack() as open_:
        return [
            open_.enter_context(socket.create_server(("127.0.0.1", 0))).getsockname()[1] for _ in range(count)
        ]


def answers(port: int) -> bool:
    try:
        with socket.create_connection(("127.0.0.1", port), timeout=1) as line:
            return bool(line.getsockname() != line.getpeername())  # a free port may lead back to itself
    except OSError:
        return False


@pytest.fixture(scope="module")
def ports(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, int]]:
    """Where the proxies listen; two servers behind them, one of which is told its sub-path."""
    folder = tmp_path_factory.mktemp("proxies")
    subprocess.run([TESTS / "nginx.sh"], check=True)
    certificate = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=127.0.0.1"]
    certificate += ["-keyout", f"{folder}/key.pem", "-out", f"{folder}/cert.pem"]
    subprocess.run(certificate, check=True, capture_output=True)
    there = dict(zip(PORTS, free_ports(len(PORTS)), strict=True))
    with ExitStack() as up:
        servers = []
        for name, settings in (("plain", {}), ("below", {"base_path": "/lab/kitchen"})):
            lab = study_workspace(folder / name, ONE_ROUND)
            (lab.path / "studies" / "other.yaml").write_text(ONE_ROUND)
            server = up.enter_context(serving(lab, folder / f"{name}.sqlite", **settings))
            Researchers(server.store).put(NAME, Passwords().hashed(PASSWORD), 0).result()
            servers.append(server.url)
        values = {"folder": folder, "plain": servers[0], "below": servers[1], **there}
        for name in ("nginx.conf", "Caddyfile"):
            text = (Path(__file__).parent / name).read_text()
            (folder / name).write_text(re.sub(r"@(\w+)@", lambda found: str(values[found[1]]), text))
        nginx = shutil.which("nginx") or "/usr/sbin/nginx"
        up.enter_context(running(nginx, "-e", "stderr", "-p", folder, "-c", folder / "nginx.conf"))
        up.enter_context(running(CADDY, "run", "--config", folder / "Caddyfile", "--adapter", "caddyfile"))
        wait_until(lambda: all(answers(port) for port in there.values()))
        yield there


ABORTED = "net::ERR_ABORTED"


@pytest.mark.parametrize("way", PLAYS)
def test_f9_pages_files_forms_redirects_and_links_keep_to_the_base(ports: dict[str, int], way: str) -> None:
    """Every address in every page, a participant's and a researcher's, lies below the base and answers."""
    root = PLAYS[way].format(**ports)
    base = httpx.URL(root).path
    with httpx.Client(verify=False, follow_redirects=True, timeout=20) as http:
        listed = http.get(root)
        follow(http, listed, base)
        landing = http.get(f"{root}s/mine/?language=en")
        assert str(landing.url).startswith(f"{root}s/mine"), "a redirect stays below the base"
        follow(http, landing, base)
        begin = re.search(r'action="([^"]+)"', landing.text)
        assert begin
        page = http.post(landing.url.join(begin[1].replace("&amp;", "&")))
        assert page.url.path.startswith(f"{base}v/")
        step = dict(re.findall(r'name="(step)" value="([^"]+)"', page.text))
        page = http.post(page.url, data={**step, "choice": "agree"})
        follow(http, page, base)
        sock = re.search(r'data-socket="([^"]+)"', page.text)
        assert sock
        assert sock[1].startswith(f"{base}v/")
        login = http.get(f"{root}researcher/studies/mine")
        assert login.url.path == f"{base}researcher/login"
        follow(http, login, base)
        login = http.get(login.url)  # the one before is old: each such page has a token of its own
        fields = dict(re.findall(r'name="(csrf|next)" value="([^"]*)"', login.text))
        study = http.post(f"{root}researcher/login", data={**fields, "name": NAME, "password": PASSWORD})
        assert study.url.path == f"{base}researcher/studies/mine"
        if "without" not in way:
            assert f'value="{root}s/mine"' in study.text, "the link to copy is the one that people use"
        follow(http, study, base)
        visits = http.get(f"{root}researcher/studies/mine/visits")
        follow(http, visits, base)


def follow(http: httpx.Client, page: httpx.Response, base: str) -> None:
    """Every address in a page answers, and lies below the base unless it is one of a place in the page."""
    assert page.status_code == 200, page.text
    found = re.findall(r'(?:href|src|data-sprites|data-url)="([^"]+)"', page.text)
    assert found
    for address in found:
        if address.startswith(("#", "http")):
            continue
        assert address.startswith(base), address
        if not address.endswith("/") and "download" not in address:
            assert http.get(page.url.join(address.replace("&amp;", "&"))).status_code == 200, address


def to_the_round(page: Page, root: str) -> None:
    page.goto(f"{root}s/mine")
    page.click("button[type=submit]")
    page.click("button[value=agree]")
    assert page.locator("body").get_attribute("data-stage") == "round"


@pytest.mark.parametrize(
    "way", [way if way in ALWAYS else pytest.param(way, marks=pytest.mark.full) for way in PLAYS]
)
def test_f8_f9_a_visit_in_a_browser_from_landing_to_code(
    browser: Browser, ports: dict[str, int], way: str
) -> None:
    """From the landing page by the round to the code; every file and every form answers."""
    context = browser.new_context(ignore_https_errors=True)
    page = context.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("requestfailed", lambda request: errors.append(request.url))
    page.on("response", lambda response: errors.append(response.url) if response.status >= 400 else None)
    to_the_round(page, PLAYS[way].format(**ports))
    assert page.evaluate("getComputedStyle(document.body).margin") == "0px", "the styles are there"
    page.click("[data-part=card-button]")
    page.click("[data-part=card-button]:has-text('Continue')")
    page.wait_for_selector("body[data-stage=debrief]")
    assert "ONE-1" in page.content()
    assert not errors
    context.close()


@pytest.mark.parametrize("way", BLOCKED)
def test_f8_a_round_that_cannot_connect_says_why(
    browser: Browser, ports: dict[str, int], way: str, caplog: pytest.LogCaptureFixture
) -> None:
    """The page and the log name what the proxy does not pass on, with Origin and Host."""
    root, missing = BLOCKED[way]
    root = root.format(**ports)
    page = browser.new_page()
    to_the_round(page, root)
    page.wait_for_selector("text=The round cannot connect", timeout=30_000)
    card = page.inner_text(".card")
    assert missing in card
    assert f"Origin {root.rstrip('/')}" in card
    assert any("does not open" in line and root.rstrip("/") in line for line in caplog.messages)
    page.close()
