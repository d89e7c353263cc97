"""Words in several languages: what a file may write for them, and which language a visit gets."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated, Any, Final

from pydantic import BeforeValidator, Field, ValidationInfo, WithJsonSchema

from galley.files.reading import Loc, faults
from galley.translations import LANGUAGE

CODE: Final = f"^{LANGUAGE}$"

LanguageCode = Annotated[str, Field(pattern=CODE, max_length=20)]


def _in_one_language(value: Any, info: ValidationInfo) -> Any:
    """The words themselves, or those of the validation context's `language` out of `{language: words}`.

    With the context's `languages` every one of them has to be there.
    """
    if not isinstance(value, dict):
        return value
    context = info.context or {}
    offered: Sequence[str] = context.get("languages", ())
    found: list[tuple[Loc, str, str]] = [
        ((code,), f"'{code}' is no code of a language", "use one such as en, zh or pt-BR")
        for code in value
        if not re.fullmatch(LANGUAGE, code)
    ]
    found += [
        ((code,), f"the words in '{code}' must be text, and not empty", "write some, or remove the language")
        for code, words in value.items()
        if not isinstance(words, str) or not words.strip()
    ]
    missing = [code for code in offered or ("en",) if code not in value] if offered or not value else []
    found += [((), f"there are no words in '{code}'", f"add `{code}: ...`") for code in missing]
    if found:
        raise faults(found)
    return value.get(context.get("language", ""), next(iter(value.values())))


_SCHEMA: Final = {
    "anyOf": [
        {"type": "string"},
        {
            "type": "object",
            "description": "The words in each language, by its code.",
            "propertyNames": {"pattern": CODE},
            "additionalProperties": {"type": "string", "minLength": 1},
            "minProperties": 1,
        },
    ]
}
SAID_IN_LANGUAGES: Final = BeforeValidator(_in_one_language)
"""What marks words that participants read, and takes those of one language."""

Words = Annotated[str, Field(max_length=2000), SAID_IN_LANGUAGES, WithJsonSchema(_SCHEMA)]
"""Words that a participant reads; may be empty. A file writes `words` or `{en: words, zh: words}`."""

Text = Annotated[str, Field(min_length=1, max_length=2000), SAID_IN_LANGUAGES, WithJsonSchema(_SCHEMA)]
"""Words that a participant reads; never empty."""


def choose_language(offered: Sequence[str], accepted: str | None) -> str:
    """The offered language that a browser's `Accept-Language` header likes best; else the first offered.

    `zh` fits `zh-CN` and the other way round, and `de-CH` fits `de-AT` better than another language. Of those
    that fit one wish the closest is taken. Weight 0 and what cannot be read count for nothing.
    """
    best, best_weight = offered[0], 0.0
    for part in (accepted or "").split(",")[:50]:
        code, _, parameters = part.strip().partition(";")
        weighed = re.fullmatch(r"\s*q=([01](?:\.\d{0,3})?)\s*", parameters)
        weight = float(weighed[1]) if weighed else 0.0 if parameters.strip() else 1.0
        if weight > best_weight:
            closest = max(offered, key=lambda one: _closeness(one, code))
            if _closeness(closest, code):
                best, best_weight = closest, weight
    return best


def _closeness(one: str, other: str) -> int:
    """How well a language fits a wish: 0 not at all, 1 the same one elsewhere, more the more they share."""
    a, b = one.lower(), other.strip().lower()
    if b and (a == b or a.startswith(f"{b}-") or b.startswith(f"{a}-")):
        return 1 + min(len(a), len(b))
    return int(a.partition("-")[0] == b.partition("-")[0])
