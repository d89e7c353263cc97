"""The settings of a training run, from its options and the constants of its method's source."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, Final

from galley.errors import GalleyError
from galley.learning.methods.cole_settings import ColeSettings
from galley.learning.methods.source_constants import COLE_GENERATION
from galley.learning.methods.table import METHODS
from galley.learning.options import TrainingOptions
from galley.learning.ppo.constants import PPOSettings
from galley.names import name_fix

RATIOS: Final = {"0:4": (0, 4), "1:3": (1, 3), "2:2": (2, 2), "3:1": (3, 1)}

QUICK: Final[dict[str, Any]] = {
    "ticks": 12_000,
    "minibatches": 12,
    "epochs": 2,
    "clip": 0.2,
    "learning_rate": 1.5e-3,
    "final_rate_share": 0.2,
    "max_gradient_norm": 0.5,
    "entropy_start": 0.02,
    "entropy_end": 0.002,
}
"""Constants with which a policy needs a fifth of the ticks, at a quarter of the passes: larger steps."""

RESPONSE: Final[dict[str, Any]] = {"lambda_": 0.9, "partner_shaping": 0.0}
"""Constants of a best response, ours: a cook beside competent partners learns little from what they earn."""
RESPONSE_SHAPING: Final = 0.9
"""Share of a best response's ticks over which its extra reward falls to 0, ours; see docs/learning.md."""


def ppo_settings(options: TrainingOptions) -> tuple[PPOSettings, float]:
    """The constants of PPO for a run, and the ticks that one of its learners learns from.

    Raises:
        GalleyError: an unknown method, a scale or a constant that cannot be.
    """
    if options.method not in METHODS:
        raise GalleyError(f"method {options.method!r} is unknown; {name_fix(options.method, METHODS)}")
    method = METHODS[options.method]
    if not 0 < options.scale <= 10:
        raise GalleyError(f"scale is {options.scale}; use a number above 0 and at most 10")
    if options.pool and not method.takes_pool:
        raise GalleyError(f"--pool gives FCP and COLE a population; method {options.method} makes its own")
    if not 0 < options.response <= 100:
        raise GalleyError(f"response is {options.response}; use a number above 0 and at most 100")
    if options.population is not None and not 1 < options.population <= 64:
        raise GalleyError(f"population is {options.population}; use 2 to 64")
    known = method.on(options.layout)
    settings = PPOSettings(
        learning_rate=known.learning_rate, shaping_ticks=known.shaping_ticks, **method.update
    )
    if options.quick:
        settings = settings.changed(**QUICK)
    settings = settings.changed(**_typed(options.changes))
    total = known.ticks * options.scale
    if method.generations:
        cole = cole_settings(options)
        total = float(cole.generations * cole.updates * settings.ticks)
    if "shaping_ticks" not in dict(options.changes):
        settings = settings.changed(shaping_ticks=min(settings.shaping_ticks, total / 2))
    return settings, total


def response_settings(options: TrainingOptions) -> PPOSettings:
    """The constants of the best response of FCP and MEP.

    Ticks of extra reward that were asked for are those of the population, where one is trained before.
    """
    settings, total = ppo_settings(options)
    changes = {**RESPONSE, "shaping_ticks": RESPONSE_SHAPING * options.response * total}
    kept = {key for key, _ in options.changes if key != "shaping_ticks" or options.pool}
    return settings.changed(**{key: value for key, value in changes.items() if key not in kept})


def cole_settings(options: TrainingOptions) -> ColeSettings:
    """COLE's settings for a run.

    Raises:
        GalleyError: one of them cannot be.
    """
    if options.ratio not in RATIOS:
        raise GalleyError(f"ratio {options.ratio!r} is unknown; use one of {' '.join(RATIOS)}")
    source = METHODS[options.method].on(options.layout).ticks / COLE_GENERATION
    found = ColeSettings(
        solver="shapley" if options.method == "cole-sv" else "reward",
        generations=options.generations or max(1, round(source * options.scale)),
        updates=options.generation_updates or ColeSettings.updates,
        ratio=RATIOS[options.ratio],
        partners=options.partners,
        exploration=options.exploration,
        weighted=options.weighted,
    )
    problems = found.problems()
    if problems:
        raise GalleyError("; ".join(problems))
    return found


def run_description(options: TrainingOptions) -> dict[str, Any]:
    """Everything that makes a run what it is, for run.json."""
    method = METHODS[options.method]
    told = {
        **asdict(options),
        "changes": dict(options.changes),
        "pool": list(options.pool),
        "ppo": asdict(ppo_settings(options)[0]),
    }
    if method.generations:
        told["cole"] = asdict(cole_settings(options))
    if method.best_response:
        told["response_ppo"] = asdict(response_settings(options))
    return told


def _typed(changes: Sequence[tuple[str, float]]) -> dict[str, Any]:
    """The changes with whole numbers where the constants are whole."""
    whole = ("ticks", "minibatches", "epochs")
    return {name: int(value) if name in whole else value for name, value in changes}
