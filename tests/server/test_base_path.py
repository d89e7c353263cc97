"""The base path's rules by themselves (F9), and whose page a request comes from (F8)."""

from __future__ import annotations

import pytest

from galley.errors import GalleyError
from galley.server.base_path import at, checked
from galley.server.headers import same_origin
from galley.server.templates import templates


@pytest.mark.parametrize(
    "value", ["kitchen", "//evil.example", "/s", "/static/x", "/a b", "/../x", "/a?b", "/researcher"]
)
def test_f9_a_base_path_that_cannot_be(value: str) -> None:
    with pytest.raises(GalleyError, match=r"BASE_PATH.*such as /kitchen"):
        checked(value)


def test_f9_a_base_path_that_can_be() -> None:
    assert [checked(value) for value in ("", "/", "/kitchen/", "/a/b.c")] == ["", "", "/kitchen", "/a/b.c"]


def test_f9_whole_urls_and_places_stay_as_they_are() -> None:
    for value in ("https://a.example/x", "//a.example/x", "#place", "?page=2", ""):
        assert at(value) == value


def test_f9_every_template_puts_the_base_path_into_its_addresses() -> None:
    """No attribute that holds an address is left as it was."""
    environment = templates("frontend/templates")
    seen = 0
    for name in environment.list_templates():
        source = environment.preprocess(environment.loader.get_source(environment, name)[0])  # type: ignore[union-attr]
        assert '="/' not in source, name
        seen += source.count("base_path()")
    assert seen > 50


@pytest.mark.parametrize(
    ("headers", "same"),
    [
        ({}, True),
        ({"origin": "null"}, True),
        ({"origin": "http://127.0.0.1:8922", "host": "127.0.0.1"}, True),
        ({"origin": "http://127.0.0.1:8922", "host": "127.0.0.1:8922"}, True),
        ({"origin": "http://127.0.0.1:8922", "host": "127.0.0.1:8920"}, False),
        (
            {"origin": "http://127.0.0.1:8922", "host": "127.0.0.1:8920", "sec-fetch-site": "same-origin"},
            True,
        ),
        ({"origin": "https://a.example", "host": "a.example:443"}, True),
        ({"origin": "https://a.example", "host": "10.0.0.1:8000", "x-forwarded-host": "a.example"}, True),
        ({"origin": "https://a.example", "host": "a.example", "sec-fetch-site": "cross-site"}, False),
        ({"origin": "https://a.example", "host": "a.example", "sec-fetch-site": "same-site"}, False),
        ({"origin": "https://a.example.evil", "host": "a.example"}, False),
        ({"origin": "https://[", "host": "a.example"}, False),
        ({"origin": "https://a.example"}, False),
    ],
)
def test_f8_whose_page_a_request_comes_from(headers: dict[str, str], same: bool) -> None:
    assert same_origin(headers) == same
