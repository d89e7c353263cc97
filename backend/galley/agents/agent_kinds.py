"""The kinds of agents that `kind:` of an `agent.yaml` may name, one row each."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from galley.agents.network import NetworkAgent
from galley.agents.protocol import Agent
from galley.agents.scripted import Random, Stay
from galley.kitchen import ENCODINGS
from galley.names import name_fix
from galley.planning.centralized import Centralized
from galley.planning.myopic import Myopic
from galley.planning.robots import MDP, QMDP

if TYPE_CHECKING:
    from galley.agents.bundle import Bundle, Description

Fault = tuple[tuple[str, ...], str, str]
"""Something wrong with an agent.yaml: the keys that lead there, what, and how to mend it."""

_FILE: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")


@dataclass(frozen=True)
class AgentKind:
    """What is wrong with a description and the files of its folder, and a fresh agent of a bundle."""

    faults: Callable[[Description, Path], list[Fault]]
    make: Callable[[Bundle], Agent]


@dataclass(frozen=True)
class Policy:
    """A policy in code: the kind of agent that it makes, how, and the parameters that it takes."""

    kind: str
    make: Callable[..., Agent]
    params: frozenset[str] = frozenset()


def _myopic(epsilon: float = 0.0) -> Agent:
    return Myopic(epsilon=float(epsilon))


POLICIES: Final[Mapping[str, Policy]] = {
    "stay": Policy("scripted", Stay),
    "random": Policy("scripted", Random),
    "myopic": Policy("planner", _myopic, frozenset({"epsilon"})),
    "centralized": Policy("planner", Centralized),
    "mdp": Policy("planner", MDP),
    "qmdp": Policy("planner", QMDP),
}
"""What `params: {policy: NAME}` may name."""


def _network(bundle: Bundle) -> Agent:
    description = bundle.loaded.value
    after = description.unstuck_after_ticks
    sampling = description.sampling or "sample"
    return NetworkAgent(bundle.network, sampling, after if isinstance(after, int) else None)


def _policy(bundle: Bundle) -> Agent:
    params = dict(bundle.loaded.value.params)
    return POLICIES[str(params.pop("policy"))].make(**params)


def _network_faults(description: Description, folder: Path) -> list[Fault]:
    told: list[Fault] = []
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
    return told + file_faults(description.layouts, folder, ".onnx")


def file_faults(files: Mapping[str, str], folder: Path, suffix: str) -> list[Fault]:
    """What is wrong with the files of layouts: each has to be one of the folder."""
    told: list[Fault] = []
    for layout, file in files.items():
        if not _FILE.fullmatch(file):
            told.append(
                (("layouts", layout), f"'{file}' is no plain file name", "put the file beside agent.yaml")
            )
        elif not (folder / file).is_file():
            fix = name_fix(file, [path.name for path in folder.glob(f"*{suffix}")])
            told.append((("layouts", layout), f"there is no file {file}", fix))
    return told


def _policy_faults(description: Description, folder: Path) -> list[Fault]:
    told: list[Fault] = []
    for key in ("encoding", "sampling", "unstuck_after_ticks"):
        if getattr(description, key) is not None:
            told.append(((key,), f"a {description.kind} agent has no '{key}'", "remove the key"))
    if description.layouts != "any":
        told.append((("layouts",), f"a {description.kind} agent has no files", "write layouts: any"))
    named = description.params.get("policy")
    known = [name for name, policy in POLICIES.items() if policy.kind == description.kind]
    if named is None:
        told.append((("params",), "no policy is named", f"add params: {{policy: {known[0]}}}"))
    elif named not in known:
        fix = name_fix(named, known)
        told.append((("params", "policy"), f"no {description.kind} policy is named '{named}'", fix))
    else:
        told += _param_faults(description.params, POLICIES[str(named)].params)
    return told


def _param_faults(params: Mapping[str, Any], known: frozenset[str]) -> list[Fault]:
    told: list[Fault] = []
    for key in params:
        if key != "policy" and key not in known:
            told.append((("params", key), f"the policy has no parameter '{key}'", name_fix(key, known)))
    epsilon = params.get("epsilon", 0)
    good = isinstance(epsilon, (int, float)) and not isinstance(epsilon, bool) and 0 <= epsilon <= 1
    if "epsilon" in known and not good:
        told.append((("params", "epsilon"), f"epsilon is {epsilon!r}", "write a number from 0 to 1"))
    return told


KINDS: Final[Mapping[str, AgentKind]] = {
    "network": AgentKind(_network_faults, _network),
    "planner": AgentKind(_policy_faults, _policy),
    "scripted": AgentKind(_policy_faults, _policy),
}
