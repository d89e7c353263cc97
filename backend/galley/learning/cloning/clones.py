"""`galley learn bc`: clones of people, one network per layout, as an agent bundle."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from galley.agents.bundle import describe_network, load_bundle
from galley.agents.episode import play_episodes
from galley.datasets.overcooked_games import HumanGame, human_games
from galley.errors import GalleyError
from galley.evaluation.game_scores import MeanScore
from galley.files.whole import whole_folder
from galley.kitchen import Encoder, Layout
from galley.kitchen.layout_file import find_layout
from galley.learning.bundles.onnx_writing import dense_onnx
from galley.learning.cloning.clone_card import SEED, CardRow, card
from galley.learning.cloning.training import Clone, CloningSettings, train_clone
from galley.workspace import Workspace

Split = Literal["train", "test"]

ENCODING: Final = "overcooked-2019-features"
UNSTUCK_AFTER_TICKS: Final = 3

BUNDLES: Final[Mapping[Split, str]] = {"train": "human-bc", "test": "human-proxy"}
"""The agent that each split of the human data makes."""

EPOCHS: Final[Mapping[str, int]] = {
    "cramped_room": 100,
    "asymmetric_advantages": 120,
    "coordination_ring": 120,
    "forced_coordination": 90,
    "counter_circuit": 110,
}
"""Passes per layout. Source: the published code of Carroll et al. 2019, clones of either split."""


def learn_bc(
    workspace: Path,
    *,
    data: Path | None = None,
    split: Split,
    seed: int = SEED,
    games: int = 100,
    out: Path | None = None,
    tell: Callable[[str], None] = lambda line: None,
) -> tuple[CardRow, ...]:
    """What came out on each layout; writes clones of one split of the human data as a bundle with its card.

    `data` is `clean_train_trials.pickle` or `clean_test_trials.pickle` of the `overcooked-ai` 1.1.0 package,
    or a folder that holds them, by default `.cache/overcooked-ai` of the workspace. The bundle goes to `out`,
    by default `agents/human-bc` (train) or `agents/human-proxy` (test) of the workspace. Each clone plays
    `games` games with itself; `tell` gets lines about the progress.

    Raises:
        GalleyError: the data cannot be found or read.
    """
    place = Workspace(workspace)
    path = find_pickle(data or place.path / ".cache" / "overcooked-ai", split)
    home = out or place.folder("agents") / BUNDLES[split]
    recorded: dict[str, list[HumanGame]] = {}
    for game in human_games(path):
        recorded.setdefault(game.layout.name, []).append(game)
    missing = set(EPOCHS) - set(recorded)
    if missing:
        raise GalleyError(
            f"{path}: holds no game on {' '.join(sorted(missing))}; use the file of version 1.1.0"
        )
    with whole_folder(home.resolve(), replace=True, kept=True) as folder:
        clones = {}
        for number, (name, epochs) in enumerate(EPOCHS.items()):
            layout = find_layout(place, name)
            observations, actions = cloning_rows(layout, recorded[name])
            own_seed = int(np.random.SeedSequence((seed, number)).generate_state(1)[0])
            clones[layout] = train_clone(observations, actions, CloningSettings(epochs=epochs), own_seed)
            (folder / f"{name}.onnx").write_bytes(dense_onnx(clones[layout].layers))
            tell(f"{name}: held-out accuracy {clones[layout].held_out_accuracy:.3f}")
        describe_network(
            folder, EPOCHS, encoding=ENCODING, sampling="sample", unstuck_after_ticks=UNSTUCK_AFTER_TICKS
        )
        rows = _self_play(folder, clones, games, seed, tell)
        text = card(
            folder.name,
            split=split,
            seed=seed,
            games=games,
            data_file=path.name,
            data_sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
            rows=rows,
        )
        (folder / "card.md").write_text(text, "utf-8")
    return rows


def find_pickle(data: Path, split: Split) -> Path:
    """The file of one split: `data` itself, or the only file of its name somewhere below the folder `data`.

    Raises:
        GalleyError: there is none, or more than one.
    """
    name = f"clean_{split}_trials.pickle"
    found = [data] if data.name == name and data.is_file() else sorted(data.glob(f"**/{name}"))
    if len(found) != 1:
        raise GalleyError(
            f"{data}: holds {len(found)} files {name}; name the folder human_data of the unpacked "
            "package overcooked-ai 1.1.0 (pip download overcooked-ai==1.1.0 --no-deps)"
        )
    return found[0]


def cloning_rows(layout: Layout, games: Sequence[HumanGame]) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """What both players of all games saw, float32 [2T, 62], and did, uint8 [2T]; stays included."""
    encoder = Encoder(layout, ENCODING)
    seen = [encoder.both(game.states) for game in games]
    observations = np.concatenate([both.transpose(1, 0, 2).reshape(-1, both.shape[2]) for both in seen])
    actions = np.concatenate([game.joint_actions.T.reshape(-1) for game in games])
    return observations.astype(np.float32), actions.astype(np.uint8)


def _self_play(
    folder: Path, clones: Mapping[Layout, Clone], games: int, seed: int, tell: Callable[[str], None]
) -> tuple[CardRow, ...]:
    """A row for the card of each clone, which plays beside itself."""
    bundle = load_bundle(folder, folder.as_posix())
    rows = []
    for number, (layout, clone) in enumerate(clones.items()):
        seeds = np.random.SeedSequence((seed, number, 1)).generate_state(games, np.uint64).tolist()
        played = MeanScore.of(play_episodes(layout, (bundle, bundle), seeds))
        tell(f"{layout.name}: score {played.mean:.1f} ± {played.standard_error:.1f} with itself")
        rows.append(
            CardRow(
                layout=layout.name,
                epochs=EPOCHS[layout.name],
                rows=clone.rows,
                train_accuracy=clone.train_accuracy,
                held_out_accuracy=clone.held_out_accuracy,
                held_out_loss=clone.held_out_loss,
                mean=played.mean,
                standard_error=played.standard_error,
            )
        )
    return tuple(rows)
