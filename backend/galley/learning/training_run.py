"""A training run: made from its options, done from where it is to its end, with a bar."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol

import torch
from torch.utils.tensorboard import SummaryWriter
from tqdm import tqdm

from galley.kitchen import Layout
from galley.learning.methods.table import METHODS, Start
from galley.learning.options import TrainingOptions
from galley.learning.policy_files import TorchStates, load_policy, self_play_milestones
from galley.learning.ppo.forwards import machine_for
from galley.learning.ppo.policy import Policy
from galley.learning.run_settings import ppo_settings, run_description
from galley.learning.torch_process import prepare_process
from galley.learning.training_log import COLUMNS, FORMER_COLUMNS
from galley.runs.provenance import provenance
from galley.runs.run_folder import RunFolder
from galley.runs.stepwise import Stepwise, run_to_end


class Training(Stepwise[Policy], Protocol):
    """A method of training at work; its members are the policies that joined its population."""

    def best(self) -> Policy:
        """The policy that the run is for."""


class TrainingFolder(RunFolder):
    """A run folder whose states are PyTorch's and whose log goes to TensorBoard too, in `board/`.

    Raises:
        GalleyError: the folder holds a run with other settings.
    """

    def __init__(self, path: Path, settings: Mapping[str, Any]) -> None:
        gpu = torch.cuda.get_device_name() if settings.get("device") == "cuda" else ""
        super().__init__(
            path, settings, columns=COLUMNS, former=FORMER_COLUMNS, states=TorchStates(),
            provenance=provenance({"torch": torch.__version__}, gpu),
        )  # fmt: skip
        self._board: SummaryWriter | None = None

    def log(self, row: Mapping[str, Any]) -> None:
        """Add a row to the log and to TensorBoard; other keys than the log's columns are left out."""
        super().log(row)
        if self._board is None:
            self._board = SummaryWriter(str(self.path / "board"), purge_step=int(row["ticks"]))
        for name, value in row.items():
            if isinstance(value, float) and name in COLUMNS:
                self._board.add_scalar(name, value, int(row["ticks"]))


def make_training(options: TrainingOptions, layout: Layout) -> Training:
    """The training that was asked for, at its beginning.

    Raises:
        GalleyError: something asked for cannot be; told with the fix, before anything is trained.
    """
    settings, total = ppo_settings(options)
    machine = machine_for(options.device, options.threads, bf16=options.bf16)
    start = Start(
        options, layout, settings, max(1, round(total / settings.ticks)), machine,
        self_play_milestones(options.pool, layout, machine.device),
    )  # fmt: skip
    return METHODS[options.method].make(start)


def train_to_end(
    training: Training,
    folder: RunFolder,
    layout: Layout,
    device: torch.device,
    *,
    save_every_s: float = 20.0,
    tell: Callable[[float, dict[str, Any]], None] = lambda share, row: None,
) -> Policy:
    """The policy that `training` ends with; goes on from the state in `folder` if there is one."""
    run_to_end(
        training,
        folder,
        pack=lambda policy: policy.state_dict(),
        unpack=lambda name: load_policy(folder.member_path(name), layout, device),
        save_every_s=save_every_s,
        tell=tell,
    )
    return training.best()


def train_run(options: TrainingOptions, layout: Layout, path: Path) -> Policy:
    """The policy of the run that was asked for, also kept as member `best`; goes on with what is in `path`.

    Raises:
        GalleyError: something asked for cannot be, `path` holds another run, or another process trains there.
    """
    prepare_process()
    training = make_training(options, layout)
    folder = TrainingFolder(path, run_description(options))
    form = "{percentage:5.1f}%|{bar}| {elapsed}<{remaining} {postfix}"
    with folder.lock("trains"), tqdm(total=1.0, bar_format=form) as bar:

        def tell(share: float, row: dict[str, Any]) -> None:
            bar.n = share
            bar.set_postfix_str(f"{row['stage']} {row['generation']} score {row['score']:.1f}")

        policy = train_to_end(training, folder, layout, torch.device(options.device), tell=tell)
        folder.keep("best", policy.state_dict())
    return policy
