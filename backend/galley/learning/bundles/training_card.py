"""The card of a trained agent: how each network came to be and what it scores."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

from galley.learning.methods.table import METHODS
from galley.learning.options import TrainingOptions, train_command
from galley.learning.run_settings import ppo_settings


def training_card(name: str, facts: Mapping[str, Any], unstuck_after_ticks: int | None) -> str:
    """The text of `card.md`; `facts` is what `training.json` holds, by layout."""
    first = next(iter(facts.values()))
    method = METHODS[first["asked"]["method"]]
    unstuck = (
        ""
        if unstuck_after_ticks is None
        else (f"; stuck for {unstuck_after_ticks} ticks, the actions of those ticks are barred")
    )
    made = "\n".join(_made_row(layout, one) for layout, one in facts.items())
    scored = "\n".join(_scored_row(layout, one) for layout, one in facts.items())
    asked = [options for one in facts.values() for options in (*one.get("pool", ()), one["asked"])]
    commands = "\n".join(map(command, asked))
    return f"""# {name}

{method.title}. Source: {method.source}. The method and its constants are told in `docs/learning.md`.

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
    return train_command({**asked, "changes": _changes(asked)})


def _changes(asked: Mapping[str, Any]) -> dict[str, float]:
    """The constants that were asked for, and those whose defaults were others when the run was made."""
    changes: dict[str, float] = dict(asked["changes"])
    known = {field.name: asked[field.name] for field in fields(TrainingOptions) if field.name in asked}
    known |= {"changes": tuple(sorted(changes.items())), "pool": tuple(asked["pool"])}
    today = asdict(ppo_settings(TrainingOptions(**known))[0])
    return changes | {name: value for name, value in asked["ppo"].items() if today[name] != value}


def _made_row(layout: str, one: Mapping[str, Any]) -> str:
    share = one["ticks"] / METHODS[one["asked"]["method"]].source_ticks(layout)
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
