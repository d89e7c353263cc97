"""What participants of a study will see, and how its design is balanced, in lines of plain text."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from galley.study.estimate import round_s
from galley.study.study import Study
from galley.study.visit.condition_slots import capacity, cells
from galley.study.visit.counterbalance import latin_square, permutations_count
from galley.study.written.factors import Condition
from galley.study.written.recruitment import VISIT_OUTCOMES
from galley.study.written.stages import (
    ALONE,
    HUMAN,
    Break,
    Comparison,
    Consent,
    Debrief,
    Instructions,
    Lobby,
    Questions,
    Quiz,
    Rounds,
    ScreenOut,
    Stage,
    Tutorial,
    conditions_of,
    stage_ids,
)

_SEATS: Final = {"per_layout": "for each layout", "per_round": "for each round"}
_ORDERS: Final = {
    "fixed": "in this order",
    "random": "in an order drawn",
    "latin_square": "in the order of a Latin square",
    "full": "in every order equally often",
}
_ASSIGNED: Final = {
    "full": "every one equally often",
    "latin_square": "in a Latin square with the others",
    "random": "drawn for each participant",
    "fixed": "in turn",
}


def describe(study: Study) -> str:
    """What participants of a study will see, in lines of plain text: stages, minutes, cells, draws."""
    return "\n".join([*_head(study), *_stages(study), *_tail(study)])


def _head(study: Study) -> Iterator[str]:
    yield f"{study.name}: {study.title}, about {study.minutes} minutes"
    if len(study.languages) > 1:
        yield f"     in {', '.join(study.languages)}"
    for name, factor in study.config.factors.items():
        yield f"     factor {name}: {', '.join(factor.levels)}; {_ASSIGNED[factor.assign]}"


def _stages(study: Study) -> Iterator[str]:
    stages = study.config.stages
    for number, (stage_id, stage) in enumerate(zip(stage_ids(stages), stages, strict=True), start=1):
        first, *more = _stage(study, stage)
        yield f"  {number:2} {stage_id}: {first}"
        yield from (f"       {line}" for line in more)
        yield from (f"       {line}" for line in _rules(stage))
        if stage.title:
            yield f"       titled '{stage.title}'"


def _tail(study: Study) -> Iterator[str]:
    config = study.config
    hats = "drawn for each visit from" if config.hat_order == "random" else _ORDERS[config.hat_order] + ":"
    yield f"     hats, {hats}{'' if hats.endswith(':') else ':'} {', '.join(config.hats)}"
    full = cells(config)
    if len(full) > 1:
        yield f"     {len(full)} cells: {'; '.join(', '.join(cell.values()) for cell in full)}"
    total = capacity(study)
    if total is not None:
        each = f" in each of {len(full)} cells" if len(full) > 1 else ""
        yield f"     closes after {config.quota} completed visits{each}" + (
            f", {total} in all" if len(full) > 1 else ""
        )
    yield from _together(study)
    balanced = participants_to_balance(study)
    if balanced > 1:
        each = " of each cell" if len(full) > 1 else ""
        yield f"     every order that is counted through is even after each {balanced} completed visits{each}"
        if config.quota is not None and config.quota % balanced:
            below, above = (config.quota // balanced * balanced + more for more in (0, balanced))
            fits = f"{below} or {above}" if below else str(above)
            yield f"     the quota of {config.quota} is no multiple of that, {fits} would be"
    if config.visit_limit_min is not None:
        yield f"     a visit ends after {config.visit_limit_min} min"
    if config.recruitment.invitations is not None:
        yield f"     for {len(study.invitations or ())} invited participants"
    yield f"     completion code: {config.completion.code}"
    for outcome in VISIT_OUTCOMES[1:]:
        code = getattr(config.endings, outcome).code
        if code is not None:
            yield f"     code when {outcome.replace('_', ' ')}: {code}"


def _together(study: Study) -> Iterator[str]:
    """The orders that are counted through together, and how many combinations they have."""
    config = study.config
    joined = config.joined(cells(config)[0])
    if not joined:
        return
    ids = stage_ids(config.stages)
    several = sum(isinstance(stage, Rounds) for stage in config.stages) > 1
    told = [
        f"{f'{ids[place]}.' if several and key != 'hat_order' else ''}{key} ({count})"
        for (place, key), count in joined.items()
    ]
    each = f" in each of {len(cells(config))} cells" if len(cells(config)) > 1 else ""
    count = math.prod(joined.values())
    yield f"     together, every combination equally often: {' x '.join(told)} = {count}{each}"


def participants_to_balance(study: Study) -> int:
    """After how many completed visits of a cell all Latin squares and full orders are even at once."""
    counts = [1]
    for condition in study.config.conditions():
        joined = study.config.joined(condition)
        counters = study.config.counters(condition).items()
        counts += [math.prod(joined.values()), *(count for key, count in counters if key not in joined)]
    return math.lcm(*counts)


def _stage(study: Study, stage: Stage) -> Iterator[str]:
    config = study.config
    match stage:
        case Consent() | Instructions() | Debrief():
            yield f"text '{_title(study, stage.text)}'"
        case Break():
            yield "a break" if stage.text is None else f"a break with text '{_title(study, stage.text)}'"
        case ScreenOut():
            yield "ends the visit as screened out"
        case Questions():
            yield _questions(study, stage.questionnaire)
        case Quiz():
            then = "the visit ends" if stage.after_last == "end" else "the visit goes on"
            yield f"{_questions(study, stage.questionnaire)}, {stage.tries} tries, then {then}"
        case Tutorial():
            partner = "alone" if stage.agent == ALONE else f"with {stage.agent}"
            yield f"{stage.layout} {partner}, {_length(study, stage)}"
        case Rounds():
            yield from _rounds(study, stage)
        case Comparison():
            which = " and ".join(stage.agents or ()) or "the two partners"
            yield f"{_questions(study, stage.questionnaire)}, comparing {which}"
    if isinstance(stage, (Tutorial, Rounds)) and (stage.input_mode or config.input_mode) == "press":
        yield "one action for each press of a key"


def _rounds(study: Study, stage: Rounds) -> Iterator[str]:
    config = study.config
    ticks = stage.horizon_ticks or config.horizon_ticks
    yield f"{stage.count} rounds of {_length(study, stage)} ({ticks} ticks)"
    if stage.after_each is not None:
        yield f"after each: {_questions(study, stage.after_each)}"
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
        lobby = stage.lobby or Lobby()
        yield f"another participant is waited for up to {lobby.wait_s} s, then: {lobby.fallback}"
    yield f"cells: {_sequences(stage)}"


def _order(mode: str, each: str) -> str:
    return _ORDERS[mode] + (each if mode != "fixed" else "")


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
    units = {"per_layout": layouts, "per_round": stage.count}.get(str(stage.seats), 0)
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


def _rules(stage: Stage) -> Iterator[str]:
    conditions = conditions_of(stage)
    if conditions:
        yield f"only if {' and '.join(map(_condition, conditions))}"
    if getattr(stage, "skippable", False):
        yield "may be left out"
    limit: int | None = getattr(stage, "time_limit_s", None)
    if limit is not None:
        then = "ends" if getattr(stage, "at_limit", "") == "end" else "goes on"
        yield f"at most {limit} s, then the visit {then}"
    least: int = getattr(stage, "at_least_s", 0)
    if least:
        yield f"at least {least} s"


def _condition(condition: Condition) -> str:
    told = []
    for words, values in (("is", condition.any_of), ("is not", condition.none_of)):
        if values:
            told.append(f"{words} {' or '.join(map(str, values))}")
    if condition.at_least is not None:
        told.append(f"is at least {condition.at_least:g}")
    if condition.at_most is not None:
        told.append(f"is at most {condition.at_most:g}")
    return f"{condition.item or condition.factor} {' and '.join(told)}"


def _title(study: Study, text: str) -> str:
    return study.texts[text].title if text in study.texts else text


def _questions(study: Study, name: str) -> str:
    if name not in study.questionnaires:
        return f"questionnaire {name}"
    questionnaire = study.questionnaires[name]
    shuffled = " in an order drawn for each visit" if questionnaire.order == "random" else ""
    return f"questionnaire '{questionnaire.title}', {len(questionnaire.items)} items{shuffled}"


def _length(study: Study, stage: Tutorial | Rounds) -> str:
    config = study.config
    seconds = (round_s(config, stage, None) - config.countdown_s) / stage.episodes
    return f"{seconds:g} s" if stage.episodes == 1 else f"{stage.episodes} times {seconds:g} s"
