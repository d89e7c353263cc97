"""What participants of a study will see, and how its design is balanced, in lines of plain text."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from galley.study.stages.rounds_described import ORDERS
from galley.study.stages.stage import stage_ids
from galley.study.study import Study
from galley.study.visit.condition_slots import capacity, cells
from galley.study.written.hats import HAT_WORDS
from galley.translations import Catalogues

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
    (least, most), rounds = (study.quoted.numbers[name] for name in ("minutes", "rounds"))
    minutes = f"{most}" if least == most else f"{least} to {most}"
    varied = "" if rounds[0] == rounds[1] else f", {rounds[0]} to {rounds[1]} rounds"
    yield f"{study.name}: {study.title}, about {minutes} minutes{varied}"
    if len(study.languages) > 1:
        yield f"     in {', '.join(study.languages)}"
    for name, factor in study.config.factors.items():
        yield f"     factor {name}: {', '.join(factor.levels)}; {_ASSIGNED[factor.assign]}"


def _stages(study: Study) -> Iterator[str]:
    stages = study.config.stages
    for number, (stage_id, stage) in enumerate(zip(stage_ids(stages), stages, strict=True), start=1):
        first, *more = stage.description(study)
        yield f"  {number:2} {stage_id}: {first}"
        yield from (f"       {line}" for line in (*more, *stage.rules_description()))
        if stage.title:
            yield f"       titled '{stage.title}'"


def _tail(study: Study) -> Iterator[str]:
    config = study.config
    hats = "drawn for each visit from" if config.hat_order == "random" else ORDERS[config.hat_order] + ":"
    colours = ", ".join(_in_words(study))
    yield f"     hats, {hats}{'' if hats.endswith(':') else ':'} {colours}"
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
    for outcome in type(config.endings).model_fields:
        code = getattr(config.endings, outcome).code
        if code is not None:
            yield f"     code when {outcome.replace('_', ' ')}: {code}"


def _in_words(study: Study) -> Iterator[str]:
    """The colours with the words by which participants know them, in each language of the study."""
    catalogues = Catalogues.load()
    speakers = [catalogues.translator(code) for code in study.languages]
    for hat in study.config.hats:
        words = (speaker.gettext(HAT_WORDS[hat].colour) for speaker in speakers)
        known = dict.fromkeys(word for word in words if word != hat)
        yield f"{hat} ({' / '.join(known)})" if known else hat


def _together(study: Study) -> Iterator[str]:
    """The orders that are counted through together, and how many combinations they have."""
    config = study.config
    joined = config.joined(cells(config)[0])
    if not joined:
        return
    ids = stage_ids(config.stages)
    several = sum(stage.rounds > 0 for stage in config.stages) > 1
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
