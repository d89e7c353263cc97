"""What a row or column of a table stands for: one agent, or several seeds of one method."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from galley.errors import GalleyError
from galley.evaluation.game_scores import GameScores, MeanScore

ITSELF: Final = "itself"


@dataclass(frozen=True)
class AgentGroup:
    """A label and the names of its agents."""

    label: str
    members: tuple[str, ...]


@dataclass(frozen=True)
class Seats:
    """Scores with a partner: of the entry on seat 0 (L), on seat 1 (R), and the mean of both.

    L and R name the seats as the paper does, whatever side of the picture they start on.
    """

    left: MeanScore
    right: MeanScore
    average: MeanScore


def agent_group(text: str) -> AgentGroup:
    """The entry written as `NAME`, `LABEL=NAME` or `LABEL=NAME,NAME`; a folder is labelled by its last part.

    Raises:
        GalleyError: a name or the label is empty, or an agent is named twice.
    """
    label, equals, names = text.partition("=")
    members = tuple(name.strip() for name in (names if equals else label).split(","))
    if not all(members) or not label.strip():
        raise GalleyError(f"'{text}' names no agent; write NAME, or LABEL=NAME,NAME for seeds of one method")
    if len(set(members)) < len(members):
        raise GalleyError(f"'{text}' names an agent twice; name each seed once")
    if not equals and len(members) > 1:
        raise GalleyError(f"'{text}' needs a label; write LABEL={text}")
    return AgentGroup(label.strip() if equals else members[0].rstrip("/").rsplit("/", 1)[-1], members)


def agent_groups(texts: Iterable[str]) -> tuple[AgentGroup, ...]:
    """The entries, each as `entry` reads it.

    Raises:
        GalleyError: as `entry`; two entries have one label.
    """
    found = tuple(agent_group(text) for text in texts)
    labels = [one.label for one in found]
    twice = {label for label in labels if labels.count(label) > 1}
    if twice:
        raise GalleyError(f"{', '.join(sorted(twice))}: named twice; give each row and column its own label")
    return found


def with_partner(results: GameScores, layout: str, one: AgentGroup, partner: AgentGroup) -> Seats:
    """How an entry does with a partner; an entry with itself means each of its agents with itself.

    Raises:
        GalleyError: the games were not played.
    """
    if one.members == partner.members:
        alone = [[results.cell(layout, name, name).mean_score] for name in one.members]
        figure = over_members(alone)
        return Seats(figure, figure, figure)
    left = [
        [results.cell(layout, name, other).mean_score for other in partner.members] for name in one.members
    ]
    right = [
        [results.cell(layout, other, name).mean_score for other in partner.members] for name in one.members
    ]
    both = [[*on_left, *on_right] for on_left, on_right in zip(left, right, strict=True)]
    return Seats(over_members(left), over_members(right), over_members(both))


def with_others(
    results: GameScores, layout: str, one: AgentGroup, everyone: Sequence[AgentGroup]
) -> MeanScore:
    """How an entry does with all others, each of them and both seats counted alike.

    Source: COLE, Table 2.

    Raises:
        GalleyError: the games were not played, or there is no other.
    """
    others = [other for other in everyone if other.members != one.members]
    if not others:
        raise GalleyError(f"{one.label} has no other to play with; name at least two agents")
    rows = []
    for name in one.members:
        alone = AgentGroup(name, (name,))
        rows.append([with_partner(results, layout, alone, other).average for other in others])
    return over_members(rows)


def over_members(rows: Sequence[Sequence[MeanScore]]) -> MeanScore:
    """From the figures of each member (averaged first) to the figure of their entry.

    The standard error of a single member is that over its games; of several, that over the members, as the
    paper's over five seeds.
    """
    means = [mean_of(row) for row in rows]
    if len(means) == 1:
        return means[0]
    values = [figure.mean for figure in means]
    return MeanScore(float(np.mean(values)), float(np.std(values, ddof=1) / np.sqrt(len(values))))


def mean_of(figures: Sequence[MeanScore]) -> MeanScore:
    """The mean of independent figures, each counted alike."""
    errors = [figure.standard_error for figure in figures]
    return MeanScore(
        float(np.mean([figure.mean for figure in figures])),
        float(np.sqrt(np.sum(np.square(errors))) / len(errors)),
    )
