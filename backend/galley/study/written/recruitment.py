"""Where participants come from and where they go: link parameters, invitations, codes, redirects."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, Literal, Self
from urllib.parse import quote

from pydantic import Field, model_validator

from galley.errors import InvalidFiles, Problem
from galley.files.reading import FileModel, faults
from galley.names import name_fix
from galley.outcomes import TurnedAway, VisitOutcome
from galley.study.written.factors import TextName, known_name

PLATFORM_PARAMS: Final = (
    *("PROLIFIC_PID", "STUDY_ID", "SESSION_ID"),
    *("workerId", "assignmentId", "hitId"),
)
"""What Prolific and MTurk add to a study's link. Source: their guides on external study links."""

INVITATION_PARAM: Final = "code"
"""The link parameter that carries an invitation's code."""

MOST_KEPT_CHARS: Final = 200

ParamName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$", max_length=60)]
Code = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$", max_length=64)]
Redirect = Annotated[str, Field(pattern=r"^https://\S+$", max_length=500)]

_BRACKETS: Final = re.compile(r"[{}\[\]<>$%*#]")
_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_WRITTEN: Final = re.compile(r"[\s='\"]")
"""What a name in brackets does not hold: such a value was written by somebody."""
_NOBODY: Final = {
    *("undefined", "null", "none", "nil", "nan", "n/a", "id", "pid", "participant", "your_id"),
    "assignment_id_not_available",
    "[object object]",
}
"""What stands in links for an id that nobody filled in, in lower case."""

_PLACE: Final = re.compile(r"\{([^{}]*)\}")
_INVITATION: Final = re.compile(r"[A-Za-z0-9_-]{6,64}")


class Completion(FileModel):
    """What a participant who reached the end takes away: a code, and perhaps an address to go to."""

    code: Code
    """Shown at the end."""
    redirect: Redirect | None = None
    """An https address to go on to; `{code}` and kept parameters such as `{PROLIFIC_PID}` are filled in."""


class EndingFile(FileModel):
    """What a participant meets who did not reach the end: a text, a code, an address to go to."""

    text: TextName | None = None
    """The page that is shown; a plain one of ours without it."""
    code: Code | None = None
    """A code to hand in."""
    redirect: Redirect | None = None
    """An https address to go on to, as for `completion`."""


class Endings(FileModel):
    """How visits end that do not reach the debrief, by outcome; what is left out has a plain page."""

    declined: EndingFile = EndingFile()
    """The participant did not agree."""
    screened_out: EndingFile = EndingFile()
    """A `screen_out` stage met its condition."""
    failed_checks: EndingFile = EndingFile()
    """Too many attention checks failed, or a quiz."""
    timed_out: EndingFile = EndingFile()
    """A time limit that ends the visit has passed."""
    expired: EndingFile = EndingFile()
    """The visit was away too long and its slot was given to someone else."""
    partner_missing: EndingFile = EndingFile()
    """Nobody came to play with."""
    partner_lost: EndingFile = EndingFile()
    """Nobody came any more, after rounds with somebody; without keys of its own as `partner_missing`."""
    interrupted: EndingFile = EndingFile()
    """The visit needs a file that was changed or removed after it began."""
    full: EndingFile = EndingFile()
    """No visit began: all visits that are wanted are completed."""
    later: EndingFile = EndingFile()
    """No visit began: every slot is taken just now."""
    paused: EndingFile = EndingFile()
    """No visit began: the study is paused."""
    closed: EndingFile = EndingFile()
    """No visit began: the study is closed."""
    uninvited: EndingFile = EndingFile()
    """No visit began: the link carries no code of the list of invitations."""
    incomplete: EndingFile = EndingFile()
    """No visit began: the link lacks the id of `recruitment.participant`, or holds a placeholder."""


class Attention(FileModel):
    """What follows when more than `allowed` attention checks of a visit are failed."""

    allowed: int = Field(0, ge=0, le=100)
    """How many attention checks of a visit may be failed."""
    then: Literal["flag", "end"] = "flag"
    """What follows when more are: the visit is marked for the researcher, or ends as failed_checks."""


