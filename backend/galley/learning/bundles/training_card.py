"""The card of a trained agent: how each network came to be and what it scores."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any, Final

from galley.learning.asked import Asked, settings_of
from galley.learning.ppo.constants import constants

TITLES: Final[Mapping[str, tuple[str, str]]] = {
    "sp": ("Self-play", "Carroll et al. 2019 (arXiv:1910.05789)"),
    "pbt": ("Population-based training", "Carroll et al. 2019 (arXiv:1910.05789); Jaderberg et al. 2017"),
    "fcp": ("Fictitious co-play", "Strouse et al. 2021 (arXiv:2110.08176)"),
    "mep": ("Maximum-entropy population", "Zhao et al. 2023 (arXiv:2112.11701)"),
    "cole-sv": ("COLE with the graphic Shapley value solver", "COLE paper, Sec. 4 and 5"),
    "cole-r": ("COLE with the reward solver", "COLE paper, Sec. 4 and 5"),
}


def training_card(name: str, facts: Mapping[str, Any], unstuck_after_ticks: int | None) -> str:
    """The text of `card.md`; `facts` is what `training.json` holds, by layout."""
    first = next(iter(facts.values()))
    title, source = TITLES[first["asked"]["method"]]
    unstuck = (
        ""
        if unstuck_after_ticks is None
        else (f"; stuck for {unstuck_after_ticks} ticks, the actions of those ticks are barred")
    )
    made = "\n".join(_made_row(layout, one) for layout, one in facts.items())
    scored = "\n".join(_scored_row(layout, one) for layout, one in facts.items())
    asked = [wish for one in facts.values() for wish in (*one.get("pool", ()), one["asked"])]
    commands = "\n".join(map(command, asked))
    return f"""# {name}

{title}. Source: {source}. The method and its constants are told in `docs/learning.md`.

```sh
{commands}
```

Encoding `grid`; the network of the COLE paper, App. C. Actions are sampled{unstuck}.

| layout | ticks | of the paper's | minutes | processor, threads | seed | PyTorch | commit |
|---|---|---|---|---|---|---|---|
{made}

"Of the paper's" compares kitchen ticks learned from, in all stages of the method, with those of its source
(`docs/learning.md` says how they are counted).

| layout | with itself | with human-bc, seat 0 | seat 1 | with human-proxy, seat 0 | seat 1 |
|---|---|---|---|---|---|
{scored}

Mean scores over 400 ticks ± standard errors; 100 games with itself and on each seat with `human-bc`, 200 on
each seat with `human-proxy`, which was played once, when the agent was finished: nothing was trained, chosen
or tuned by it.
"""


def command(asked: Mapping[str, Any]) -> str:
    """The command that asks for a run."""
    words = [f"galley learn train {asked['method']} --layout {asked['layout']} --seed {asked['seed']}"]
    words += ["--quick"] if asked["quick"] else []
    words += [f"--scale {asked['scale']:g}"] if asked["scale"] != 1 else []
    if asked["method"].startswith("cole"):
        words += [f"--ratio {asked['ratio']}"] if asked["ratio"] != "1:3" else []
        words += [] if asked["weighted"] else ["--no-wpg"]
        words += [] if asked["exploration"] else ["--no-sucg"]
    for option in ("partners", "generations", "generation_updates", "population"):
        if asked.get(option) is not None:
            words.append(f"--{option.replace('_', '-')} {asked[option]}")
    words += [f"--pool {run}" for run in asked["pool"]]
    response = asked.get("response", Asked.response)
    words += [f"--response {response:g}"] if response != Asked.response else []
    words += [f"--set {key}={value:g}" for key, value in _changes(asked).items()]
    words.append(f"--threads {asked['threads']}")
    words += [f"--device {asked['device']}"] if asked["device"] != "cpu" else []
    words += ["--bf16"] if asked["bf16"] else []
    return " ".join(words)


def _changes(asked: Mapping[str, Any]) -> dict[str, float]:
    """The constants that were asked for, and those whose defaults were others when the run was made."""
    changes: dict[str, float] = dict(asked["changes"])
    known = {field.name: asked[field.name] for field in fields(Asked) if field.name in asked}
    known |= {"changes": tuple(sorted(changes.items())), "pool": tuple(asked["pool"])}
    today = asdict(settings_of(Asked(**known))[0])
    return changes | {name: value for name, value in asked["ppo"].items() if today[name] != value}


def paper_ticks(method: str, layout: str) -> float:
    """Kitchen ticks that the method's source learns from on a layout, all stages together."""
    known = constants(layout)
    if method.startswith("cole"):
        return known.cole_generations * 10 * 48_000
    if method == "pbt":
        return 3 * known.pbt_ticks
    if method == "sp":
        return known.self_play_ticks
    return {"fcp": 10.0, "mep": 7.0}[method] * known.self_play_ticks


def _made_row(layout: str, one: Mapping[str, Any]) -> str:
    share = one["ticks"] / paper_ticks(one["asked"]["method"], layout)
    member = one.get("member", "best")
    cells = (
        layout if member == "best" else f"{layout}, member {member}",
        f"{one['ticks']:,}",
        f"{share:.0%}",
        f"{one['seconds'] / 60:.0f}",
        f"{one['processor']}, {one['asked']['threads']}",
        str(one["asked"]["seed"]),
        one["torch"],
        one["commit"],
    )
    return f"| {' | '.join(cells)} |"


def _scored_row(layout: str, one: Mapping[str, Any]) -> str:
    scores = one["scores"]
    cells = [_score(scores["itself"])]
    for partner in ("human-bc", "human-proxy"):
        cells += [_score(seat) for seat in scores[partner]] if partner in scores else ["", ""]
    return f"| {layout} | {' | '.join(cells)} |"


def _score(score: tuple[float, float, int]) -> str:
    return f"{score[0]:.1f} ± {score[1]:.1f}"
