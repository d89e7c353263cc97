"""What a server has to offer: studies, with the kitchens and agents that they name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from concurrent.futures import Future
from dataclasses import dataclass
from threading import Thread

from galley.agents.bundle import Bundle
from galley.agents.catalogue import Catalogue
from galley.agents.episode import play_episode
from galley.agents.scripted import Stay
from galley.errors import GalleyError
from galley.kitchen import Layout, warm
from galley.kitchen.layout_file import load_layouts
from galley.server.rounds.set_up import round_layout
from galley.study.stages.round_step import RoundStep
from galley.study.study import Study, load_study
from galley.study.visit.condition_slots import cells
from galley.study.visit.plan import plan_visit, visit_seed
from galley.translations import Catalogues
from galley.workspace import Workspace

REHEARSED_TICKS = 3
REHEARSED_VISITS = 64
MADE_READY_WITHIN_S = 30.0
REHEARSED_PER_CELL = 8


@dataclass(frozen=True, slots=True)
class Content:
    """Studies by name, layouts by name and alias, the agents that may be met in them, and the languages."""

    studies: Mapping[str, Study]
    layouts: Mapping[str, Layout]
    agents: Catalogue
    catalogues: Catalogues


def load_content(workspace: Workspace, only: str = "") -> Content:
    """All studies of a workspace, or `only` one, ready to be served.

    Kernels are compiled and every agent that a study needs is tried here, so that nothing is left to the
    first round.

    Raises:
        GalleyError: there is no study, or an agent cannot play where a study lets it.
        InvalidFiles: all that is wrong with a file that a study needs.
    """
    studies, catalogues = _studies(workspace, only), Catalogues.load(workspace.folder("catalogues"))
    content = Content(studies, load_layouts(workspace), Catalogue(workspace), catalogues)
    warm()
    _rehearse(content.studies, content.layouts, content.agents)
    return content


def _studies(workspace: Workspace, only: str) -> Mapping[str, Study]:
    names = (only,) if only else workspace.names("studies")
    if not names:
        raise GalleyError(
            f"{workspace.path / 'studies'}: there is no study to serve; write one, see docs/first-study.md"
        )
    return {name: load_study(workspace, name) for name in names}


def _rehearse(studies: Mapping[str, Study], layouts: Mapping[str, Layout], catalogue: Catalogue) -> None:
    """Let every agent act on every layout that a visit can bring it to, from both seats.

    Raises:
        GalleyError: an agent cannot play on a layout; it names both.
    """
    met = {
        (name, round_layout(layouts, step))
        for study in studies.values()
        for step in _rounds(study)
        for name in step.agents
    }
    for name, layout in sorted(met, key=lambda pair: (pair[0], pair[1].name)):
        bundle = catalogue.bundle(name)
        try:
            _play_both_seats(bundle, layout)
        except GalleyError:
            raise
        except Exception as error:
            raise GalleyError(
                f"agents/{name}: it cannot play on layout {layout.name} ({type(error).__name__}: {error}); "
                "run `galley agents check`"
            ) from error


def _play_both_seats(bundle: Bundle, layout: Layout) -> None:
    """Play a few ticks on either seat, in the time that the agent declares, and networks in some of ours."""

    def few_ticks() -> None:
        for seat in (0, 1):
            agent = bundle.make()
            agents = (agent, Stay()) if seat == 0 else (Stay(), agent)
            play_episode(layout, agents, seed=0, ticks=REHEARSED_TICKS)

    if bundle.think_ms is None and bundle.kind != "network":  # ours, and perhaps still to be compiled
        few_ticks()
        return
    played: Future[None] = Future()

    def attempt() -> None:
        try:
            few_ticks()
        except Exception as error:  # handed to who waits
            played.set_exception(error)
        else:
            played.set_result(None)

    within_s = 2 * REHEARSED_TICKS * (bundle.think_ms or 0) / 1000 + MADE_READY_WITHIN_S
    # A daemon: one that never answers must not keep the process from ending.
    Thread(target=attempt, name=f"galley-rehearsal-{bundle.name}", daemon=True).start()
    try:
        played.result(within_s)
    except TimeoutError:
        bundle.interrupt()
        raise GalleyError(
            f"agents/{bundle.name}: {REHEARSED_TICKS} decisions on each seat of layout {layout.name} took "
            f"longer than {within_s:.0f} s; declare a longer think_ms, or mend the agent"
        ) from None


def _rounds(study: Study) -> Iterator[RoundStep]:
    """The rounds that visits meet: those of some visits in each cell of the design."""
    for number in range(min(REHEARSED_VISITS, REHEARSED_PER_CELL * len(cells(study.config)))):
        for step in plan_visit(study, visit_seed(study, number), number).steps:
            if isinstance(step, RoundStep):
                yield step
