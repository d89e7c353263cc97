"""A plan in the making: what one visit draws, counts through and has come to so far."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from numpy.random import Generator, SeedSequence, default_rng

from galley.study.visit.condition_slots import cell_number, cell_of_slot, place_in_cell
from galley.study.visit.counterbalance import Turn, picks, together
from galley.study.written.factors import Counted, resolve
from galley.study.written.item_base import Say
from galley.study.written.questionnaire import Questionnaire

if TYPE_CHECKING:
    from galley.study.study import Study

DESIGN: Final = 3
HATS, LAYOUTS, AGENTS, SEATS, PAIRS, FIRST, ITEMS = range(7)
"""What is drawn or counted through in a stage; every one has a stream of its own."""
JOINED: Final = 0
KEYS: Final[Mapping[Counted, int]] = {
    "layout_order": LAYOUTS,
    "agent_order": AGENTS,
    "pairs": PAIRS,
    "seat_order": SEATS,
    "hat_order": HATS,
}


class Draft:
    """What the stages of a study make the steps of one visit from.

    `place` is the place of the stage whose turn it is, `of` the number of rounds that count, `round_no` that
    of the last one so far; `hats` are those of the partners, by agent.
    """

    def __init__(self, study: Study, seed: int, slot: int, say: Say) -> None:
        self.condition = cell_of_slot(study, slot)
        self.study = study.met_by(self.condition)
        self.config = study.config
        self.seed = seed
        self.slot = slot
        self.say = say
        self.place = 0
        self.of = sum(s.rounds for s in self.config.stages if s.meets(self.condition))
        self.round_no = 0
        self._cell = cell_number(study, slot)
        self._number = place_in_cell(study, slot)
        self._rounds_drawn = 0
        self._pages = 0
        joined = self.config.joined(self.condition)
        tag = (DESIGN, self._cell, JOINED)
        given = together(self.config.seed, tag, self._number, tuple(joined.values()))
        self._given = {(place, KEYS[key]): one for (place, key), one in zip(joined, given, strict=True)}
        agents = self.config.partners(self.condition)
        wanted = self.config.hats_worn(self.condition)
        chosen = picks(self.config.hat_order, len(self.config.hats), wanted, *self.by(HATS))
        hats = [str(self.config.hats[place]) for place in chosen]
        self.human_hat = hats[0]
        self.hats = dict(zip(agents, hats[1:], strict=False))
        # The tutorial's partner wears a hat of its own, so that nobody rates a partner by the practice round.
        self.tutorial_hat = hats[-1]

    def by(self, what: int) -> tuple[Generator, Turn]:
        """What an order of the stage is drawn with, and what it is counted through with."""
        draw = default_rng(SeedSequence(self.seed, spawn_key=(0, self.place, what)))
        tag = (DESIGN, self._cell, self.place, what)
        return draw, Turn(self.config.seed, tag, self._number, self._given.get((self.place, what)))

    def resolve(self, name: str) -> str:
        """The name itself, or the level that this visit has of `$factor`."""
        return resolve(name, self.condition)

    def text_title(self, name: str) -> str:
        """The heading of a text."""
        return self.study.texts[self.resolve(name)].title

    def text(self, name: str) -> dict[Literal["text", "sha256"], str]:
        """The text of a step, and the hash of its words."""
        name = self.resolve(name)
        return {"text": name, "sha256": self.study.texts[name].sha256}

    def questions_title(self, name: str) -> str:
        """The heading of a questionnaire."""
        return self.study.questionnaires[self.resolve(name)].title

    def questions(self, name: str) -> dict[str, Any]:
        """The questionnaire of a step: its name, the order of its items in this visit, the right answers."""
        name = self.resolve(name)
        questionnaire = self.study.questionnaires[name]
        self._pages += 1
        draw = default_rng(SeedSequence(self.seed, spawn_key=(0, 0, ITEMS, self._pages)))
        return {
            "questionnaire": name,
            "item_order": item_order(questionnaire, draw),
            "expected": questionnaire.expected,
        }

    def round_seeds(self, episodes: int) -> tuple[int, ...]:
        """Seeds (below 2**63) of the episodes of the next round."""
        self._rounds_drawn += 1
        sequence = SeedSequence(self.seed, spawn_key=(self._rounds_drawn,))
        return (seed_of(sequence), *(seed_of(child) for child in sequence.spawn(episodes - 1)))


def seed_of(sequence: SeedSequence) -> int:
    """A seed below 2**63."""
    return int(sequence.generate_state(1, np.uint64)[0] >> np.uint64(1))


def item_order(questionnaire: Questionnaire, draw: Generator) -> list[str]:
    """The ids of the items as shown; an item that depends on another one stays behind it in any order."""
    groups: dict[str, list[str]] = {}
    head: dict[str, str] = {}
    for item in questionnaire.items:
        head[item.id] = item.id if item.when is None else head[item.when.item]
        groups.setdefault(head[item.id], []).append(item.id)
    together = list(groups.values())
    if questionnaire.order == "random":
        together = [together[place] for place in draw.permutation(len(together))]
    return [name for group in together for name in group]
