"""Evaluations as the paper's tables, in Markdown, which a terminal shows as well."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from galley.evaluation.agent_groups import ITSELF, AgentGroup, Seats, with_others, with_partner
from galley.evaluation.game_scores import GameScores, MeanScore


def report(
    results: GameScores,
    layouts: Sequence[str],
    agents: Sequence[AgentGroup],
    partners: Sequence[AgentGroup] | None,
    itself: bool,
) -> str:
    """All tables of an evaluation: one by seats for each partner, or cross-play and means with all others.

    `partners` None means that the agents played each other; `itself` adds how each does with itself.
    """
    parts = []
    if partners is None:
        parts += [cross_table(results, layout, agents) for layout in layouts]
        if len(agents) > 1:
            parts.append(expert_table(results, layouts, agents))
    else:
        parts += [seat_table(results, layouts, agents, partner) for partner in partners]
        if itself:
            parts.append(self_table(results, layouts, agents))
    return "\n\n".join(parts)


def seat_table(
    results: GameScores, layouts: Sequence[str], agents: Sequence[AgentGroup], partner: AgentGroup
) -> str:
    """Scores with one partner, for each agent on seat 0 (L), on seat 1 (R) and the mean of both (AVG).

    Source: the form of COLE, Table 3.
    """
    rows = []
    for agent in agents:
        found = [with_partner(results, layout, agent, partner) for layout in layouts]
        for name, part in (("L", "left"), ("R", "right"), ("AVG", "average")):
            label = agent.label if part == "left" else ""
            rows.append([label, name, *(_shown(getattr(seats, part)) for seats in found)])
    title = f"With {partner.label}: mean score (standard error)"
    return f"{title}\n\n{_table(['agent', 'seat', *layouts], rows)}"


def self_table(results: GameScores, layouts: Sequence[str], agents: Sequence[AgentGroup]) -> str:
    """Scores of each agent with itself."""
    rows = [
        [agent.label, *(_shown(with_partner(results, layout, agent, agent).average) for layout in layouts)]
        for agent in agents
    ]
    return f"With itself: mean score (standard error)\n\n{_table(['agent', *layouts], rows)}"


def cross_table(results: GameScores, layout: str, agents: Sequence[AgentGroup]) -> str:
    """Scores of each agent with each on one layout, means of both seats, and its mean with all others."""
    rows = []
    for agent in agents:
        cells = [_shown(with_partner(results, layout, agent, other).average) for other in agents]
        if len(agents) > 1:
            cells.append(_shown(with_others(results, layout, agent, agents)))
        rows.append([agent.label, *cells])
    head = [layout, *(agent.label for agent in agents), *(["others"] if len(agents) > 1 else [])]
    return _table(head, rows)


def expert_table(results: GameScores, layouts: Sequence[str], agents: Sequence[AgentGroup]) -> str:
    """Mean scores of each agent with all others, both seats, the best of a layout in bold.

    Source: the form of COLE, Table 2.
    """
    rows = []
    for layout in layouts:
        figures = [with_others(results, layout, agent, agents) for agent in agents]
        best = max(figure.mean for figure in figures)
        rows.append([layout, *(_shown(figure, bold=figure.mean == best) for figure in figures)])
    title = "With all others: mean score (standard error)"
    return f"{title}\n\n{_table(['layout', *(agent.label for agent in agents)], rows)}"


def as_rows(
    results: GameScores,
    layouts: Sequence[str],
    agents: Sequence[AgentGroup],
    partners: Sequence[AgentGroup] | None,
    itself: bool,
) -> Iterator[dict[str, Any]]:
    """One JSON object for each layout, agent and partner: scores by seat, their mean, and standard errors."""
    for layout in layouts:
        for agent in agents:
            for partner in agents if partners is None else partners:
                alone = partner.members == agent.members
                seats = with_partner(results, layout, agent, partner)
                yield _row(layout, agent, ITSELF if alone else partner.label, seats)
            if partners is not None and itself and all(one.members != agent.members for one in partners):
                yield _row(layout, agent, ITSELF, with_partner(results, layout, agent, agent))
            if partners is None and len(agents) > 1:
                figure = with_others(results, layout, agent, agents).as_json()
                yield {"layout": layout, "agent": agent.label, "partner": "others", "average": figure}


def _row(layout: str, agent: AgentGroup, partner: str, seats: Seats) -> dict[str, Any]:
    return {
        "layout": layout,
        "agent": agent.label,
        "partner": partner,
        "left": seats.left.as_json(),
        "right": seats.right.as_json(),
        "average": seats.average.as_json(),
    }


def _shown(figure: MeanScore, bold: bool = False) -> str:
    mean = f"**{figure.mean:.1f}**" if bold else f"{figure.mean:.1f}"
    return f"{mean} ({figure.standard_error:.1f})"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table whose columns stand below each other: the first to the left, numbers to the right."""
    widths = [max(len(row[place]) for row in (head, *rows)) for place in range(len(head))]

    def line(cells: Sequence[str]) -> str:
        padded = [
            cell.ljust(width) if place == 0 else cell.rjust(width)
            for place, (cell, width) in enumerate(zip(cells, widths, strict=True))
        ]
        return f"| {' | '.join(padded)} |"

    rule = ["-" * widths[0], *("-" * (width - 1) + ":" for width in widths[1:])]
    return "\n".join([line(head), line(rule), *(line(row) for row in rows)])
