"""The card of an agent that was brought in: where it comes from and what the gate measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.metadata import version

from galley.agents.admission.gate import GATE_TICKS, KITCHENS, Figures


def card(
    name: str,
    *,
    sources: Mapping[str, tuple[str, str]],
    notes: Mapping[str, tuple[str, ...]],
    command: str,
    encoding: str,
    sampling: str,
    unstuck_after_ticks: int | None,
    figures: Sequence[Figures],
) -> str:
    """The text of `card.md`; `sources` holds file name and SHA-256 for each layout."""
    unstuck = (
        "no unstuck rule"
        if unstuck_after_ticks is None
        else f"stuck for {unstuck_after_ticks} ticks, the actions of those ticks are barred"
    )
    files = "\n".join(f"| {layout} | `{file}` | `{sha256}` |" for layout, (file, sha256) in sources.items())
    rows = "\n".join(_row(one) for one in figures)
    acting = "actions are sampled" if sampling == "sample" else "the most probable action is taken"
    columns = (
        "layout",
        "score with itself",
        "decision, median ms",
        "99th percentile ms",
        f"one of {2 * KITCHENS} at once, ms",
        "batch and row apart",
    )
    return f"""# {name}

Brought in from elsewhere. Write here what it is: data, training, seed, commit, scores.

- **Command**: `{command}`,
  galley {version("galley")}, ONNX Runtime {version("onnxruntime")}.
- **Acting**: encoding `{encoding}`; {acting}; {unstuck}.
- **Changed on the way in**: {_changes(notes)}

| layout | file | SHA-256 |
|---|---|---|
{files}

## At the gate

| {" | ".join(columns)} |
|---|---|---|---|---|---|
{rows}

One game of {GATE_TICKS} ticks with itself, both seats, and {KITCHENS} kitchens whose chefs act at random.
Times are processor time of the machine that added it.
"""


def _changes(notes: Mapping[str, tuple[str, ...]]) -> str:
    told = [(layout, note) for layout, all_notes in notes.items() for note in all_notes]
    if not told:
        return "nothing; the files are as they came."
    everywhere = [
        note
        for note in dict.fromkeys(note for _, note in told)
        if all(note in all_notes for all_notes in notes.values())
    ]
    elsewhere = [f"{layout}: {note}" for layout, note in told if note not in everywhere]
    return "; ".join([*everywhere, *elsewhere]) + "."


def _row(one: Figures) -> str:
    times = f"{one.decision_p50_ms:.3f} | {one.decision_p99_ms:.3f} | {one.batched_ms:.3f}"
    return f"| {one.layout} | {one.score} | {times} | {one.apart:.2g} |"
