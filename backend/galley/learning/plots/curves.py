"""Learning curves from the logs of runs."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.evaluation.agent_groups import AgentGroup
from galley.learning.training_log import FORMER_COLUMNS
from galley.names import name_fix
from galley.plot_style import COLOURS, LINES, new_figure, styled

LOG: Final = "log.csv"
POINTS: Final = 400
"""Points of the axis on which several runs are averaged."""


@dataclass(frozen=True)
class Curve:
    """One column of one run: ticks and values, float64 [T], where the log holds both."""

    ticks: NDArray[np.float64]
    values: NDArray[np.float64]


def read_curve(run: Path, column: str, against: str = "ticks") -> Curve:
    """A column of a run's log, a CSV file with a header (or a folder with `log.csv`), by growing ticks.

    Columns may be named as today or as in earlier versions. Rows without a number in either column are left
    out; of rows with one tick count the last stays, so that a run which was continued from a checkpoint is
    drawn as it went on.

    Raises:
        GalleyError: the log cannot be read, lacks a column, or holds no number in it.
    """
    path = run / LOG if run.is_dir() else run
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file)
            header = {FORMER_COLUMNS.get(name, name): name for name in reader.fieldnames or ()}
            for name in (column, against):
                if FORMER_COLUMNS.get(name, name) not in header:
                    fix = name_fix(name, list(header))
                    raise GalleyError(f"{path}: the log has no column '{name}'; {fix}")
            x, y = (header[FORMER_COLUMNS.get(name, name)] for name in (against, column))
            rows = [(_number(row[x]), _number(row[y])) for row in reader]
    except OSError as error:
        raise GalleyError(f"{path}: cannot be read ({error.strerror or error})") from None
    except (csv.Error, UnicodeDecodeError) as error:
        raise GalleyError(f"{path}: is no CSV log ({error})") from None
    last = {tick: value for tick, value in rows if tick is not None and value is not None}
    if not last:
        raise GalleyError(f"{path}: column '{column}' holds no number; draw another column")
    ticks = np.array(sorted(last))
    return Curve(ticks, np.array([last[tick] for tick in ticks.tolist()]))


def smoothed(values: NDArray[np.float64], window: int) -> NDArray[np.float64]:
    """float64 [T]: the mean of each value and those before it, up to `window` together."""
    if window <= 1:
        return values
    sums = np.concatenate([[0.0], np.cumsum(values)])
    ends = np.arange(1, len(values) + 1)
    starts = np.maximum(ends - window, 0)
    return np.asarray((sums[ends] - sums[starts]) / (ends - starts))


def draw_curves(
    runs: Sequence[AgentGroup], columns: Sequence[str], against: str = "ticks", smooth: int = 1
) -> Figure:
    """Each column against ticks in its own panel; an entry of several runs is their mean in a band.

    The band is one standard error to either side, over the span that all runs of the entry cover. `smooth`
    rows are averaged first.

    Raises:
        GalleyError: as `read_curve`; the runs of an entry share no ticks.
    """
    with styled():
        figure = new_figure(height_mm=62, width_mm=min(90 * len(columns), 180))
        panels = figure.subplots(1, len(columns), squeeze=False).ravel()
        for axes, column in zip(panels, columns, strict=True):
            for number, entry in enumerate(runs):
                _draw(axes, entry, column, against, smooth, number)
            axes.set_xlabel(against)
            axes.set_ylabel(column.replace("_", " "))
            axes.margins(x=0.01)
            axes.grid(linewidth=0.3, color="#DDDDDD")
            axes.ticklabel_format(axis="x", style="sci", scilimits=(-3, 5), useMathText=True)
        handles, labels = panels[0].get_legend_handles_labels()
        if len(runs) > 1 or runs[0].label != runs[0].members[0]:
            figure.legend(handles, labels, loc="outside upper center", ncols=min(len(labels), 5))
    return figure


def _draw(axes: Axes, entry: AgentGroup, column: str, against: str, smooth: int, number: int) -> None:
    colour, line = COLOURS[number % len(COLOURS)], LINES[number % len(LINES)]
    found = [read_curve(Path(member), column, against) for member in entry.members]
    if len(found) == 1:
        axes.plot(
            found[0].ticks, smoothed(found[0].values, smooth), color=colour, linestyle=line, label=entry.label
        )
        return
    start = max(float(curve.ticks[0]) for curve in found)
    end = min(float(curve.ticks[-1]) for curve in found)
    if start > end:
        raise GalleyError(f"{entry.label}: its runs share no {against}; draw them one by one")
    ticks = np.linspace(start, end, POINTS)
    values = np.stack([np.interp(ticks, curve.ticks, smoothed(curve.values, smooth)) for curve in found])
    mean = values.mean(axis=0)
    error = values.std(axis=0, ddof=1) / np.sqrt(len(values))
    axes.plot(ticks, mean, color=colour, linestyle=line, label=f"{entry.label} ({len(found)} runs)")
    axes.fill_between(ticks, mean - error, mean + error, color=colour, alpha=0.2, linewidth=0)


def _number(text: str | None) -> float | None:
    try:
        value = float(text or "")
    except ValueError:
        return None
    return value if np.isfinite(value) else None
