"""Payoffs and preference centralities of a population's history as two squares."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from galley.evaluation.game_graph import PayoffTable, centrality_matrix, newest_centralities
from galley.plot_style import new_figure, styled

NAMED = 12
"""Up to as many strategies are named on the axes; of more, every some number."""

NUMBERED = 8
"""Up to as many strategies have their numbers written into the squares."""

UNDEFINED = "#DEDEDE"
"""What a square shows where there is no value: strategies that were not there yet."""


def draw_matrices(tables: Sequence[tuple[str, PayoffTable]]) -> Figure:
    """For each titled table a row: payoffs (darker: higher) and preference centrality (darker: preferred).

    Row i of the right square holds the centralities when strategy i was the newest; its mean over the newest
    strategies stands above it.

    Source: the form of COLE, Fig. 2b and 10.

    Raises:
        ValueError: a table is not complete.
    """
    with styled():
        figure = new_figure(height_mm=78 * len(tables), width_mm=170)
        grid = figure.subplots(len(tables), 2, squeeze=False)
        highest = max(float(table.payoffs().max()) for _, table in tables)
        for (title, table), (left, right) in zip(tables, grid, strict=True):
            payoffs = table.payoffs()
            centralities = centrality_matrix(payoffs)
            _square(figure, left, payoffs, "Reds", highest or 1.0, "score", "{:.0f}")
            _square(figure, right, centralities, "Blues_r", 1.0, "preference centrality", "{:.2f}")
            newest = newest_centralities(centralities)
            told = f"Mean of the newest: {newest.mean():.2f}" if len(newest) else ""
            left.set_title(title)
            right.set_title(told)
            for axes in (left, right):
                _ticks(axes, table.names)
            left.set_ylabel("strategy")
            right.set_ylabel("when this one was newest")
    return figure


def _square(
    figure: Figure,
    axes: Axes,
    values: NDArray[np.float64],
    colours: str,
    highest: float,
    label: str,
    written: str,
) -> None:
    image = axes.imshow(values, cmap=colours, vmin=0, vmax=highest, interpolation="nearest")
    axes.spines[:].set_visible(False)
    axes.set_facecolor(UNDEFINED)
    bar = figure.colorbar(image, ax=axes, shrink=0.8, pad=0.02)
    bar.outline.set_visible(False)
    bar.set_label(label)
    if len(values) > NUMBERED:
        return
    for row, column in np.argwhere(np.isfinite(values)).tolist():
        red, green, blue, _ = image.cmap(image.norm(values[row, column]))
        light = 0.299 * red + 0.587 * green + 0.114 * blue > 0.55
        axes.text(
            column,
            row,
            written.format(values[row, column]),
            ha="center",
            va="center",
            fontsize=6.5,
            color="black" if light else "white",
        )


def _ticks(axes: Axes, names: Sequence[str]) -> None:
    size = len(names)
    axes.tick_params(length=0 if size <= NAMED else 2)
    if size <= NAMED:
        longest = max(len(name) for name in names)
        axes.set_xticks(
            range(size), names, rotation=45 if longest > 3 else 0, ha="right" if longest > 3 else "center"
        )
        axes.set_yticks(range(size), names)
        return
    step = 5 if size <= 30 else 10
    shown = [0, *range(step - 1, size, step)]
    axes.set_xticks(shown, [str(place + 1) for place in shown])
    axes.set_yticks(shown, [str(place + 1) for place in shown])
