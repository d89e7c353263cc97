"""The training methods: one table that the command line, cards and docs read. A method's own code is imported
when it is used, so that the table needs no PyTorch."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from galley.learning.methods import source_constants
from galley.learning.methods.source_constants import OTHER, Constants, LayoutConstants

if TYPE_CHECKING:
    from galley.kitchen import Layout
    from galley.learning.options import TrainingOptions
    from galley.learning.ppo.constants import PPOSettings
    from galley.learning.ppo.forwards import Machine
    from galley.learning.ppo.policy import Policy
    from galley.learning.training_run import Training


@dataclass(frozen=True)
class Start:
    """All that a training begins with."""

    options: TrainingOptions
    layout: Layout
    settings: PPOSettings
    updates: int
    """PPO updates of one learner."""
    machine: Machine
    pool: Mapping[str, Policy]
    """Policies by name that were trained before."""


@dataclass(frozen=True)
class Method:
    """A way to train partners."""

    title: str
    source: str
    constants: Constants
    make: Callable[[Start], Training]
    update: Mapping[str, Any] = field(default_factory=dict)
    """What its source sets otherwise than the defaults of `PPOSettings`, on all layouts."""
    learners: float = 1.0
    """How many times the ticks of one learner its source spends, in all stages."""
    takes_pool: bool = False
    """Whether it may begin with policies of finished self-play runs."""
    best_response: bool = False
    """Whether it ends with a best response to its population."""
    generations: bool = False
    """Whether its length is told in generations."""

    def on(self, layout_name: str) -> LayoutConstants:
        """The source's constants for a layout, or ours where it has none."""
        return self.constants.get(layout_name, self.constants[OTHER])

    def source_ticks(self, layout_name: str) -> float:
        """Kitchen ticks that the source learns from on a layout, all stages together."""
        return self.learners * self.on(layout_name).ticks


def _self_play(start: Start) -> Training:
    from galley.learning.methods.self_play import SelfPlay

    return SelfPlay(start.layout, start.settings, start.updates, start.options.seed, start.machine)


def _pbt(start: Start) -> Training:
    from galley.learning.methods.pbt import PBT

    size = start.options.population or 3
    return PBT(
        start.layout, start.settings, size=size, updates=start.updates, seed=start.options.seed,
        machine=start.machine,
    )  # fmt: skip


def _fcp(start: Start) -> Training:
    from galley.learning.methods.fcp import FCP
    from galley.learning.run_settings import response_settings

    return FCP(
        start.layout, start.settings, seeds=start.options.population or 8, self_play_updates=start.updates,
        updates=round(start.options.response * start.updates), seed=start.options.seed,
        machine=start.machine, response=response_settings(start.options), pool=start.pool,
    )  # fmt: skip


def _mep(start: Start) -> Training:
    from galley.learning.methods.mep import MEP
    from galley.learning.run_settings import response_settings

    return MEP(
        start.layout, start.settings, size=start.options.population or 5, self_play_updates=start.updates,
        updates=round(start.options.response * start.updates), seed=start.options.seed,
        machine=start.machine, response=response_settings(start.options),
    )  # fmt: skip


def _cole(start: Start) -> Training:
    from galley.learning.methods.cole import Cole
    from galley.learning.run_settings import cole_settings

    cole = cole_settings(start.options)
    return Cole(start.layout, start.settings, cole, start.options.seed, start.machine, start.pool)


_SIX: Final = {"ticks": 12_000, "minibatches": 6}

METHODS: Final[Mapping[str, Method]] = {
    "sp": Method(
        "Self-play", "Carroll et al. 2019 (arXiv:1910.05789)",
        source_constants.SELF_PLAY, _self_play, update=_SIX,
    ),
    "pbt": Method(
        "Population-based training", "Carroll et al. 2019 (arXiv:1910.05789); Jaderberg et al. 2017",
        source_constants.PBT, _pbt, update={"ticks": 12_000, "minibatches": 10}, learners=3,
    ),
    "fcp": Method(
        "Fictitious co-play", "Strouse et al. 2021 (arXiv:2110.08176)",
        source_constants.SELF_PLAY, _fcp, update=_SIX, learners=10, takes_pool=True, best_response=True,
    ),
    "mep": Method(
        "Maximum-entropy population", "Zhao et al. 2023 (arXiv:2112.11701)",
        source_constants.SELF_PLAY, _mep, update=_SIX, learners=7, best_response=True,
    ),
    "cole-sv": Method(
        "COLE with the graphic Shapley value solver", "COLE paper, Sec. 4 and 5",
        source_constants.COLE, _cole, takes_pool=True, generations=True,
    ),
    "cole-r": Method(
        "COLE with the reward solver", "COLE paper, Sec. 4 and 5",
        source_constants.COLE, _cole, takes_pool=True, generations=True,
    ),
}  # fmt: skip
"""By the name that the command line knows."""
