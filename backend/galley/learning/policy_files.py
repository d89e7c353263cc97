"""Policies and states of runs as PyTorch's files."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import torch

from galley.errors import GalleyError
from galley.files.whole import whole_file
from galley.kitchen import Layout
from galley.learning.methods.milestones import STAGES
from galley.learning.ppo.policy import Policy
from galley.names import name_fix
from galley.runs.state_file import unreadable


class TorchStates:
    """`.pt`: tensors, numbers and texts in dicts and lists, as `torch.save` writes them."""

    ending = ".pt"

    def write(self, path: Path, content: Mapping[str, Any]) -> None:
        """Write a file that `torch.load` reads, whole or not at all."""
        with whole_file(path) as file:
            torch.save(dict(content), file)

    def read(self, path: Path) -> dict[str, Any]:
        """What was written to `path`; no code in the file is run.

        Raises:
            GalleyError: the file is missing or damaged.
        """
        try:
            found: dict[str, Any] = torch.load(path, map_location="cpu", weights_only=True)
        except FileNotFoundError:
            raise GalleyError(f"{path}: there is no such file") from None
        except Exception as error:  # damaged files raise many things
            raise unreadable(path, error) from None
        return found


def load_policy(path: Path, layout: Layout, device: torch.device) -> Policy:
    """A policy of a run, to play with.

    Raises:
        GalleyError: the file is missing or damaged, or holds weights of another shape.
    """
    policy = Policy(layout).to(device)
    weights = TorchStates().read(path)
    own = policy.state_dict()
    if set(own) != set(weights) or any(own[key].shape != weights[key].shape for key in own):
        raise GalleyError(
            f"{path}: its weights do not fit layout {layout.name} with encoding grid; "
            "name a policy that was trained there"
        )
    policy.load_state_dict(weights)
    return policy.requires_grad_(False)


def finished_run(path: Path, member: str = "best") -> dict[str, Any]:
    """What `run.json` says of the run in a folder; of a finished run, where no other member is named.

    Raises:
        GalleyError: the folder holds no run, or one that has no such member.
    """
    described = path / "run.json"
    if not described.is_file():
        raise GalleyError(f"{path}: is no run (there is no run.json); name a folder that `learn train` made")
    if not (path / "members" / f"{member}.pt").is_file():
        if member == "best":
            raise GalleyError(f"{path}: the run is not finished; give the command again that began it")
        known = sorted(one.stem for one in (path / "members").glob("*.pt"))
        raise GalleyError(f"{path}: has no member {member!r}; {name_fix(member, known)}")
    found: dict[str, Any] = json.loads(described.read_text("utf-8"))
    return found


def self_play_milestones(runs: Sequence[str], layout: Layout, device: torch.device) -> dict[str, Policy]:
    """The milestones of finished self-play runs, by run and stage.

    Raises:
        GalleyError: a folder is no such run, of another layout, or not finished.
    """
    found = {}
    for run in map(Path, runs):
        options = finished_run(run)
        if options["method"] != "sp" or options["layout"] != layout.name:
            raise GalleyError(
                f"{run}: is a run of {options['method']} on {options['layout']}; "
                f"the pool wants finished runs of sp on {layout.name}"
            )
        for stage in STAGES:
            found[f"{run.name}-{stage}"] = load_policy(run / "members" / f"{stage}.pt", layout, device)
    return found
