"""Every route, walked by people who have no business there."""

from __future__ import annotations

import re
from collections import Counter

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from galley.records import Store
from galley.server.headers import HEADERS
from tests.records.stored import stored_visit
from tests.security.conftest import Site
from tests.security.walk import OPEN, RESEARCHER, TOKEN, class_of
from tests.server.helpers import Participant
from tests.server.researcher.office import NAME, PASSWORD, csrf

TOKENS = 150
CHI_SQUARE_63 = 103.4
"""Exceeded with probability 0.001 by a chi-square variable of 63 degrees of freedom."""
ELSEWHERE = (
    {"sec-fetch-site": "cross-site"},
    {"sec-fetch-site": "same-site"},
    {"origin": "https://evil.example"},
    {"origin": "http://127.0.0.1:1"},
)


def filled(path: str, token: str = "x" * 32) -> str:
    """A path with something in each of its places."""
    values = {"study": "hostile", "token": token, "visit": "1", "round": "1", "kind": "csv"}
    return re.sub(r"\{([^}:]+)[^}]*\}", lambda name: values.get(name[1], "x"), path)


def wrong_tokens(right: str) -> list[str]:
    last = "A" if right[-1] != "A" else "B"
    return [
        *(right[:-1] + last, right[:-1], right + "A", right.swapcase(), right[::-1], "x" * 32, "null"),
        *("%00", "%25", "%2e%2e", "1", "%27%20OR%201=1%20--", "*", "%E2%98%83", "a" * 3000),
    ]


def status_of_socket(url: str, **headers: str) -> int:
    try:
        with connect(url, additional_headers=headers, compression=None):
            return 101
    except InvalidStatus as refused:
        return refused.response.status_code


def test_every_route_is_classed(site: Site) -> None:
    unknown = [f"{method} {path}" for method, path in site.routes if class_of(method, path) is None]
    assert unknown == [], "say in tests/security/walk.py who may use these"
    assert Counter(class_of(*route) for route in site.routes)[RESEARCHER] >= 15
    assert len(site.routes) == len(set(site.routes))


def test_open_routes_give_nothing_of_anybody(site: Site) -> None:
    one = site.participant()
    for method, path in site.routes:
        if class_of(method, path) == OPEN and method == "GET":
            answer = site.served.client().get(filled(path))
            assert answer.status_code == (404 if path.startswith("/pictures") else 200), path
            assert one.token not in answer.text


def test_without_a_link_there_is_no_visit(site: Site) -> None:
    one = site.participant()
    http = site.stranger()
    for method, path in site.routes:
        if class_of(method, path) != TOKEN:
            continue
        for token in wrong_tokens(one.token):
            if method == "SOCKET":
                url = site.served.url.replace("http", "ws") + filled(path, token)
                assert status_of_socket(url) in (403, 404), (path, token)
            else:
                data = {"step": one.step, "choice": "agree"} if method == "POST" else None
                answer = http.request(method, filled(path, token), data=data)
                assert answer.status_code in (404, 405), (method, path, token)
                assert one.token not in answer.text
    assert one.load().text.count("choice") > 0, "the visit is where it was"


def test_without_a_login_there_are_no_researchers_pages(site: Site) -> None:
    one = site.participant()
    for cookie in ("", one.token, "x" * 43):
        http = site.stranger()
        if cookie:
            http.cookies.set("galley_researcher", cookie, path="/researcher")
        for method, path in site.routes:
            if class_of(method, path) == RESEARCHER:
                answer = http.request(
                    method, filled(path), data={"csrf": cookie} if method == "POST" else None
                )
                if path.endswith(".json"):
                    assert answer.status_code == 401, (method, path)
                else:
                    assert answer.status_code == 303, (method, path)
                    assert answer.headers["location"].startswith("/researcher/login")
                assert "hostile" not in answer.text


def test_nobody_moves_somebody_elses_visit(site: Site) -> None:
    """Forms, skips and keys of one participant, whatever they name, change their own visit alone."""
    ada, bob = site.at_the_round(), site.participant()
    before = _standing(site.served.store, ada)
    for step in (ada.step, "consent", "rounds-1", bob.step):
        bob.http.post(
            bob.path,
            data={"step": step, "choice": "agree", "token": ada.token, "visit": "1", "skip": "1"},
            headers={"referer": site.served.url + ada.path, "x-token": ada.token},
        )
    with bob.play() as player:
        player.send("hello", protocol=2, tab="t")
        assert player.closed_with() == 4002, "bob has no round to play"
    assert _standing(site.served.store, ada) == before
    with ada.play() as player:
        assert player.hello()["phase"] == "waiting"


