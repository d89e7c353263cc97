"""Films as files: GIF or MP4, by the ending of the name."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

from galley.errors import GalleyError
from galley.files.whole import clear_left, whole_path
from galley.film.footage import Footage, Reel

if TYPE_CHECKING:
    from PIL import Image

NEEDED = ("resvg_py", "PIL", "av")
EXTRA = "drawing rounds needs the extra `video`; install it: pip install 'galley[video]'"

TILES = range(16, 129)
SPEEDS = (0.1, 20.0)
USUAL_TILE = 48
HOLD_MS = 1000
"""How long the last picture stays."""

# Hundredths of a second: all that a GIF can tell. MP4: 30 pictures a second.
_GIF_MS = 50
_MP4_MS = 100 / 3


def can_draw() -> bool:
    """Whether the libraries of the extra `video` are installed."""
    return all(importlib.util.find_spec(name) for name in NEEDED)


def check(out: Path, tile: int, speed: float) -> None:
    """Make sure that a film can be written so.

    Raises:
        GalleyError: it cannot; the message says what can.
    """
    if not can_draw():
        raise GalleyError(EXTRA)
    if out.suffix.lower() not in _WRITERS:
        raise GalleyError(f"{out}: a film ends in {' or '.join(_WRITERS)}; name it so")
    if tile not in TILES:
        raise GalleyError(f"a tile of {tile} pixels; use a scale from {TILES[0]} to {TILES[-1]}")
    if not SPEEDS[0] <= speed <= SPEEDS[1]:
        raise GalleyError(f"a speed of {speed:g}; use one from {SPEEDS[0]:g} to {SPEEDS[1]:g}")


def frames(
    footage: Footage, sprites: Path, tile: int, speed: float, every_ms: float
) -> Iterator[Image.Image]:
    """The pictures of a film, RGB, one each `every_ms`, from the start of the round to its end."""
    from galley.film.painter import Painter

    painter, reel = Painter(footage, sprites, tile), Reel(footage)
    for number in range(math.ceil(reel.length_ms / speed / every_ms - 1e-9)):
        yield painter.paint(reel.at(number * every_ms * speed))
    yield painter.paint(reel.at(reel.length_ms))


def write_film(footage: Footage, sprites: Path, out: Path, tile: int = USUAL_TILE, speed: float = 1.0) -> int:
    """Pictures written to `out`, a .gif or .mp4; `sprites` is the folder of the browser's drawings.

    Raises:
        GalleyError: the file cannot be written so; nothing is left of it then.
    """
    check(out, tile, speed)
    try:
        clear_left(out.parent)
        with whole_path(out) as part:
            return _WRITERS[out.suffix.lower()](footage, sprites, part, tile, speed)
    except OSError as error:
        raise GalleyError(f"{out}: {error.strerror or error}; name another file with --out") from None


def _write_gif(footage: Footage, sprites: Path, out: Path, tile: int, speed: float) -> int:
    """One palette for the whole film, so that what stands still costs nothing."""
    import av
    import numpy as np
    from PIL import Image

    palette = _palette(footage, sprites, tile)
    colours = np.zeros((256, 4), dtype=np.uint8)
    listed = np.array(palette.getpalette(), dtype=np.uint8).reshape(-1, 3)
    colours[:, 0] = 255
    colours[: len(listed), 1:] = listed

    def frame(plain: Any, hundredths: int) -> av.VideoFrame:
        made = av.VideoFrame.from_ndarray(plain, format="pal8")
        made.pts, made.time_base = hundredths, Fraction(1, 100)
        return made

    count = 0
    with av.open(str(out), "w", format="gif") as file:
        stream = file.add_stream("gif", rate=Fraction(1000, _GIF_MS))
        stream.pix_fmt = "pal8"
        stream.codec_context.time_base = Fraction(1, 100)
        for picture in frames(footage, sprites, tile, speed, _GIF_MS):
            if not count:
                stream.width, stream.height = picture.size
            plain = (np.asarray(picture.quantize(palette=palette, dither=Image.Dither.NONE)), colours)
            file.mux(stream.encode(frame(plain, count * _GIF_MS // 10)))
            count += 1
        # The film would begin again at once: the last picture once more, later.
        file.mux(stream.encode(frame(plain, ((count - 1) * _GIF_MS + HOLD_MS) // 10)))
        file.mux(stream.encode(None))
    return count


def _palette(footage: Footage, sprites: Path, tile: int) -> Image.Image:
    """The 255 colours that fit some pictures from all over the film."""
    from PIL import Image

    from galley.film.painter import Painter

    painter, reel = Painter(footage, sprites, tile), Reel(footage)
    some = [painter.paint(reel.at(reel.length_ms * share / 11)) for share in range(12)]
    width, height = painter.size
    sheet = Image.new("RGB", (width, height * len(some)))
    for number, picture in enumerate(some):
        sheet.paste(picture, (0, number * height))
    return sheet.quantize(255, dither=Image.Dither.NONE)


def _write_mp4(footage: Footage, sprites: Path, out: Path, tile: int, speed: float) -> int:
    """H.264 that every browser and slide program plays."""
    import av
    import numpy as np

    count = 0
    with av.open(str(out), "w", format="mp4", options={"movflags": "+faststart"}) as file:
        stream = file.add_stream("libx264", rate=30, options={"crf": "18", "preset": "veryfast"})
        stream.pix_fmt = "yuv420p"
        for picture in frames(footage, sprites, tile, speed, _MP4_MS):
            # Colours are kept for every second pixel, so both sides must be even.
            even = picture.crop((0, 0, picture.width // 2 * 2, picture.height // 2 * 2))
            if not count:
                stream.width, stream.height = even.size
            last = np.asarray(even)
            file.mux(stream.encode(av.VideoFrame.from_ndarray(last, format="rgb24")))
            count += 1
        for _ in range(HOLD_MS * 30 // 1000):
            file.mux(stream.encode(av.VideoFrame.from_ndarray(last, format="rgb24")))
        file.mux(stream.encode(None))
    return count


_WRITERS: dict[str, Callable[[Footage, Path, Path, int, float], int]] = {
    ".gif": _write_gif,
    ".mp4": _write_mp4,
}
