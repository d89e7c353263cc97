"""A folder that holds one agent: its description and, for networks, one ONNX file per layout."""

from __future__ import annotations

import hashlib
import io
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import pydantic
from ruamel.yaml import YAML

from galley.agents.network import Network, NetworkAgent, Sampling
from galley.agents.protocol import Agent
from galley.agents.scripted import Random, Stay
from galley.errors import GalleyError, InvalidFiles, Problem
from galley.files.reading import FileModel, Loaded, load
from galley.files.whole import write_whole
from galley.kitchen import ENCODINGS, Encoder, Layout
from galley.names import name_fix
from galley.planning.centralized import Centralized
from galley.planning.myopic import Myopic
from galley.planning.robots import MDP, QMDP

Kind = Literal["network", "planner", "scripted"]

POLICIES: Final[Mapping[str, tuple[Kind, frozenset[str]]]] = {
    "stay": ("scripted", frozenset()),
    "random": ("scripted", frozenset()),
    "myopic": ("planner", frozenset({"epsilon"})),
    "centralized": ("planner", frozenset()),
    "mdp": ("planner", frozenset()),
    "qmdp": ("planner", frozenset()),
}
"""What `params: {policy: NAME}` may name: the kind of agent and the other parameters of each policy."""

_PLAIN: Final[Mapping[str, Callable[[], Agent]]] = {
    "stay": Stay,
    "random": Random,
    "centralized": Centralized,
    "mdp": MDP,
    "qmdp": QMDP,
}
"""The policies without parameters."""

DESCRIPTION_FILE: Final = "agent.yaml"
_FILE: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")


class Description(FileModel):
    """What `agent.yaml` says."""

    format: Literal[1]
    name: str
    kind: Kind
    encoding: str | None = None
    sampling: Sampling | None = None
    unstuck_after_ticks: Literal["none"] | Annotated[int, pydantic.Field(ge=1, le=100)] | None = None
    params: dict[str, str | int | float | bool] = pydantic.Field(default_factory=dict)
    layouts: Literal["any"] | dict[str, str]


@dataclass(frozen=True, eq=False)
class Bundle:
    """One agent of a workspace; `layouts` maps layout names to ONNX files, None means any layout."""

    name: str
    kind: Kind
    layouts: Mapping[str, str] | None
    sha256: str
    path: Path
    loaded: Loaded[Description]
    _networks: dict[Layout, tuple[Network, Encoder]] = field(default_factory=dict, repr=False)

    def supports(self, layout_name: str) -> bool:
        """Whether the agent can play on the layout of this name."""
        return self.layouts is None or layout_name in self.layouts

    def make(self) -> Agent:
        """A fresh agent; all agents of one bundle share its networks."""
        description = self.loaded.value
        if description.sampling is not None:
            after = description.unstuck_after_ticks
            return NetworkAgent(self.network, description.sampling, after if isinstance(after, int) else None)
        params = dict(description.params)
        policy = params.pop("policy")
        if policy == "myopic":
            return Myopic(epsilon=float(params.get("epsilon", 0.0)))
        return _PLAIN[str(policy)]()

    def network(self, layout: Layout) -> tuple[Network, Encoder]:
        """The network for a layout and the encoder of its observations, loaded once.

        Raises:
            GalleyError: the bundle has none for this layout, or it cannot be used.
        """
        if layout not in self._networks:
            if self.layouts is None or layout.name not in self.layouts:
                known = () if self.layouts is None else self.layouts
                raise GalleyError(
                    f"agent {self.name} does not know layout '{layout.name}'; {name_fix(layout.name, known)}"
                )
            encoder = Encoder(layout, str(self.loaded.value.encoding))
            path = self.path / self.layouts[layout.name]
            try:
                self._networks[layout] = (Network(path, tuple(encoder.shape)), encoder)
            except GalleyError as error:
                raise InvalidFiles([self.network_problem(layout.name, str(error))]) from None
        return self._networks[layout]

    def network_problem(self, layout_name: str, message: str) -> Problem:
        """A problem with the network of one layout, at its line in agent.yaml."""
        named = "" if self.layouts is None else f"{self.layouts.get(layout_name, '')}: "
        return self.loaded.problem(
            ("layouts", layout_name), named + message, "export the network again, see docs/add-an-agent.md"
        )


def describe_network(
    folder: Path,
    layouts: Iterable[str],
    *,
    encoding: str,
    sampling: Sampling,
    unstuck_after_ticks: int | None,
) -> None:
    """Write `agent.yaml` of a network whose `folder` holds `LAYOUT.onnx` for each of the layouts."""
    description = Description(
        format=1,
        name=folder.name,
        kind="network",
        encoding=encoding,
        sampling=sampling,
        unstuck_after_ticks="none" if unstuck_after_ticks is None else unstuck_after_ticks,
        layouts={layout: f"{layout}.onnx" for layout in layouts},
    )
    text = io.StringIO()
    YAML().dump(description.model_dump(exclude_unset=True), text)
    write_whole(folder / DESCRIPTION_FILE, text.getvalue())