class Recruitment(FileModel):
    """Which parameters of the link are kept, which of them tells a person apart, and who is invited."""

    keep: tuple[ParamName, ...] = Field(PLATFORM_PARAMS, max_length=20)
    """Parameters of the study's link that are stored; all others are dropped."""
    participant: ParamName | None = None
    """Which of them tells a person apart, for instance `PROLIFIC_PID`."""
    required: bool = True
    """Whether a link without that id, or with a placeholder for it, is turned away; else flagged."""
    once: bool = True
    """Whether a person has one visit only; coming back leads to it."""
    invitations: Annotated[str, known_name("list of invitations", "invitations")] | None = None
    """A file `invitations/NAME.txt` of codes, one a line: only links with `?code=...` may begin."""

    @model_validator(mode="after")
    def _the_person_is_kept(self) -> Self:
        if self.participant is not None and self.participant not in self.keep:
            told = f"parameter '{self.participant}' is not kept"
            raise faults([(("participant",), told, name_fix(self.participant, self.keep))])
        return self


@dataclass(frozen=True)
class Ending:
    """What a visit that ended, or could not begin, shows: a `text` of the study, or None for a plain page."""

    outcome: VisitOutcome | TurnedAway
    text: str | None
    code: str | None
    redirect: str | None


def unknown_places(redirect: str | None, keep: tuple[str, ...]) -> tuple[str, ...]:
    """The `{places}` of a redirect that are neither `{code}` nor a kept parameter."""
    return tuple(name for name in _PLACE.findall(redirect or "") if name not in ("code", *keep))


def filled(redirect: str | None, code: str | None, params: Mapping[str, str]) -> str | None:
    """A redirect with its `{places}` filled in, each escaped; a parameter that did not come is empty."""
    if redirect is None:
        return None
    values = {**params, "code": code or ""}
    return _PLACE.sub(lambda place: quote(values.get(place[1], ""), safe=""), redirect)


def kept(params: Mapping[str, str], keep: tuple[str, ...]) -> dict[str, str]:
    """Those of a link's parameters that are stored, without control characters and not too long."""
    return {
        name: "".join(c for c in params[name] if c.isprintable())[:MOST_KEPT_CHARS]
        for name in keep
        if name in params
    }


def is_placeholder(value: str, name: str = "") -> bool:
    """Whether a parameter's value is nobody's id but what stood where a recruiter should have put one.

    That is a name in brackets of whatever kind (`{{%PROLIFIC_PID%}}`, `${e://Field/PID}`, `[id]`, `<ID>`,
    `__ID__`), the parameter's own `name`, nothing but signs, or what programs write for nothing
    (`undefined`, `null`, `[object Object]`, MTurk's ASSIGNMENT_ID_NOT_AVAILABLE). Real ids of recruiters
    are letters and digits, perhaps with `-`, `_`, `.`, `@` or `+` within.
    """
    plain = value.strip()
    return (
        bool(_BRACKETS.search(plain) and not _WRITTEN.search(plain))
        or not plain.strip("-_.")
        or plain.casefold() in _NOBODY
        or (_NAME.fullmatch(name) is not None and _letters(plain) == _letters(name))
        or bool(re.fullmatch(r"__.*__|:[A-Za-z_]+", plain))
    )


def _letters(text: str) -> str:
    return re.sub(r"[\W_]", "", text).casefold()


def load_invitations(path: Path, shown: str) -> frozenset[str]:
    """The codes in a file, one a line; empty lines and those that begin with # are left out.

    Raises:
        InvalidFiles: everything that is wrong with the file.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        told = f"cannot be read ({error.strerror or error})"
        raise InvalidFiles([Problem(shown, None, told, "check that it is there")]) from None
    except UnicodeDecodeError:
        raise InvalidFiles(
            [Problem(shown, None, "the text is not UTF-8", "save the file as UTF-8")]
        ) from None
    problems = []
    codes: dict[str, int] = {}
    for number, line in enumerate(map(str.strip, lines), start=1):
        if not line or line.startswith("#"):
            continue
        if not _INVITATION.fullmatch(line):
            fix = "use 6 to 64 letters, digits, - and _"
            problems.append(Problem(shown, number, f"'{line[:40]}' is no code", fix))
        elif line in codes:
            told = f"code '{line}' stands here again (first on line {codes[line]})"
            problems.append(Problem(shown, number, told, "remove one of the two"))
        codes.setdefault(line, number)
    if not codes:
        problems.append(Problem(shown, None, "there is no code in the file", "write one a line"))
    if problems:
        raise InvalidFiles(problems)
    return frozenset(codes)
