"""Fills in forms as somebody in a hurry would: every question answered, drawn at random."""

from __future__ import annotations

import re
from collections.abc import Mapping
from random import Random
from typing import Any, Final

from galley.simulate.page import Field, Form, Item

NUMBERS: Final = ("30", "3", "1", "0", "10", "100", "1000", "0.5")
"""Tried in turn for numbers whose bounds the page does not tell."""
WORDS: Final = ("It went well.", "We got in each other's way at times.", "Nothing to add, thank you <3")

Known = Mapping[str, Any]
"""Right answers by item: of attention checks and quizzes, for people who read what they are asked."""


def fill(form: Form, rng: Random, known: Known, attempt: int = 0) -> list[tuple[str, str]]:
    """(field, value) of everything that the form sends; `attempt` counts how often it came back."""
    sent = list(form.hidden.items())
    chosen: dict[str, list[str]] = {}
    for item in form.items:
        if item.when and not set(chosen.get(item.when, ())) & set(item.any_of):
            continue
        pairs = _answer(item, rng, known.get(item.name), attempt)
        chosen[item.name] = [value for _, value in pairs]
        sent += pairs
    forward = form.buttons[0] if form.buttons else None
    if forward is not None and forward.name:
        sent.append((forward.name, forward.value))
    return sent


def _answer(item: Item, rng: Random, right: Any, attempt: int) -> list[tuple[str, str]]:
    if right is not None:
        values = right if isinstance(right, list) else [right]
        return [(item.fields[0].name, _text(value)) for value in values] if item.fields else []
    if item.kind == "ranking":
        places = list(range(1, len(item.fields) + 1))
        rng.shuffle(places)
        return [(one.name, str(place)) for one, place in zip(item.fields, places, strict=True)]
    return [pair for one in item.fields for pair in _fill_field(one, item, rng, attempt)]


def _fill_field(one: Field, item: Item, rng: Random, attempt: int) -> list[tuple[str, str]]:
    match one.kind:
        case "radio":
            return [(one.name, rng.choice(one.options))]
        case "checkbox":
            some = rng.sample(one.options, rng.randint(1, len(one.options)))
            return [(one.name, value) for value in one.options if value in some]
        case "select":
            return [(one.name, rng.choice([value for value in one.options if value]))]
        case "textarea":
            return [(one.name, rng.choice(WORDS))]
    if "min" in one.attributes and "step" in one.attributes:
        low, high, step = (float(one.attributes[name]) for name in ("min", "max", "step"))
        return [(one.name, f"{low + step * rng.randint(0, int((high - low) / step)):g}")]
    if "inputmode" in one.attributes:
        return [(one.name, _number(item, attempt))]
    return [(one.name, rng.choice(WORDS))]


def _number(item: Item, attempt: int) -> str:
    """A number; when one was refused, one that the refusal names."""
    named = re.findall(r"-?\d+(?:\.\d+)?", item.error)
    return (named or NUMBERS)[attempt % len(named or NUMBERS)]


def _text(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
