"""What varies between participants, and conditions on that and on earlier answers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal, Self

from pydantic import (
    AfterValidator,
    Discriminator,
    Field,
    Tag,
    ValidationInfo,
    field_validator,
    model_validator,
)

from galley.files.reading import FileModel, Loc, faults
from galley.names import name_fix

FACTOR_MARK: Final = "$"
"""`$baseline` stands for the level of factor `baseline` in a visit."""

FactorName = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=40)]
Level = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=80)]
Order = Literal["random", "fixed", "latin_square", "full"]
Counted = Literal["layout_order", "agent_order", "pairs", "seat_order", "hat_order"]
"""What a study may count through."""


def known_name(what: str, kind: str, *besides: str) -> Any:
    """Refuses a name that the workspace, given as validation context {kind: names}, does not hold.

    Names in `besides` and factors (`$name`, looked into by the study file) pass.
    """

    def check(name: str, info: ValidationInfo) -> str:
        known: Mapping[str, tuple[str, ...]] = info.context or {}
        if kind in known and name not in (*known[kind], *besides) and not name.startswith(FACTOR_MARK):
            raise faults([((), f"no {what} is named '{name}'", name_fix(name, (*known[kind], *besides)))])
        return name

    return AfterValidator(check)


LayoutName = Annotated[str, known_name("layout", "layouts")]
AgentName = Annotated[str, known_name("agent", "agents")]
PartnerName = Annotated[str, known_name("agent", "agents", "human")]
QuestionnaireName = Annotated[str, known_name("questionnaire", "questionnaires")]
TextName = Annotated[str, known_name("text", "texts")]


class Factor(FileModel):
    """Something that differs between participants.

    `full` (the default): crossed with the other full factors, every combination equally often.
    `latin_square`: follows from the full factors, so that each of its levels meets each of theirs equally
    often. `random`: drawn for each slot. `fixed`: levels take turns from slot to slot as written.
    """

    levels: tuple[Level, ...] = Field(min_length=2, max_length=100)
    """The values it takes, such as names of agents; numbers in quotes."""
    assign: Literal["full", "random", "latin_square", "fixed"] = "full"
    """How participants get a level: see Balance."""

    @field_validator("levels")
    @classmethod
    def _levels_differ(cls, levels: tuple[str, ...]) -> tuple[str, ...]:
        return names_differ(levels, "level")


def names_differ(names: tuple[Any, ...], what: str) -> tuple[Any, ...]:
    """The names, each of which has to stand once."""
    twice = [place for place, name in enumerate(names) if name in names[:place]]
    if twice:
        raise faults([((p,), f"{what} '{names[p]}' stands twice", "name each once") for p in twice])
    return names


def resolve(name: str, condition: Mapping[str, Any]) -> str:
    """The name itself, or for `$factor` the level that the condition gives it."""
    return str(condition[name.removeprefix(FACTOR_MARK)]) if name.startswith(FACTOR_MARK) else name


def levels_of(name: str, factors: Mapping[str, Factor]) -> tuple[str, ...]:
    """Every name that a name may stand for: itself, or all levels of a `$factor`."""
    if not name.startswith(FACTOR_MARK):
        return (name,)
    factor = factors.get(name.removeprefix(FACTOR_MARK))
    return () if factor is None else factor.levels


class Condition(FileModel):
    """Holds when the answer to `item` (`stage.item`), or the level of `factor`, is as asked.

    What was not answered meets no condition.
    """

    item: Annotated[str, Field(pattern=r"^[a-z][a-z0-9-]*\.[a-z][a-z0-9_]*$")] | None = None
    """`stage.item`: the id of a stage with questions before this one, and of one of its items."""
    factor: FactorName | None = None
    """The name of a factor, instead of an item."""
    any_of: tuple[str | int | float, ...] = ()
    """One of these is the answer, or among several answers."""
    none_of: tuple[str | int | float, ...] = ()
    """None of these is."""
    at_least: float | None = None
    """The answer is a number, and at least this."""
    at_most: float | None = None
    """The answer is a number, and at most this."""

    @model_validator(mode="after")
    def _asks_one_thing(self) -> Self:
        found: list[tuple[Loc, str, str]] = []
        if (self.item is None) == (self.factor is None):
            found.append(((), "a condition asks for an item or for a factor", "write one of the two"))
        if not self.any_of and not self.none_of and self.at_least is None and self.at_most is None:
            fix = "add any_of, none_of, at_least or at_most"
            found.append(((), "a condition says nothing about the answer", fix))
        if self.factor is not None and (self.at_least is not None or self.at_most is not None):
            found.append(((), "the level of a factor is no number", "use any_of or none_of"))
        if found:
            raise faults(found)
        return self

    def holds(self, value: object) -> bool:
        """Whether an answer or a level meets the condition."""
        values = value if isinstance(value, list) else [value]
        if not values or None in values:
            return False
        number = value if isinstance(value, (int, float)) else None
        return (
            (not self.any_of or any(one in self.any_of for one in values))
            and not any(one in self.none_of for one in values)
            and (self.at_least is None or (number is not None and number >= self.at_least))
            and (self.at_most is None or (number is not None and number <= self.at_most))
        )


def _one_or_many(value: Any) -> str:
    return "list" if isinstance(value, (list, tuple)) else "Condition"


Conditions = Annotated[
    Annotated[Condition, Tag("Condition")] | Annotated[tuple[Condition, ...], Tag("list")],
    Discriminator(_one_or_many),
]
"""One condition, or a list of them that must all hold."""
