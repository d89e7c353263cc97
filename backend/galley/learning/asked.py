"""What may be asked of a training run, and the run that answers it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Final

import torch

from galley.errors import GalleyError
from galley.kitchen import Layout
from galley.learning.methods.cole import Cole, ColeSettings
from galley.learning.methods.fcp import FCP
from galley.learning.methods.mep import MEP
from galley.learning.methods.milestones import STAGES
from galley.learning.methods.pbt import PBT
from galley.learning.methods.self_play import SelfPlay
from galley.learning.ppo.constants import PPOSettings, constants
from galley.learning.ppo.forwards import Machine
from galley.learning.ppo.policy import Policy
from galley.learning.run_folder import load_policy, run_asked
from galley.learning.training import Training
from galley.names import name_fix

METHODS: Final = ("sp", "pbt", "fcp", "mep", "cole-sv", "cole-r")
RATIOS: Final = {"0:4": (0, 4), "1:3": (1, 3), "2:2": (2, 2), "3:1": (3, 1)}

FCP_SEEDS: Final = 8
MEP_SIZE: Final = 5

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


@dataclass(frozen=True)
class Asked:
    """A training run as it was asked for: equal runs have equal values."""

    method: str
    layout: str
    seed: int = 0
    quick: bool = False
    scale: float = 1.0
    ratio: str = "1:3"
    partners: int | None = None
    weighted: bool = True
    exploration: float = ColeSettings.exploration
    generations: int | None = None
    generation_updates: int | None = None
    population: int | None = None
    pool: tuple[str, ...] = ()
    response: float = 2.0
    """Ticks of the best response of FCP and MEP, as a multiple of a member's. Ours."""
    changes: tuple[tuple[str, float], ...] = ()
    threads: int = 1
    device: str = "cpu"
    bf16: bool = False


def make(asked: Asked, layout: Layout) -> Training:
    """The run that was asked for, at its beginning.

    Raises:
        GalleyError: something asked for cannot be; told with the fix, before anything is trained.
    """
    settings, total = settings_of(asked)
    machine = machine_of(asked)
    updates = max(1, round(total / settings.ticks))
    seed = asked.seed
    if asked.method == "sp":
        return SelfPlay(layout, settings, updates, seed, machine)
    if asked.method == "pbt":
        return PBT(layout, settings, size=asked.population or 3, updates=updates, seed=seed, machine=machine)
    if asked.method == "fcp":
        return FCP(
            layout, settings, seeds=asked.population or FCP_SEEDS, self_play_updates=updates,
            updates=round(asked.response * updates), seed=seed, machine=machine,
            response=response_of(asked), pool=pooled(asked.pool, layout, machine.device),
        )  # fmt: skip
    if asked.method == "mep":
        return MEP(
            layout, settings, size=asked.population or MEP_SIZE, self_play_updates=updates,
            updates=round(asked.response * updates), seed=seed, machine=machine,
            response=response_of(asked),
        )  # fmt: skip
    first = pooled(asked.pool, layout, machine.device)
    return Cole(layout, settings, cole_of(asked), seed, machine, first)


def settings_of(asked: Asked) -> tuple[PPOSettings, float]:
    """The constants of PPO for a run, and the ticks that one of its learners learns from.

    Raises:
        GalleyError: an unknown method, a scale or a constant that cannot be.
    """
    if asked.method not in METHODS:
        raise GalleyError(f"method {asked.method!r} is unknown; {name_fix(asked.method, METHODS)}")
    if not 0 < asked.scale <= 10:
        raise GalleyError(f"scale is {asked.scale}; use a number above 0 and at most 10")
    if asked.pool and asked.method not in ("fcp", "cole-sv", "cole-r"):
        raise GalleyError(f"--pool gives FCP and COLE a population; method {asked.method} makes its own")
    if not 0 < asked.response <= 100:
        raise GalleyError(f"response is {asked.response}; use a number above 0 and at most 100")
    if asked.population is not None and not 1 < asked.population <= 64:
        raise GalleyError(f"population is {asked.population}; use 2 to 64")
    known = constants(asked.layout)
    if asked.method.startswith("cole"):
        settings = PPOSettings(learning_rate=known.cole_rate, shaping_ticks=known.shaping_ticks)
        total = 0.0
    elif asked.method == "pbt":
        settings = PPOSettings(
            learning_rate=known.pbt_rate, shaping_ticks=known.pbt_shaping_ticks, ticks=12_000, minibatches=10
        )
        total = known.pbt_ticks
    else:
        settings = PPOSettings(
            learning_rate=known.self_play_rate, shaping_ticks=known.shaping_ticks, ticks=12_000, minibatches=6
        )
        total = known.self_play_ticks
    if asked.quick:
        settings = settings.changed(**QUICK)
    total *= asked.scale
    settings = settings.changed(**_typed(asked.changes))
    if asked.method.startswith("cole"):
        cole = cole_of(asked)
        total = float(cole.generations * cole.updates * settings.ticks)
    if "shaping_ticks" not in dict(asked.changes):
        settings = settings.changed(shaping_ticks=min(settings.shaping_ticks, total / 2))
    return settings, total