def load_bundle(folder: Path, shown: str) -> Bundle:
    """The agent in a folder; messages call the folder `shown`. Networks are loaded when first needed.

    Raises:
        InvalidFiles: everything that is wrong with agent.yaml and the files that it names.
    """
    loaded = load(folder / DESCRIPTION_FILE, Description, f"{shown}/{DESCRIPTION_FILE}")
    problems = [*_problems(loaded, folder)]
    if problems:
        raise InvalidFiles(problems)
    description = loaded.value
    layouts = None if description.layouts == "any" else dict(description.layouts)
    return Bundle(description.name, description.kind, layouts, _sha256(folder), folder, loaded)


def _problems(loaded: Loaded[Description], folder: Path) -> list[Problem]:
    description = loaded.value
    told: list[tuple[tuple[str, ...], str, str]] = []
    if description.name != folder.name:
        told.append(
            (("name",), f"name '{description.name}' is not that of the folder", f"write name: {folder.name}")
        )
    told += (
        _network_faults(description, folder) if description.kind == "network" else _policy_faults(description)
    )
    return [loaded.problem(*one) for one in told]


def _network_faults(description: Description, folder: Path) -> list[tuple[tuple[str, ...], str, str]]:
    told: list[tuple[tuple[str, ...], str, str]] = []
    wanted: dict[str, tuple[Any, str]] = {
        "encoding": (description.encoding, f"one of {' '.join(ENCODINGS)}"),
        "sampling": (description.sampling, "sample or argmax"),
        "unstuck_after_ticks": (description.unstuck_after_ticks, "a number of ticks, or none"),
    }
    for key, (value, fix) in wanted.items():
        if value is None:
            told.append(((), f"a network needs the key '{key}'", f"add {key}: {fix}"))
    if description.encoding is not None and description.encoding not in ENCODINGS:
        fix = name_fix(description.encoding, ENCODINGS)
        told.append((("encoding",), f"encoding '{description.encoding}' is unknown", fix))
    if description.params:
        told.append((("params",), "a network has no params", "remove the key"))
    if description.layouts == "any" or not description.layouts:
        told.append(
            (("layouts",), "a network needs a file for each layout", "write `layout: file.onnx` lines")
        )
        return told
    for layout, file in description.layouts.items():
        if not _FILE.fullmatch(file):
            told.append(
                (("layouts", layout), f"'{file}' is no plain file name", "put the file beside agent.yaml")
            )
        elif not (folder / file).is_file():
            fix = name_fix(file, [path.name for path in folder.glob("*.onnx")])
            told.append((("layouts", layout), f"there is no file {file}", fix))
    return told


def _policy_faults(description: Description) -> list[tuple[tuple[str, ...], str, str]]:
    told: list[tuple[tuple[str, ...], str, str]] = []
    for key in ("encoding", "sampling", "unstuck_after_ticks"):
        if getattr(description, key) is not None:
            told.append(((key,), f"a {description.kind} agent has no '{key}'", "remove the key"))
    if description.layouts != "any":
        told.append((("layouts",), f"a {description.kind} agent has no files", "write layouts: any"))
    named = description.params.get("policy")
    known = [name for name, (kind, _) in POLICIES.items() if kind == description.kind]
    if named is None:
        told.append((("params",), "no policy is named", f"add params: {{policy: {known[0]}}}"))
    elif named not in known:
        fix = name_fix(named, known)
        told.append((("params", "policy"), f"no {description.kind} policy is named '{named}'", fix))
    else:
        told += _param_faults(description.params, POLICIES[str(named)][1])
    return told


def _param_faults(params: Mapping[str, Any], known: frozenset[str]) -> list[tuple[tuple[str, ...], str, str]]:
    told: list[tuple[tuple[str, ...], str, str]] = []
    for key in params:
        if key != "policy" and key not in known:
            told.append((("params", key), f"the policy has no parameter '{key}'", name_fix(key, known)))
    epsilon = params.get("epsilon", 0)
    good = isinstance(epsilon, (int, float)) and not isinstance(epsilon, bool) and 0 <= epsilon <= 1
    if "epsilon" in known and not good:
        told.append((("params", "epsilon"), f"epsilon is {epsilon!r}", "write a number from 0 to 1"))
    return told


def _sha256(folder: Path) -> str:
    """The hash of names and contents of all files in the folder, hidden ones left out."""
    total = hashlib.sha256()
    for path in sorted(path for path in folder.iterdir() if path.is_file() and not path.name.startswith(".")):
        content = path.read_bytes()
        total.update(f"{path.name}\0{len(content)}\0".encode())
        total.update(content)
    return total.hexdigest()
