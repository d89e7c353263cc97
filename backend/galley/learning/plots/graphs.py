"""A population as graphs: what it scores together, and who preferred whom as it grew."""

from __future__ import annotations

from collections.abc import Sequence

import networkx as nx
import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.evaluation.game_graph import PayoffTable, preference_centrality, preference_edges
from galley.plot_style import new_figure, styled

LABELLED = 6
"""Up to as many strategies have their payoffs written on the edges of the game graph."""

PANELS = 4
"""Sub-preference graphs in a row, and how many are drawn if none are asked for."""

FAINTEST = 0.1
"""Edges of lower payoffs, as a share of the highest, are drawn like this one, so that they can be seen."""

_PAYOFFS = "Reds"
_CENTRALITIES = "Blues_r"


def draw_graphs(table: PayoffTable, steps: Sequence[int] | None = None) -> Figure:
    """The game graph, then the preference graph of the first `steps` strategies, for each of the steps.

    Edges of the game graph are darker and wider the higher the payoff; nodes of preference graphs are darker
    the more they are preferred, the newest with a thick edge. By default steps are spread evenly up to all.

    Source: the form of COLE, Fig. 1.

    Raises:
        GalleyError: there are fewer than two strategies, or a step is not from 2 to their number.
        ValueError: the table is not complete.
    """
    size = len(table)
    if size < 2:
        raise GalleyError("a graph needs at least two strategies")
    chosen = list(steps) if steps else spread(size)
    wrong = [step for step in chosen if not 2 <= step <= size]
    if wrong:
        raise GalleyError(f"step {wrong[0]} is not from 2 to {size}, the number of strategies")
    payoffs = table.payoffs()
    with styled():
        columns = min(len(chosen) + 1, PANELS + 1)
        rows = -(-(len(chosen) + 1) // columns)
        figure = new_figure(height_mm=46 * rows + 14, width_mm=max(36 * columns, 90))
        grid = figure.add_gridspec(rows + 1, columns, height_ratios=[*[1.0] * rows, 0.05])
        panels = [figure.add_subplot(grid[divmod(place, columns)]) for place in range(len(chosen) + 1)]
        _game(panels[0], payoffs)
        for axes, step in zip(panels[1:], chosen, strict=True):
            _preference(axes, payoffs[:step, :step])
        for axes in panels:
            axes.set_axis_off()
            axes.set_aspect("equal")
            axes.set_xlim(-1.35, 1.35)
            axes.set_ylim(-1.35, 1.35)
        _key(figure.add_subplot(grid[rows, 0]), _PAYOFFS, _highest(payoffs), "score")
        told = "preference centrality (0: preferred by all others)"
        _key(figure.add_subplot(grid[rows, 1:]), _CENTRALITIES, 1.0, told)
    return figure


def spread(size: int) -> list[int]:
    """Up to `PANELS` numbers of strategies from 2 to `size`, evenly spread, the last all of them."""
    return sorted({round(step) for step in np.linspace(2, size, min(PANELS, size - 1))})


def _places(size: int) -> dict[int, tuple[float, float]]:
    """A circle, clockwise from the top."""
    angles = np.pi / 2 - 2 * np.pi * np.arange(size) / size
    return {node: (float(np.cos(angle)), float(np.sin(angle))) for node, angle in enumerate(angles)}


def _highest(payoffs: NDArray[np.float64]) -> float:
    """The highest payoff of two that are not the same, 1 if all are 0."""
    others = payoffs[~np.eye(len(payoffs), dtype=np.bool_)]
    return float(others.max()) or 1.0


def _game(axes: Axes, payoffs: NDArray[np.float64]) -> None:
    size = len(payoffs)
    graph = nx.Graph([(one, other) for one in range(size) for other in range(one)])
    places = _places(size)
    edges = sorted(graph.edges, key=lambda edge: payoffs[edge])
    share = np.array([payoffs[edge] for edge in edges]) / _highest(payoffs)
    nx.draw_networkx_edges(
        graph,
        places,
        edgelist=edges,
        ax=axes,
        width=(0.3 + 1.7 * share) if size <= 12 else (0.1 + 0.3 * share),
        edge_color=colormaps[_PAYOFFS](np.maximum(share, FAINTEST)),
    )
    _nodes(axes, places, np.full(size, 0.25), newest=None)
    if size <= LABELLED:
        shown = {edge: f"{payoffs[edge]:.0f}" for edge in edges}
        nx.draw_networkx_edge_labels(
            graph, places, shown, ax=axes, font_size=6, rotate=False, label_pos=0.35, bbox=_plate()
        )
    axes.set_title("Game graph")


def _preference(axes: Axes, payoffs: NDArray[np.float64]) -> None:
    size = len(payoffs)
    graph = nx.DiGraph(np.argwhere(preference_edges(payoffs)).tolist())
    places = _places(size)
    nx.draw_networkx_edges(
        graph,
        places,
        ax=axes,
        node_size=_node_size(size),
        nodelist=sorted(graph),
        width=0.9 if size <= 12 else 0.4,
        arrowsize=7 if size <= 12 else 4,
        edge_color="#333333",
        connectionstyle="arc3,rad=0.12",
    )
    _nodes(axes, places, preference_centrality(payoffs), newest=size - 1)
    axes.set_title(f"Preferences among {size}")


def _nodes(
    axes: Axes, places: dict[int, tuple[float, float]], centralities: NDArray[np.float64], newest: int | None
) -> None:
    size = len(places)
    xs, ys = zip(*places.values(), strict=True)
    faces = colormaps[_CENTRALITIES](centralities) if newest is not None else "white"
    edges = [2.0 if node == newest else 0.6 for node in places]
    axes.scatter(xs, ys, s=_node_size(size), c=faces, edgecolors="black", linewidths=edges, zorder=3)
    if size > 20:
        return
    for node, (x, y) in places.items():
        dark = newest is not None and centralities[node] < 0.4
        axes.text(
            x,
            y,
            str(node + 1),
            ha="center",
            va="center_baseline",
            fontsize=7 if size <= 12 else 5.5,
            color="white" if dark else "black",
            zorder=4,
        )


def _node_size(size: int) -> float:
    """Area in points squared."""
    return 130 if size <= 12 else 60 if size <= 20 else 14


def _plate() -> dict[str, object]:
    return {"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none"}


def _key(axes: Axes, colours: str, top: float, label: str) -> None:
    """A colour bar that fills the axes."""
    scale = ScalarMappable(Normalize(0, top), colormaps[colours])
    bar = axes.figure.colorbar(scale, cax=axes, orientation="horizontal")
    bar.outline.set_visible(False)
    bar.set_label(label)