def response_of(asked: Asked) -> PPOSettings:
    """The constants of the best response of FCP and MEP.

    Ticks of extra reward that were asked for are those of the population, where one is trained before.
    """
    settings, total = settings_of(asked)
    changes = {**RESPONSE, "shaping_ticks": RESPONSE_SHAPING * asked.response * total}
    kept = {key for key, _ in asked.changes if key != "shaping_ticks" or asked.pool}
    return settings.changed(**{key: value for key, value in changes.items() if key not in kept})


def cole_of(asked: Asked) -> ColeSettings:
    """COLE's settings for a run.

    Raises:
        GalleyError: one of them cannot be.
    """
    if asked.ratio not in RATIOS:
        raise GalleyError(f"ratio {asked.ratio!r} is unknown; use one of {' '.join(RATIOS)}")
    generations = asked.generations or max(1, round(constants(asked.layout).cole_generations * asked.scale))
    found = ColeSettings(
        solver="shapley" if asked.method == "cole-sv" else "reward",
        generations=generations,
        updates=asked.generation_updates or ColeSettings.updates,
        ratio=RATIOS[asked.ratio],
        partners=asked.partners,
        exploration=asked.exploration,
        weighted=asked.weighted,
    )
    problems = found.problems()
    if problems:
        raise GalleyError("; ".join(problems))
    return found


def pooled(runs: Sequence[str], layout: Layout, device: torch.device) -> dict[str, Policy]:
    """The milestones of finished self-play runs, by run and stage.

    Raises:
        GalleyError: a folder is no such run, of another layout, or not finished.
    """
    found = {}
    for run in map(Path, runs):
        asked = run_asked(run)
        if asked["method"] != "sp" or asked["layout"] != layout.name:
            raise GalleyError(
                f"{run}: is a run of {asked['method']} on {asked['layout']}; "
                f"the pool wants finished runs of sp on {layout.name}"
            )
        for stage in STAGES:
            found[f"{run.name}-{stage}"] = load_policy(run / "members" / f"{stage}.pt", layout, device)
    return found


def machine_of(asked: Asked) -> Machine:
    """Where the run is done.

    Raises:
        GalleyError: the device is unknown or absent.
    """
    if asked.device not in ("cpu", "cuda"):
        raise GalleyError(f"device {asked.device!r} is unknown; use cpu or cuda")
    if asked.device == "cuda" and not torch.cuda.is_available():
        raise GalleyError("device cuda: PyTorch finds no CUDA GPU here; use --device cpu")
    if asked.threads < 1:
        raise GalleyError(f"threads is {asked.threads}; use a whole number of at least 1")
    return Machine(torch.device(asked.device), asked.threads, asked.bf16)


def parsed_changes(texts: Sequence[str]) -> tuple[tuple[str, float], ...]:
    """The constants changed by texts `name=value`.

    Raises:
        GalleyError: a text is no such pair, or names no constant.
    """
    names = [field.name for field in fields(PPOSettings)]
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


def described(asked: Asked) -> dict[str, Any]:
    """Everything that makes a run what it is, for run.json."""
    settings, _ = settings_of(asked)
    told = {
        **asdict(asked),
        "changes": dict(asked.changes),
        "pool": list(asked.pool),
        "ppo": asdict(settings),
    }
    if asked.method.startswith("cole"):
        told["cole"] = asdict(cole_of(asked))
    if asked.method in ("fcp", "mep"):
        told["response_ppo"] = asdict(response_of(asked))
    return told


def _typed(changes: Sequence[tuple[str, float]]) -> dict[str, Any]:
    """The changes with whole numbers where the constants are whole."""
    whole = ("ticks", "minibatches", "epochs")
    return {name: int(value) if name in whole else value for name, value in changes}
