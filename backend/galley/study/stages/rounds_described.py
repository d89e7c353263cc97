"""Stages of rounds in lines of plain text."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from galley.study.stages.round_step import ALONE, HUMAN
from galley.study.stages.stage import questions_words
from galley.study.visit.counterbalance import latin_square, permutations_count

if TYPE_CHECKING:
    from galley.study.stages.rounds import Rounds, Tutorial
    from galley.study.study import Study

ORDERS: Final = {
    "fixed": "in this order",
    "random": "in an order drawn",
    "latin_square": "in the order of a Latin square",
    "full": "in every order equally often",
}
_SEATS: Final = {"per_layout": "for each layout", "per_round": "for each round"}


def described_tutorial(study: Study, stage: Tutorial) -> Iterator[str]:
    """A tutorial: its kitchen, partner and length."""
    partner = "alone" if stage.agent == ALONE else f"with {stage.agent}"
    yield f"{stage.layout} {partner}, {_length(study, stage)}"
    yield from _keys(study, stage)


def described_rounds(study: Study, stage: Rounds) -> Iterator[str]:
    """Rounds: their length, layouts, partners, seats and orders."""
    config = study.config
    ticks = stage.horizon_ticks or config.horizon_ticks
    yield f"{stage.rounds} rounds of {_length(study, stage)} ({ticks} ticks)"
    if stage.after_each is not None:
        yield f"after each: {questions_words(study, stage.after_each)}"
    kitchens = []
    for kitchen in stage.layouts:
        told = [] if kitchen.goal is None else [f"goal {kitchen.goal}"]
        if kitchen.bonus is not None:
            told.append(f"bonus {kitchen.bonus:g} {config.bonus_unit}".strip())
        if kitchen.horizon_ticks is not None:
            told.append(f"{kitchen.horizon_ticks} ticks")
        kitchens.append(kitchen.layout + (f" ({', '.join(told)})" if told else ""))
    by_agent = stage.blocks == "agent"
    inside = " for each layout" if stage.pairs == "all" and not by_agent else ""
    around = " for each agent" if by_agent else ""
    yield f"layouts, {_order(stage.layout_order, around)}: {', '.join(kitchens)}"
    if len(stage.agents) == 1:
        yield f"agent: {stage.agents[0]}"
    elif stage.pairs == "all":
        yield f"agents, {_order(stage.agent_order, inside)}: {', '.join(stage.agents)}"
    else:
        how = {
            "fixed": "in turn",
            "random": "drawn",
            "latin_square": "by a Latin square",
            "full": "in every way",
        }
        yield f"one agent on each layout, {how[stage.pairs]}: {', '.join(stage.agents)}"
    yield f"seat of the participant: {_seat(stage)}"
    if stage.show_score != "during":
        yield "the score is shown after the round" if stage.show_score == "after" else "no score is shown"
    if HUMAN in stage.agents:
        lobby = stage.meeting
        yield f"another participant is waited for up to {lobby.wait_s} s, then: {lobby.fallback}"
    yield f"cells: {_sequences(stage)}"
    yield from _keys(study, stage)


def _order(mode: str, each: str) -> str:
    return ORDERS[mode] + (each if mode != "fixed" else "")


def _seat(stage: Rounds) -> str:
    if isinstance(stage.seats, int):
        return f"always {stage.seats}"
    how = {"random": "drawn", "fixed": "in turn, 0 first", "latin_square": "in turn, either first"}
    return f"{how.get(stage.seat_order, 'in every way equally often')} {_SEATS[stage.seats]}"


def _sequences(stage: Rounds) -> str:
    """How many different sequences of layouts, agents and seats this stage can give out."""
    layouts, agents = len(stage.layouts), len(stage.agents)
    by_agent = stage.blocks == "agent"
    orders = _ways(stage.layout_order, layouts, agents if by_agent else 1)
    if stage.pairs == "all":
        orders *= _ways(stage.agent_order, agents, 1 if by_agent else layouts)
    else:
        named = {"fixed": 1, "latin_square": agents, "full": permutations_count(agents)}
        orders *= named.get(stage.pairs, _spreads(agents, layouts))
    units = {"per_layout": layouts, "per_round": stage.rounds}.get(str(stage.seats), 0)
    seatings = {"fixed": 1, "latin_square": 2}.get(stage.seat_order, 2**units) if units else 1
    return f"{orders} orders x {seatings} seatings"


def _ways(mode: str, size: int, units: int) -> int:
    if mode == "fixed":
        return 1
    return len(latin_square(size)) if mode == "latin_square" else int(permutations_count(size) ** units)


def _spreads(things: int, places: int) -> int:
    """In how many ways places can be shared out evenly among things."""
    each, more = divmod(places, things)
    same = math.factorial(each) ** (things - more) * math.factorial(each + 1) ** more
    return int(math.comb(things, more) * math.factorial(places) // same)


def _length(study: Study, stage: Tutorial | Rounds) -> str:
    config = study.config
    ticks = stage.horizon_ticks or config.horizon_ticks
    seconds = ticks * (stage.tick_ms or config.tick_ms) / 1000
    return f"{seconds:g} s" if stage.episodes == 1 else f"{stage.episodes} times {seconds:g} s"


def _keys(study: Study, stage: Tutorial | Rounds) -> Iterator[str]:
    if (stage.input_mode or study.config.input_mode) == "press":
        yield "one action for each press of a key"
