"""A folder that holds one agent: its description and, for networks, one ONNX file per layout."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

import pydantic
from ruamel.yaml import YAML

from galley.agents.agent_kinds import KINDS, Fault
from galley.agents.network import Network, Sampling
from galley.agents.protocol import Agent
from galley.errors import GalleyError, InvalidFiles, Problem
from galley.files.reading import FileModel, Loaded, load
from galley.files.whole import write_whole
from galley.kitchen import Encoder, Layout
from galley.names import name_fix

if TYPE_CHECKING:
    Kind = str
else:
    Kind = Literal[tuple(KINDS)]

DESCRIPTION_FILE: Final = "agent.yaml"


class Description(FileModel):
    """What `agent.yaml` says."""

    format: Literal[1]
    name: str
    kind: Kind
    encoding: str | None = None
    sampling: Sampling | None = None
    unstuck_after_ticks: Literal["none"] | Annotated[int, pydantic.Field(ge=1, le=100)] | None = None
    think_ms: Annotated[int, pydantic.Field(ge=1, le=60_000)] | None = None
    repeats: bool = False
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
    limit_s: float | None = None
    _networks: dict[Layout, tuple[Network, Encoder]] = field(default_factory=dict, repr=False)

    def supports(self, layout_name: str) -> bool:
        """Whether the agent can play on the layout of this name."""
        return self.layouts is None or layout_name in self.layouts

    @property
    def think_ms(self) -> int | None:
        """How long the agent may take for a decision, ms; None for one that is always in time."""
        return self.loaded.value.think_ms

    @property
    def repeats(self) -> bool:
        """Whether the agent does again what it decided last while it has not decided anew."""
        return self.loaded.value.repeats

    def make(self) -> Agent:
        """A fresh agent; all agents of one bundle share its networks."""
        return KINDS[self.kind].make(self)

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
                self._networks[layout] = (Network(path, tuple(encoder.shape), self.limit_s), encoder)
            except GalleyError as error:
                raise InvalidFiles([self.network_problem(layout.name, str(error))]) from None
        return self._networks[layout]

    def interrupt(self) -> None:
        """Let whatever its agents' networks do just now fail soon; their next runs are as ever."""
        for network, _ in tuple(self._networks.values()):
            network.interrupt()

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


def load_bundle(folder: Path, shown: str, limit_s: float | None = None) -> Bundle:
    """The agent in a folder; messages call the folder `shown`. Networks are loaded when first needed.

    With `limit_s` a decision of a network that takes longer is given up.

    Raises:
        InvalidFiles: everything that is wrong with agent.yaml and the files that it names.
    """
    loaded = load(folder / DESCRIPTION_FILE, Description, f"{shown}/{DESCRIPTION_FILE}")
    problems = [*_problems(loaded, folder)]
    if problems:
        raise InvalidFiles(problems)
    description = loaded.value
    layouts = None if description.layouts == "any" else dict(description.layouts)
    return Bundle(description.name, description.kind, layouts, _sha256(folder), folder, loaded, limit_s)


def _problems(loaded: Loaded[Description], folder: Path) -> list[Problem]:
    description = loaded.value
    told: list[Fault] = []
    if description.name != folder.name:
        told.append(
            (("name",), f"name '{description.name}' is not that of the folder", f"write name: {folder.name}")
        )
    told += KINDS[description.kind].faults(description, folder)
    return [loaded.problem(*one) for one in told]


def _sha256(folder: Path) -> str:
    """The hash of names and contents of all files in the folder, hidden ones left out."""
    total = hashlib.sha256()
    for path in sorted(path for path in folder.iterdir() if path.is_file() and not path.name.startswith(".")):
        content = path.read_bytes()
        total.update(f"{path.name}\0{len(content)}\0".encode())
        total.update(content)
    return total.hexdigest()
