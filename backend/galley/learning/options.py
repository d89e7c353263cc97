"""What may be asked of a training run: one table that the command line, `run.json` and the cards follow."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, field, fields
from typing import Any, Final

from galley.errors import GalleyError
from galley.learning.methods.cole_settings import ColeSettings
from galley.learning.ppo.constants import PPOSettings
from galley.names import name_fix

SEVERAL: Final = list[str] | None


def words(flag: str, value: Any) -> list[str]:
    """An option on the command line: a flag alone for True, once for each of several values."""
    if isinstance(value, tuple | list):
        return [f"{flag} {one}" for one in value]
    if value is True:
        return [flag]
    return [f"{flag} {value:g}" if isinstance(value, float) else f"{flag} {value}"]


@dataclass(frozen=True)
class Option:
    """How a field of `TrainingOptions` is asked for on the command line."""

    help: str
    flag: str
    metavar: str | None = None
    least: int | None = None
    shown_default: str | None = None
    """What the help shows in place of the default."""
    kind: Any = None
    """Its type on the command line, None for that of the field; it is then left out by default."""
    value: Callable[[Any], Any] = lambda given: given
    """The field's value from what was given on the command line."""
    words: Callable[[str, Any], list[str]] = words
    """The words of the command line for the field's value."""
    methods: str = ""
    """Methods whose commands name it: those that begin so."""
    always: bool = False
    """Whether commands name it where it has its default too."""


def _asked(default: Any, flag: str, help_: str, **how: Any) -> Any:
    return field(default=default, metadata={"option": Option(help_, flag, **how)})


def _without(flag: str, value: Any) -> list[str]:
    return [] if value else [flag]


@dataclass(frozen=True)
class TrainingOptions:
    """A training run as it was asked for: equal runs have equal values."""

    method: str
    layout: str = _asked(MISSING, "--layout", "Layout to train on.", metavar="NAME", always=True)
    seed: int = _asked(0, "--seed", "Seed of everything in the run.", metavar="N", least=0, always=True)
    quick: bool = _asked(False, "--quick", "Larger steps than the papers', for a fifth of the ticks.")
    scale: float = _asked(1.0, "--scale", "Share of the papers' ticks (COLE: generations).", metavar="X")
    ratio: str = _asked(
        "1:3", "--ratio", "COLE: kitchens with itself : with others.", metavar="A:B", methods="cole"
    )
    weighted: bool = _asked(
        True, "--no-wpg", "COLE: leave the weighted PageRank out (ablation).",
        kind=bool, value=lambda given: not given, words=_without, methods="cole",
    )  # fmt: skip
    exploration: float = _asked(
        ColeSettings.exploration, "--no-sucg", "COLE: draw partners by the solver alone (ablation).",
        kind=bool, value=lambda given: 0.0 if given else ColeSettings.exploration, words=_without,
        methods="cole",
    )  # fmt: skip
    partners: int | None = _asked(
        None, "--partners", "COLE: partners drawn for an update.", metavar="N", least=1, shown_default="B"
    )
    generations: int | None = _asked(
        None, "--generations", "COLE: generations, whatever the scale.", metavar="N", least=1
    )
    generation_updates: int | None = _asked(
        None, "--generation-updates", "COLE: updates of a generation.", metavar="N", least=1,
        shown_default=str(ColeSettings.updates),
    )  # fmt: skip
    population: int | None = _asked(
        None, "--population", "PBT, FCP, MEP: policies in the population.", metavar="N",
        shown_default="3, 8, 5",
    )  # fmt: skip
    pool: tuple[str, ...] = _asked(
        (), "--pool", "FCP, COLE: a finished run of sp for the first population, once each.",
        metavar="RUN", kind=SEVERAL, value=lambda given: tuple(given or ()),
    )  # fmt: skip
    response: float = _asked(
        2.0, "--response", "FCP, MEP: ticks of the best response for one of a member.", metavar="X"
    )
    changes: tuple[tuple[str, float], ...] = _asked(
        (), "--set", "Change a constant of PPO.", metavar="NAME=VALUE", kind=SEVERAL,
        value=lambda given: parsed_changes(given or ()),
        words=lambda flag, value: [f"{flag} {name}={number:g}" for name, number in dict(value).items()],
    )  # fmt: skip
    threads: int = _asked(
        1, "--threads", "Threads; other numbers round differently.", metavar="N", least=1,
        shown_default="all", kind=int | None, value=lambda given: given or os.cpu_count() or 1, always=True,
    )  # fmt: skip
    device: str = _asked("cpu", "--device", "cpu or cuda.", metavar="NAME")
    bf16: bool = _asked(False, "--bf16", "Networks in bfloat16, where the processor has it.")


def asked_options() -> dict[str, tuple[Field[Any], Option]]:
    """The fields of `TrainingOptions` that are options of the command line, by name, in their order."""
    return {
        one.name: (one, one.metadata["option"]) for one in fields(TrainingOptions) if "option" in one.metadata
    }


def train_command(options: Mapping[str, Any]) -> str:
    """The command that asks for a run with these options, by name; what is missing has its default."""
    told = [f"galley learn train {options['method']}"]
    for name, (one, option) in asked_options().items():
        value = options.get(name, one.default)
        if not options["method"].startswith(option.methods):
            continue
        if option.always or value not in (one.default, [], {}):
            told += option.words(option.flag, value)
    return " ".join(told)


def parsed_changes(texts: Sequence[str]) -> tuple[tuple[str, float], ...]:
    """The constants changed by texts `name=value`.

    Raises:
        GalleyError: a text is no such pair, or names no constant.
    """
    names = [one.name for one in fields(PPOSettings)]
    found = {}
    for text in texts:
        name, _, value = text.partition("=")
        if name not in names:
            raise GalleyError(f"--set {text}: constant {name!r} is unknown; {name_fix(name, names)}")
        try:
            found[name] = float(value)
        except ValueError:
            raise GalleyError(f"--set {text}: {value!r} is no number; write {name}=0.1") from None
    return tuple(sorted(found.items()))