def _standing(store: Store, one: Participant) -> tuple[int, str]:
    row = stored_visit(store, one.token)
    assert row is not None
    return row.step_index, row.status


def test_tokens_cannot_be_guessed(site: Site) -> None:
    http = site.served.client()
    tokens = [http.post("/s/hostile/begin").url.path.rsplit("/", 1)[1] for _ in range(TOKENS)]
    assert len(set(tokens)) == TOKENS
    assert {len(token) for token in tokens} == {32}, "192 bits in Base64"
    signs = Counter("".join(tokens))
    assert len(signs) == 64
    expected = sum(signs.values()) / 64
    assert sum((count - expected) ** 2 / expected for count in signs.values()) < CHI_SQUARE_63
    for place in range(32):
        assert len({token[place] for token in tokens}) > 32, "no place is fixed or counts up"


@pytest.mark.parametrize("headers", ELSEWHERE)
def test_other_sites_can_send_nothing(site: Site, headers: dict[str, str]) -> None:
    one = site.at_the_round()
    fresh = site.participant()
    before = [_standing(site.served.store, who) for who in (one, fresh)]
    for method, path in site.routes:
        if method == "SOCKET":
            url = site.served.url.replace("http", "ws") + filled(path, one.token)
            assert status_of_socket(url, **headers) == 403, path
        elif method == "POST":
            http = site.stranger(**headers)
            answer = http.post(
                filled(path, fresh.token), data={"step": fresh.step, "choice": "agree", "name": NAME}
            )
            refused = answer.status_code in (403, 404)
            not_logged_in = answer.status_code == 303 and "/researcher/login" in answer.headers["location"]
            assert refused or not_logged_in, (path, answer.status_code)
            assert "set-cookie" not in answer.headers
    assert [_standing(site.served.store, who) for who in (one, fresh)] == before


def test_every_answer_carries_the_headers(site: Site) -> None:
    one = site.at_the_round()
    http = site.stranger()
    asked = [
        http.request(method, filled(path, one.token))
        for method, path in site.routes
        if method not in ("SOCKET", "MOUNT")
    ]
    asked += [http.get(path) for path in ("/nowhere", "/static/css/base.css", "/static/x", "/v/x", "/s/x")]
    asked += [http.put("/"), http.options(one.path), http.post(one.path, content=b"x" * 300_000)]
    asked.append(http.post(one.path, content=b"{}", headers={"content-type": "application/json"}))
    for answer in asked:
        where = f"{answer.request.method} {answer.request.url.path} {answer.status_code}"
        assert answer.status_code < 500, where
        for name, value in HEADERS.items():
            assert answer.headers.get(name) == value, f"{where}: {name}"
        assert "server" not in answer.headers, where
        if answer.request.url.path.startswith(("/v/", "/s/")):
            assert "set-cookie" not in answer.headers, where
        if answer.request.url.path.startswith("/v/") and answer.status_code == 200:
            assert answer.headers["cache-control"] == "no-store", where


def test_the_policy_lets_nothing_foreign_in() -> None:
    policy = dict(part.strip().split(" ", 1) for part in HEADERS["content-security-policy"].split(";"))
    assert policy["default-src"] == "'none'"
    assert policy["frame-ancestors"] == "'none'"
    assert policy["base-uri"] == "'none'"
    assert policy["form-action"] == "'self'"
    assert policy["script-src"] == policy["style-src"] == policy["connect-src"] == "'self'"
    assert "unsafe" not in HEADERS["content-security-policy"]
    assert "*" not in HEADERS["content-security-policy"]


def test_the_researchers_cookie_is_locked_in(site: Site) -> None:
    http = site.stranger()
    form = {"csrf": csrf(http.get("/researcher/login").text), "name": NAME, "password": PASSWORD, "next": ""}
    answer = http.post("/researcher/login", data=form)
    cookies = answer.headers.get_list("set-cookie")
    assert cookies
    for cookie in (one for one in cookies if "max-age=0" not in one.lower()):
        flags = {part.strip().lower() for part in cookie.split(";")[1:]}
        assert "httponly" in flags
        assert "samesite=strict" in flags
        assert any(flag.startswith("path=/researcher") for flag in flags)
        assert not any(flag.startswith("domain") for flag in flags)
