"""Who gets in: every route of the pages, logins, sessions, tokens of forms, cookies."""

from __future__ import annotations

import re

import pytest
from starlette.routing import Route

from galley.records.store.researcher_accounts import Researchers
from galley.server.researcher.login import SESSION_S
from galley.server.researcher.login_throttle import FREE_TRIES
from tests.server.researcher.office import HOSTILE, NAME, PASSWORD, Office, csrf, log_in


def every_route(office: Office) -> list[tuple[str, str]]:
    """(method, path) of every route under /researcher, with something that is there in each place."""
    visit = office.visits["done"].id
    values = {"study": office.study.name, "visit": visit, "round": office.open_round, "kind": ""}
    found = []
    for route in office.pages:
        assert isinstance(route, Route)
        values["kind"] = "gif" if "/film." in route.path else "csv"
        path = re.sub(r"\{([^}]+)\}", lambda name: str(values[name[1].split(":")[0]]), route.path)
        found += [(method, path) for method in sorted(route.methods or ()) if method != "HEAD"]
    return found


def test_every_route_is_known_to_these_tests(office: Office) -> None:
    routes = every_route(office)
    assert len(routes) == len(set(routes))
    assert {path.split("/")[2] for _, path in routes if path.count("/") > 1} == {
        "login", "logout", "live.json", "studies", "visits", "rounds",
    }  # fmt: skip
    assert sum(method == "POST" for method, _ in routes) == 7


def test_nobody_gets_in_without_a_login(office: Office) -> None:
    client = office.visitor()
    before = office.store.study_state(office.study.name).result()
    for method, path in every_route(office):
        if path == "/researcher/login":
            continue
        for cookie in ("", "x" * 43, "' OR 1=1 --"):
            client.cookies.clear()
            if cookie:
                client.cookies.set("galley_researcher", cookie, path="/researcher")
            answer = client.request(
                method, path, data={"state": "closed", "csrf": "x", "text": "x"} if method == "POST" else None
            )
            if path.endswith(".json"):
                assert answer.status_code == 401
                assert answer.json() == {"error": "log in again"}
            else:
                assert (answer.status_code, answer.headers["location"].split("?")[0]) == (
                    303,
                    "/researcher/login",
                )
                assert answer.text == ""
    assert office.store.study_state(office.study.name).result() == before


def test_a_login_leads_to_where_one_wanted_to_go(office: Office) -> None:
    client = office.visitor()
    wanted = f"/researcher/visits/{office.visits['done'].id}"
    asked = client.get(wanted)
    form = client.get(asked.headers["location"]).text
    assert f'name="next" value="{wanted}"' in form
    assert log_in(client, back=wanted).headers["location"] == wanted
    assert client.get(wanted).status_code == 200
    assert client.get("/researcher/login").headers["location"] == "/researcher"


@pytest.mark.parametrize(
    "back",
    [
        "https://evil.example",
        "//evil.example",
        "/researcher\\@evil",
        "/researcherevil",
        "/researcher/\nx",
        "",
    ],
)
def test_a_login_leads_nowhere_else(office: Office, back: str) -> None:
    assert log_in(office.visitor(), back=back).headers["location"] == "/researcher"


@pytest.mark.parametrize(
    ("name", "password"),
    [
        (NAME, "wrong password"),
        ("nobody", PASSWORD),
        ("", ""),
        (NAME, PASSWORD + "x" * 5000),
        (HOSTILE, HOSTILE),
    ],
)
def test_wrong_logins_are_told_without_saying_what_was_wrong(fresh: Office, name: str, password: str) -> None:
    client = fresh.visitor()
    answer = log_in(client, name, password)
    assert answer.status_code == 403
    assert "Name and password do not belong together" in answer.text
    assert "galley_researcher" not in client.cookies
    assert "<script>alert" not in answer.text


def test_a_login_form_counts_only_with_its_own_token(fresh: Office) -> None:
    client = fresh.visitor()
    client.get("/researcher/login")
    right = {"name": NAME, "password": PASSWORD}
    for token in ({}, {"csrf": ""}, {"csrf": "x"}):
        assert client.post("/researcher/login", data=right | token).status_code == 403
    without_cookie = fresh.visitor()
    assert without_cookie.post("/researcher/login", data=right | {"csrf": ""}).status_code == 403
    token = csrf(client.get("/researcher/login").text)
    foreign = {"sec-fetch-site": "cross-site"}
    assert client.post("/researcher/login", data=right | {"csrf": token}, headers=foreign).status_code == 403


def test_guessing_gets_slower_and_a_pause_lets_the_owner_in_again(fresh: Office) -> None:
    client = fresh.visitor()
    for _ in range(FREE_TRIES):
        assert log_in(client, password="wrong password").status_code == 403
    refused = log_in(client)
    assert refused.status_code == 429
    assert "Wait 2 seconds" in refused.text
    fresh.clock.at_s += 3
    assert log_in(client, password="wrong password").status_code == 403
    assert "Wait 4 seconds" in log_in(client).text
    fresh.clock.at_s += 5
    assert log_in(client).status_code == 303
    assert log_in(fresh.visitor(), password="wrong password").status_code == 403


