"""Scores with a partner as bars, by agent, layout and seat."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure
from matplotlib.patches import Patch

from galley.evaluation.agent_groups import AgentGroup, with_partner
from galley.evaluation.game_scores import GameScores
from galley.plot_style import COLOURS, DARK_GREY, GREY, new_figure, styled, titled

HATCH = "//////"
GROUP = 0.84
"""The share of a layout's place that its bars fill."""


def draw_bars(
    results: GameScores,
    layouts: Sequence[str],
    agents: Sequence[AgentGroup],
    partner: AgentGroup,
    itself: bool,
) -> Figure:
    """Bars with standard errors: plain on seat 0, hatched on seat 1; `itself` adds self-play in grey behind.

    Source: the form of COLE, Fig. 7, 9 and 11.

    Raises:
        GalleyError: the games were not played.
    """
    with styled():
        figure = new_figure(height_mm=70 if len(agents) <= 6 else 80)
        axes = figure.subplots()
        wide = GROUP / len(agents)
        for place, layout in enumerate(layouts):
            for number, agent in enumerate(agents):
                left_edge = place - GROUP / 2 + number * wide
                colour = COLOURS[number % len(COLOURS)]
                if itself:
                    alone = with_partner(results, layout, agent, agent).average.mean
                    axes.bar(left_edge + wide / 2, alone, wide * 0.96, color=GREY, zorder=1)
                    ends = (left_edge + wide * 0.02, left_edge + wide * 0.98)
                    axes.plot(ends, (alone, alone), color=DARK_GREY, linewidth=0.9, zorder=2.5)
                seats = with_partner(results, layout, agent, partner)
                for side, shown in enumerate((seats.left, seats.right)):
                    axes.bar(
                        left_edge + wide * (0.27 + 0.46 * side),
                        shown.mean,
                        wide * 0.42,
                        yerr=shown.standard_error,
                        color=colour,
                        edgecolor="white" if colour != "#F0E442" else "black",
                        hatch=HATCH if side else None,
                        linewidth=0,
                        error_kw={"elinewidth": 0.7, "capsize": 1.2, "capthick": 0.7, "zorder": 3},
                        zorder=2,
                    )
        axes.set_xticks(range(len(layouts)), [titled(layout) for layout in layouts])
        axes.tick_params(axis="x", length=0)
        axes.set_xlim(-0.5, len(layouts) - 0.5)
        axes.set_ylim(bottom=0)
        axes.set_ylabel(f"score with {partner.label}")
        axes.grid(axis="y", linewidth=0.3, color="#DDDDDD", zorder=0)
        axes.set_axisbelow(True)
        keys = [
            Patch(color=COLOURS[number % len(COLOURS)], label=agent.label)
            for number, agent in enumerate(agents)
        ]
        keys.append(Patch(facecolor=DARK_GREY, label="on seat 0 (L)"))
        keys.append(
            Patch(facecolor=DARK_GREY, edgecolor="white", hatch=HATCH, linewidth=0, label="on seat 1 (R)")
        )
        if itself:
            keys.append(Patch(color=GREY, label="with itself"))
        figure.legend(handles=keys, loc="outside upper center", ncols=min(len(keys), 9), columnspacing=1.2)
    return figure
