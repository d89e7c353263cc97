"""`galley learn export`: finished runs made into an agent that studies can use, with its card."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from galley.agents.bundle import Bundle, describe_network, load_bundle
from galley.agents.catalogue import Catalogue
from galley.agents.episode import play_both_orders, play_episodes
from galley.errors import GalleyError
from galley.evaluation.game_scores import MeanScore
from galley.files.whole import whole_folder
from galley.kitchen import Encoder, Layout
from galley.kitchen.layout_file import find_layout
from galley.learning.bundles.filled_convolutions import filled
from galley.learning.bundles.onnx_writing import grid_onnx
from galley.learning.bundles.training_card import training_card
from galley.learning.methods.table import METHODS
from galley.learning.policy_files import TorchStates, finished_run
from galley.learning.ppo.policy import ENCODING
from galley.workspace import Workspace

FACTS: Final = "training.json"
PROVENANCE: Final = ("commit", "galley", "torch", "processor")
PARTNERS: Final = {"human-bc": 100, "human-proxy": 200}
"""Whom an exported agent is measured with, and games on either seat. The proxy has no say in any choice."""

ITSELF_GAMES: Final = 100


def export(
    workspace: Path,
    runs: Sequence[Path],
    name: str,
    *,
    member: str = "best",
    unstuck_after_ticks: int | None = None,
    seed: int = 0,
    tell: Callable[[str], None] = lambda line: None,
) -> Bundle:
    """The agent `name` of the workspace with the policies of finished runs, one run a layout.

    `member` names another policy of the runs than the final one: a checkpoint, or COLE's strategy of a
    generation. Layouts that the agent has already and no run is given for stay as they are. `training.json`
    beside the networks keeps how each came to be and what it scored; `card.md` tells it.

    Raises:
        GalleyError: a run is not finished, not of one method with the others, or of a layout given twice.
    """
    place = Workspace(workspace)
    asked = [finished_run(run, member) for run in runs]
    methods = sorted({one["method"] for one in asked})
    if len(methods) > 1:
        raise GalleyError(f"an agent comes from one method, not {' and '.join(methods)}; export them apart")
    layouts = [find_layout(place, one["layout"]) for one in asked]
    if len(set(layouts)) < len(layouts):
        raise GalleyError("two of the runs are of one layout; name one run for each layout")
    home = place.folder("agents") / name
    with whole_folder(home, replace=True, kept=True) as folder:
        facts = _facts(folder)
        for run, one, layout in zip(runs, asked, layouts, strict=True):
            policy = TorchStates().read(run / "members" / f"{member}.pt")
            weights = {key: tensor.numpy() for key, tensor in policy.items()}
            content = filled(grid_onnx(weights, Encoder(layout, ENCODING).shape))
            (folder / f"{layout.name}.onnx").write_bytes(content)
            facts[layout.name] = _described(run, one, member)
        describe_network(
            folder, facts, encoding=ENCODING, sampling="sample", unstuck_after_ticks=unstuck_after_ticks
        )
        bundle = load_bundle(folder, home.as_posix())
        for layout in layouts:
            facts[layout.name]["scores"] = _scores(place, bundle, layout, seed, tell)
        (folder / FACTS).write_text(json.dumps(facts, indent=1, sort_keys=True) + "\n", "utf-8")
        (folder / "card.md").write_text(training_card(name, facts, unstuck_after_ticks), "utf-8")
    return load_bundle(home, home.as_posix())


def _described(run: Path, asked: dict[str, Any], member: str) -> dict[str, Any]:
    """What `training.json` keeps of a run, but its scores; `asked` is what its run.json holds."""
    options = {key: value for key, value in asked.items() if key not in PROVENANCE}
    begun = {key: str(asked.get(key, "")) for key in PROVENANCE}
    generation = int(member) if member.isdigit() and METHODS[asked["method"]].generations else None
    facts = {"asked": options, **_made(run, generation), **begun, "member": member}
    pool = [Path(path) for path in asked["pool"]]
    facts["pool"] = [finished_run(path) for path in pool]
    for made in map(_made, pool):
        facts["ticks"] += made["ticks"]
        facts["seconds"] += made["seconds"]
    return facts


def _made(run: Path, generation: int | None = None) -> dict[str, Any]:
    """How far the run went and how long it took, up to a generation of COLE if one is named."""
    with (run / "log.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    if generation is not None:
        rows = [row for row in rows if int(row["generation"]) <= generation]
    return {
        "ticks": max(int(row["ticks"]) for row in rows),
        "seconds": float(rows[-1]["seconds"]),
    }


def _scores(
    place: Workspace, bundle: Bundle, layout: Layout, seed: int, tell: Callable[[str], None]
) -> dict[str, Any]:
    """Mean and standard error with itself, and on seat 0 and seat 1 with each of `PARTNERS`."""
    catalogue = Catalogue(place)
    seeds = np.random.SeedSequence((seed, 1)).generate_state(ITSELF_GAMES, np.uint64).tolist()
    own = MeanScore.of(play_episodes(layout, (bundle, bundle), seeds))
    found: dict[str, Any] = {"itself": [own.mean, own.standard_error, ITSELF_GAMES]}
    told = [f"itself {own.mean:.1f}"]
    for partner, games in PARTNERS.items():
        if partner not in catalogue.names() or not catalogue.bundle(partner).supports(layout.name):
            continue
        results = [
            *map(MeanScore.of, play_both_orders(bundle, catalogue.bundle(partner), layout, games, seed))
        ]
        found[partner] = [[one.mean, one.standard_error, games] for one in results]
        told.append(f"{partner} {results[0].mean:.1f} / {results[1].mean:.1f}")
    tell(f"{layout.name}: {', '.join(told)}")
    return found


def _facts(folder: Path) -> dict[str, Any]:
    path = folder / FACTS
    if not path.is_file():
        return {}
    try:
        found: dict[str, Any] = json.loads(path.read_text("utf-8"))
    except ValueError as error:
        raise GalleyError(f"{path}: is no JSON ({error}); remove the folder and export again") from None
    return found
