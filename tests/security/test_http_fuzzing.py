"""Schemathesis over the whole HTTP interface: whatever is asked, no answer is a server's error."""

from __future__ import annotations

import re
from typing import Any

import schemathesis
from hypothesis import HealthCheck, given, settings

from galley.server.headers import HEADERS
from galley.server.researcher.login import SESSION_COOKIE
from tests.security.conftest import Site
from tests.security.hostile import SCRIPTS
from tests.security.walk import TOKEN, class_of
from tests.server.researcher.office import csrf

SHARED_OUT = 5
"""A route gets this part of the examples of the profile."""
ENDS_SESSION = ("/researcher/logout", "/researcher/login")
NO_PAGES = ("SOCKET", "MOUNT")
FIELDS = (
    *("step", "choice", "skip", "time_up", "leave", "hidden", "often", "words", "sentences", "kind"),
    *("csrf", "name", "password", "next", "state", "text", "language", "cell", "link", "participant"),
)
QUERY = (
    "PROLIFIC_PID",
    "galley-test",
    "language",
    "code",
    "status",
    "sort",
    "page",
    "after",
    "from",
    "to",
    "next",
    "test",
)


def description(site: Site) -> dict[str, Any]:
    """The routes as OpenAPI tells them: every place a known value or anything, every form field a text."""
    token = site.participant().token
    known = {"study": ["hostile"], "token": [token, site.at_the_round().token], "kind": ["csv"]}
    paths: dict[str, Any] = {}
    for method, path in site.routes:
        if method in NO_PAGES:
            continue
        plain = re.sub(r":int\}", "}", path)
        operation: dict[str, Any] = {
            "parameters": [_place(name, known) for name in re.findall(r"\{(\w+)\}", plain)]
            + [{"name": name, "in": "query", "schema": {"type": "string"}} for name in QUERY],
            "responses": {"default": {"description": "a page"}},
        }
        if method == "POST":
            fields = {name: _text(name) for name in FIELDS}
            form = {"type": "object", "properties": fields, "additionalProperties": {"type": "string"}}
            operation["requestBody"] = {"content": {"application/x-www-form-urlencoded": {"schema": form}}}
        paths.setdefault(plain, {})[method.lower()] = operation
    return {"openapi": "3.0.3", "info": {"title": "Galley", "version": "1"}, "paths": paths}


def _place(name: str, known: dict[str, list[str]]) -> dict[str, Any]:
    whole = {"type": "integer"} if name in ("visit", "round") else {"type": "string", "minLength": 1}
    schema = {"anyOf": [{"enum": known[name]}, whole]} if name in known else whole
    return {"name": name, "in": "path", "required": True, "schema": schema}


def _text(name: str) -> dict[str, Any]:
    likely = {"choice": ["agree", "decline"], "step": ["consent", "asked", "rounds-1"], "often": ["1", "9"]}
    chosen = [*likely.get(name, ["1"]), *SCRIPTS]
    return {"anyOf": [{"enum": chosen}, {"type": "string"}, {"type": "array", "items": {"type": "string"}}]}


def test_no_request_breaks_the_server(site: Site) -> None:
    """Examples are drawn here rather than by Schemathesis' plugin, which does not know this pytest."""
    schema = schemathesis.openapi.from_dict(description(site))
    operations = [found.ok() for found in schema.get_all_operations()]
    assert len(operations) == len([method for method, _ in site.routes if method not in NO_PAGES])
    for operation in operations:

        @given(case=operation.as_strategy())
        @settings(
            max_examples=max(1, settings().max_examples // SHARED_OUT),
            suppress_health_check=list(HealthCheck),
        )
        def ask(case: schemathesis.Case) -> None:
            check(case, site)

        ask()


def test_no_request_of_a_researcher_breaks_the_server(site: Site) -> None:
    """The same behind the login: with a session's cookie, and with its token in every form."""
    researcher = site.researcher()
    token = csrf(researcher.get("/researcher").text)
    session = {SESSION_COOKIE: researcher.cookies[SESSION_COOKIE]}
    schema = schemathesis.openapi.from_dict(description(site))
    found = [operation.ok() for operation in schema.get_all_operations()]
    behind = [one for one in found if one.path.startswith("/researcher") and one.path not in ENDS_SESSION]
    assert len(behind) > 10
    for operation in behind:

        @given(case=operation.as_strategy())
        @settings(
            max_examples=max(1, settings().max_examples // SHARED_OUT),
            suppress_health_check=list(HealthCheck),
        )
        def ask(case: schemathesis.Case) -> None:
            if isinstance(case.body, dict):
                case.body["csrf"] = token
            check(case, site, cookies=session)

        ask()
    assert "Studies" in researcher.get("/researcher").text, "still logged in"


def check(case: schemathesis.Case, site: Site, **more: Any) -> None:
    answer = case.call(base_url=site.served.url, allow_redirects=False, timeout=30, **more)
    assert answer.status_code < 500, f"{answer.status_code} for {case.as_curl_command()}"
    if answer.status_code != 400:  # what is no HTTP is refused before it reaches a page
        for name in HEADERS:
            assert name in answer.headers, f"{name} for {case.as_curl_command()}"
    if answer.status_code == 200 and class_of(case.method, case.path) == TOKEN:
        assert answer.headers["cache-control"] == ["no-store"]


def test_the_description_names_every_route(site: Site) -> None:
    told = description(site)["paths"]
    assert sum(len(methods) for methods in told.values()) == sum(
        method not in NO_PAGES for method, _ in site.routes
    )
