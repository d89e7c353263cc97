"""`galley learn payoffs`: how the checkpoints of a run cook with each other."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from galley.errors import GalleyError
from galley.evaluation.game_graph import PayoffTable
from galley.kitchen.layout_file import find_layout
from galley.learning.methods.milestones import CHECKPOINTS
from galley.learning.policy_files import finished_run, load_policy
from galley.learning.ppo.forwards import Machine
from galley.learning.ppo.games import games_among
from galley.workspace import Workspace


def checkpoint_payoffs(
    workspace: Path,
    run: Path,
    *,
    games: int = 5,
    seed: int = 0,
    threads: int = 1,
    tell: Callable[[int, int], None] = lambda done, total: None,
) -> PayoffTable:
    """The payoffs of up to 50 checkpoints of a finished run, uniform along it, also written to payoffs.npz.

    Every pair plays `games` games in each seat order. COLE's checkpoints are the strategies of its
    generations, those of other methods the policy in the making; `tell` hears of ticks done and all.

    Source: COLE paper, Sec. 7.3 and Fig. 10.

    Raises:
        GalleyError: there is no finished run in the folder, or fewer than two checkpoints.
    """
    layout = find_layout(Workspace(workspace), finished_run(run)["layout"])
    names = sorted(path.stem for path in (run / "members").glob("[0-9][0-9][0-9][0-9].pt"))
    if len(names) < 2:
        raise GalleyError(f"{run}: has {len(names)} checkpoints; comparing takes at least 2")
    places = np.unique(np.linspace(0, len(names) - 1, min(CHECKPOINTS, len(names))).round().astype(int))
    torch.set_num_threads(1)
    machine = Machine(torch.device("cpu"), threads)
    chosen = [names[place] for place in places]
    policies = [load_policy(run / "members" / f"{name}.pt", layout, machine.device) for name in chosen]
    table = PayoffTable(chosen)
    scores = games_among(layout, policies, games, seed, machine, tell)
    for row, column in np.ndindex(len(policies), len(policies)):
        table.measure(row, column, scores[row, column])
    table.save(run / "payoffs.npz")
    return table
