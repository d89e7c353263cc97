"""The plan of a visit as it is stored: steps in order, plain JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Final, Literal, get_args

from galley.study.written.factors import Condition

StepKind = Literal[
    "consent",
    "questionnaire",
    "instructions",
    "quiz",
    "break",
    "screen_out",
    "round",
    "comparison",
    "debrief",
]
STEP_KINDS: Final[tuple[StepKind, ...]] = get_args(StepKind)


@dataclass(frozen=True)
class Step:
    """One screen of a visit; `data` is plain JSON. Agents and right answers in it are for the server alone.

    A step of kind `screen_out` is never shown: a visit that comes to it is over.
    """

    id: str
    kind: StepKind
    title: str
    data: dict[str, Any]

    @property
    def skippable(self) -> bool:
        """Whether the participant may leave it out."""
        return bool(self.data.get("skippable", False))

    @property
    def when(self) -> tuple[Condition, ...]:
        """What earlier answers have to be for the step to be met; all must hold."""
        return tuple(Condition.model_validate(condition) for condition in self.data.get("when", ()))

    @property
    def time_limit_s(self) -> int | None:
        """How long the participant may take, from the first time they see it."""
        limit: int | None = self.data.get("time_limit_s")
        return limit

    @property
    def at_limit(self) -> Literal["go_on", "end"]:
        """What follows when the time is up: the next step, or the end as timed_out."""
        return "end" if self.data.get("at_limit") == "end" else "go_on"

    @property
    def at_least_s(self) -> int:
        """How long the participant has to stay."""
        return int(self.data.get("at_least_s", 0))


@dataclass(frozen=True)
class Plan:
    """What one visit will meet; `hats` maps each partner to its hat colour in this visit.

    `condition` is the level of each factor, given by the `slot`; `attention` says how many attention checks
    may be failed (`allowed`) and what follows then (`then`: flag or end).
    """

    study: str
    study_sha256: str
    visit_no: int
    visit_seed: int
    condition: dict[str, Any]
    hats: dict[str, str]
    steps: tuple[Step, ...]
    language: str = "en"
    slot: int = 0
    attention: dict[str, Any] = field(default_factory=lambda: {"allowed": 0, "then": "flag"})

    def to_json(self) -> str:
        """The plan as one line of JSON."""
        return json.dumps(asdict(self), ensure_ascii=False, separators=(",", ":"))

    @classmethod
    def from_json(cls, text: str) -> Plan:
        """The plan that `to_json` wrote, equal to it."""
        fields = json.loads(text)
        return cls(**{**fields, "steps": tuple(Step(**step) for step in fields["steps"])})


def condition_data(conditions: Sequence[Condition]) -> list[dict[str, Any]]:
    """Those conditions that only answers decide, as JSON."""
    asks = (condition for condition in conditions if condition.factor is None)
    return [condition.model_dump(mode="json", exclude_defaults=True) for condition in asks]
