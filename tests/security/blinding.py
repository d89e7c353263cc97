"""A workspace whose agents go by names that occur nowhere else, and a search for every trace of them."""

from __future__ import annotations

import base64
import hashlib
import random
import shutil
import string
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from galley.agents.catalogue import Catalogue
from galley.workspace import Workspace
from tests.study.workspaces import ROOT, study_workspace

AGENTS = ("human-bc", "myopic", "random", "stay")
SHORTENED = 12
"""Of a hash, so many characters are a trace of it."""
STUDY = """
format: 1
title: Who cooks?
seed: 21
tick_ms: 20
horizon_ticks: 40
countdown_s: 0
abandon_after_s: 5
completion: {code: BLIND-1}
stages:
  - {kind: consent, text: consent}
  - {kind: questionnaire, id: survey, questionnaire: before-game}
  - {kind: instructions, text: instructions}
  - {kind: tutorial, layout: cramped_room, agent: stay}
  - kind: rounds
    agents: [human-bc, myopic, random]
    after_each: after-round
    layouts: [{layout: cramped_room, goal: 20}]
  - {kind: debrief, text: debrief}
"""


@dataclass(frozen=True)
class Blind:
    """A workspace with secret names: `names` maps what the agents were called to what they are called."""

    workspace: Workspace
    names: Mapping[str, str]

    def traces(self) -> dict[str, str]:
        """Every text (lower case) that would tell on an agent, with what it is."""
        found: dict[str, str] = {}
        catalogue = Catalogue(self.workspace)
        for agent, name in self.names.items():
            for text in _disguises(name):
                found[text.lower()] = f"name of {agent}"
            found[catalogue.bundle(name).sha256[:SHORTENED]] = f"hash of {agent}"
            for file in sorted((self.workspace.folder("agents") / name).iterdir()):
                if file.suffix == ".onnx":
                    found[file.stem.lower()] = f"file of {agent}"
                for kind in ("sha256", "sha1", "md5"):
                    digest = hashlib.new(kind, file.read_bytes()).digest()
                    found[digest.hex()[:SHORTENED]] = f"{kind} of {agent}/{file.name}"
                    found[base64.b64encode(digest).decode()[:SHORTENED].lower()] = f"{kind} of {agent}"
        return found


def blind_workspace(folder: Path, seed: int) -> Blind:
    """The repository's workspace with every agent, and every file of its networks, renamed at random."""
    rng = random.Random(seed)
    names = {agent: _secret(rng) for agent in AGENTS}
    text = STUDY
    for agent, name in names.items():
        for before, after in ((f"agent: {agent}}}", f"agent: {name}}}"), (f"{agent},", f"{name},")):
            text = text.replace(before, after)
        text = text.replace(f" {agent}]", f" {name}]")
    workspace = study_workspace(folder, text, "blind")
    shutil.rmtree(workspace.folder("agents"))
    for agent, name in names.items():
        target = workspace.folder("agents") / name
        shutil.copytree(ROOT / "agents" / agent, target)
        about = (target / "agent.yaml").read_text(encoding="utf-8").replace(f"name: {agent}", f"name: {name}")
        for network in sorted(target.glob("*.onnx")):
            renamed = f"{_secret(rng)}.onnx"
            about = about.replace(network.name, renamed)
            network.rename(target / renamed)
        (target / "agent.yaml").write_text(about, encoding="utf-8")
    return Blind(workspace, names)


def _secret(rng: random.Random) -> str:
    return "".join(rng.choices(string.ascii_lowercase, k=16))


def _disguises(name: str) -> Iterator[str]:
    """A name as it is, backwards, and as Base64 whatever stands before it."""
    yield from (name, name[::-1], quote(name))
    for before in range(3):
        coded = base64.b64encode(b"x" * before + name.encode()).decode()
        yield coded[4 if before else 0 : -4]
