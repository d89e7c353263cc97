"""All routes of the researcher's pages in one table, every one of them behind the logins."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping

from starlette.routing import Route

from galley.records import Store
from galley.server.clock import Clock
from galley.server.researcher.downloads import DownloadPages
from galley.server.researcher.formats import FILTERS
from galley.server.researcher.login import HOME, LOGIN, Logins
from galley.server.researcher.page_context import PageContext
from galley.server.researcher.round_pages import RoundPages
from galley.server.researcher.study_pages import StudyPages
from galley.server.researcher.visit_pages import VisitPages
from galley.server.templates import templates
from galley.study.study import Study


def researcher_pages(
    *,
    store: Store,
    studies: Mapping[str, Study],
    folder: str,
    clock: Clock,
    stop_visit: Callable[[int], Awaitable[None]],
) -> list[Route]:
    """The routes under /researcher. `folder` holds the templates; for the rest see PageContext."""
    environment = templates(folder)
    environment.filters |= FILTERS
    logins = Logins(store, environment, clock)
    context = PageContext(store, studies, environment, clock, logins, stop_visit)
    about_studies, about_visits = StudyPages(context), VisitPages(context)
    about_rounds, files = RoundPages(context), DownloadPages(context)

    pages = {
        "": about_studies.home,
        "/studies/{study}": about_studies.study,
        "/studies/{study}/visits": about_studies.visits,
        "/studies/{study}/rounds": about_studies.rounds,
        "/studies/{study}/download/{kind}": files.download,
        "/visits/{visit:int}": about_visits.visit,
        "/rounds/{round:int}": about_rounds.round,
        "/rounds/{round:int}/film.{kind}": files.film,
    }
    data = {
        "/live.json": about_studies.home_live,
        "/studies/{study}/live.json": about_studies.study_live,
        "/rounds/{round:int}/replay.json": about_rounds.replay,
    }
    form_actions = {
        "/logout": logins.logout,
        "/studies/{study}/state": about_studies.set_state,
        "/studies/{study}/test-links": about_studies.make_test_link,
        "/studies/{study}/test-links/withdraw": about_studies.withdraw_test_link,
        "/visits/{visit:int}/notes": about_visits.note,
        "/visits/{visit:int}/erase": about_visits.erase,
    }
    return [
        Route(LOGIN, logins.login_page, methods=["GET"]),
        Route(LOGIN, logins.login, methods=["POST"]),
        *(Route(f"{HOME}{path}", logins.page(page)) for path, page in pages.items()),
        *(Route(f"{HOME}{path}", logins.data(page)) for path, page in data.items()),
        *(
            Route(f"{HOME}{path}", logins.form_action(form_action), methods=["POST"])
            for path, form_action in form_actions.items()
        ),
    ]