def test_without_any_researcher_the_page_says_how_to_add_one(fresh: Office) -> None:
    Researchers(fresh.store).remove(NAME).result()
    page = fresh.visitor().get("/researcher/login")
    assert page.status_code == 200
    assert "galley researchers add NAME" in page.text
    assert 'name="password"' not in page.text


def test_cookies_are_for_these_pages_alone(office: Office) -> None:
    for scheme, secure in (("http", False), ("https", True)):
        client = office.visitor(**{"x-forwarded-proto": scheme})
        form = client.get("/researcher/login")
        token = csrf(form.text)
        # Sent by hand: over this plain connection a browser would keep the secure cookie to itself.
        login = client.post(
            "/researcher/login",
            data={"csrf": token, "name": NAME, "password": PASSWORD},
            headers={"cookie": f"galley_login={token}"},
        )
        assert login.status_code == 303
        sent = [form.headers["set-cookie"], login.headers["set-cookie"]]
        for cookie in sent:
            words = {word.strip().lower() for word in cookie.split(",")[0].split(";")[1:]}
            assert {"httponly", "samesite=strict"} <= words
            assert any(word.startswith("path=/researcher") for word in words)
            assert ("secure" in words) is secure
            assert any(word.startswith("max-age=") for word in words)


def test_a_session_dies_on_logout_and_its_cookie_is_worth_nothing(fresh: Office) -> None:
    researcher = fresh.researcher()
    stolen = researcher.http.cookies["galley_researcher"]
    assert researcher.send("/logout").headers["location"] == "/researcher/login"
    assert "galley_researcher" not in researcher.http.cookies
    thief = fresh.visitor()
    thief.cookies.set("galley_researcher", stolen, path="/researcher")
    assert thief.get("/researcher").status_code == 303


def test_a_session_runs_out(fresh: Office) -> None:
    researcher = fresh.researcher()
    fresh.clock.at_s += SESSION_S - 1
    researcher.page("")
    fresh.clock.at_s += 2
    researcher.http.cookies.set(
        "galley_researcher", researcher.http.cookies.get("galley_researcher") or "", path="/researcher"
    )
    assert researcher.http.get("/researcher").status_code == 303


def test_a_new_password_ends_the_sessions_of_the_old_one(fresh: Office) -> None:
    researcher = fresh.researcher()
    Researchers(fresh.store).put(NAME, "another hash", fresh.clock.ms()).result()
    assert researcher.http.get("/researcher").status_code == 303


def test_sessions_of_two_researchers_have_two_tokens(fresh: Office) -> None:
    first, second = fresh.researcher(), fresh.researcher()
    assert csrf(first.page("")) != csrf(second.page(""))
    assert first.send("/studies/short/state", csrf(second.page("")), state="closed").status_code == 403
    assert fresh.store.study_state("short").result() == "open"


def test_forms_without_the_right_token_change_nothing(office: Office) -> None:
    researcher = office.researcher()
    visit = office.visits["done"]
    good = csrf(researcher.page(""))
    forms = [
        ("/studies/short/state", {"state": "closed"}),
        (f"/visits/{visit.id}/notes", {"text": "forged"}),
        (f"/visits/{visit.id}/erase", {"confirm": visit.participant}),
        ("/logout", {}),
    ]
    for path, fields in forms:
        for token in ("", "x", good[:-1], good + "x", "ü"):
            assert researcher.send(path, token, **fields).status_code == 403, path
        foreign = {"origin": "https://evil.example", "sec-fetch-site": "cross-site"}
        sent = researcher.http.post(f"/researcher{path}", data={"csrf": good, **fields}, headers=foreign)
        assert sent.status_code == 403
        as_json = researcher.http.post(f"/researcher{path}", json={"csrf": good, **fields})
        assert as_json.status_code == 415
    assert office.store.study_state("short").result() == "open"
    assert "forged" not in researcher.page(f"/visits/{visit.id}")


def test_pages_are_kept_by_nobody_and_load_nothing_from_elsewhere(office: Office) -> None:
    researcher = office.researcher()
    for method, path in every_route(office):
        if method != "GET" or "download" in path or path.endswith("login"):
            continue
        answer = researcher.http.get(path)
        assert answer.status_code == 200, path
        assert answer.headers["cache-control"] == "no-store"
        assert "default-src 'none'" in answer.headers["content-security-policy"]
        assert "unsafe" not in answer.headers["content-security-policy"]
        if not path.endswith(".json"):
            assert not re.search(r"<script>|\son[a-z]+=|\sstyle=|javascript:", answer.text)
            assert not re.findall(r"(?:src|href)=\"(?!/|#)", answer.text)
