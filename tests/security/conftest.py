"""A server whose study holds script in every text that a researcher can write, and one researcher."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import httpx
import pytest

from galley.records import Store
from galley.records.store.researcher_accounts import Researchers
from galley.server.app import create_app
from galley.server.content import load_content
from galley.server.researcher.passwords import Passwords
from galley.server.settings import Settings
from tests.security.hostile import hostile_workspace
from tests.security.walk import all_routes
from tests.server.helpers import Participant, Served, serving
from tests.server.researcher.office import NAME, PASSWORD, log_in


@dataclass(frozen=True)
class Site:
    """The server and all its routes as (method, path)."""

    served: Served
    routes: list[tuple[str, str]]

    def participant(self) -> Participant:
        """Somebody who has begun and sees the consent page."""
        return Participant(self.served, "hostile")

    def at_the_round(self) -> Participant:
        """Somebody whose round is next."""
        one = self.participant()
        one.agree()
        while one.stage != "round":
            one.submit(_answers(one))
        return one

    def stranger(self, **headers: str) -> httpx.Client:
        """A browser of nobody in particular that follows no redirect."""
        client = httpx.Client(base_url=self.served.url, headers=headers, timeout=30)
        return self.served.open.enter_context(client)

    def researcher(self) -> httpx.Client:
        """A browser of a researcher who is logged in."""
        client = self.served.client()
        assert log_in(client).status_code == 200
        return client


def _answers(one: Participant) -> dict[str, str]:
    return {"often": "2", "words": "x", "sentences": "y", "kind": "a"} if one.stage == "questionnaire" else {}


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    folder = tmp_path_factory.mktemp("site")
    workspace = hostile_workspace(folder / "lab")
    with Store.open(f"sqlite:///{folder}/routes.sqlite") as store:
        routes = list(all_routes(list(create_app(load_content(workspace), store, Settings()).routes)))
    with serving(workspace, folder / "records.sqlite", messages_per_s=1_000_000) as up:
        Researchers(up.store).put(NAME, Passwords().hashed(PASSWORD), 1e12).result()
        yield Site(up, routes)
