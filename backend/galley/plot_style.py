"""How all figures look: colours that all people tell apart, sizes that fit a page, files by their ending."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
from matplotlib.figure import Figure

from galley.errors import GalleyError
from galley.files.whole import whole_path

COLOURS: Final = ("#0072B2", "#D55E00", "#009E73", "#E69F00", "#56B4E9", "#CC79A7", "#F0E442", "#000000")
"""Source: Okabe and Ito 2008, "Color Universal Design"; the order is ours."""

LINES: Final = ("solid", "dashed", "dashdot", "dotted", (0, (5, 1, 1, 1, 1, 1)), (0, (3, 1)), (0, (1, 1)))
GREY: Final = "#C8C8C8"
DARK_GREY: Final = "#606060"
PAGE_MM: Final = 180
"""The width of a page's text, for which all figures are made."""

ENDINGS: Final = (".svg", ".pdf", ".png")
PNG_DPI: Final = 300

_SETTINGS: Final[Any] = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 1.2,
    "hatch.linewidth": 0.5,
    "pdf.fonttype": 42,
    "svg.hashsalt": "galley",
}


@contextmanager
def styled() -> Iterator[None]:
    """Give figures our settings within the block."""
    with mpl.rc_context(_SETTINGS):
        yield


def new_figure(height_mm: float, width_mm: float = PAGE_MM) -> Figure:
    """An empty figure of this size whose parts make room for each other."""
    return Figure(figsize=(width_mm / 25.4, height_mm / 25.4), layout="constrained")


def save(figure: Figure, path: Path) -> None:
    """Write the figure as its file ends; the same figure gives the same file.

    Raises:
        GalleyError: the file ends in something else than .svg, .pdf or .png.
    """
    require_ending(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    dateless: dict[str, dict[str, Any]] = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}, ".png": {}}
    ending = path.suffix.lower()
    with styled(), whole_path(path) as part:
        figure.savefig(part, format=ending[1:], dpi=PNG_DPI, metadata=dateless[ending])


def require_ending(path: Path) -> None:
    """Refuse a figure's file of another ending than `ENDINGS`.

    Raises:
        GalleyError: the file ends in something else than .svg, .pdf or .png.
    """
    if path.suffix.lower() not in ENDINGS:
        raise GalleyError(f"{path}: a figure's file must end in one of {' '.join(ENDINGS)}")


def titled(name: str) -> str:
    """A name as people write it: `cramped_room` is Cramped Room."""
    return name.replace("_", " ").title() if name.islower() else name
