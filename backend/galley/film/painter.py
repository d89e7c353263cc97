"""Frames of a film: pieces are drawn once each, then put together frame by frame."""

from __future__ import annotations

import io
from pathlib import Path

import resvg_py
from PIL import Image, ImageDraw, ImageFont

from galley.film.footage import Footage, Moment
from galley.film.sizes import STAND, TOWARDS, WALL
from galley.film.svg import Drawings, ground_shadow, is_floor, marker, middle, target
from galley.kitchen.state import PotView

STRIP = 0.5
"""Height in tiles of the strip under the kitchen with score and time."""
_DARK, _CREAM, _GOLD, _GROUND = "#2b1a10", "#fff6e2", "#ffd84d", "#5f4a3a"

Key = tuple[str, *tuple[object, ...]]


class Painter:
    """Paints moments of one footage with tiles of `tile` pixels; keeps every piece it has drawn."""

    def __init__(self, footage: Footage, folder: Path, tile: int) -> None:
        self._footage = footage
        self._tile = tile
        self._drawings = Drawings(folder)
        self._pieces: dict[Key, tuple[Image.Image, int, int]] = {}
        self._grid = [row.replace("1", " ").replace("2", " ") for row in footage.layout.grid]
        self._wall = round(WALL * tile)
        self._kitchen = self._backdrop()
        self._font = ImageFont.load_default(max(8, round(0.28 * tile)))

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of a frame in pixels."""
        return self._kitchen.size

    def paint(self, moment: Moment) -> Image.Image:
        """One frame, RGB."""
        frame = self._kitchen.copy()
        self._under(frame, moment)
        layers = [(place[1] + 0.0, "pot", place) for place in moment.kitchen.pots]
        layers += [(place[1] + 0.0, "thing", place) for place in moment.kitchen.things]
        layers += [(moment.seen[seat][1] + 0.5, "chef", (seat, 0)) for seat in self._footage.drawn]
        for _, what, place in sorted(layers, key=lambda layer: layer[0]):
            if what == "pot":
                self._pot(frame, place, moment.kitchen.pots[place])
            elif what == "thing":
                x, y = place
                thing = moment.kitchen.things[place]
                self._put(frame, ("thing", thing), x + 0.5, y + middle(self._grid, x, y))
            else:
                self._chef(frame, moment, place[0])
        for x, y, words, share in moment.points:
            self._points(frame, x, y, words, share)
        self._strip(frame, moment)
        return frame

    def _under(self, frame: Image.Image, moment: Moment) -> None:
        seat = self._footage.own
        if seat is None:
            return
        x, y = moment.seen[seat]
        self._put(frame, ("marker",), x + 0.5, y + STAND)
        chef = moment.kitchen.chefs[seat]
        dx, dy = TOWARDS[chef.facing]
        if not is_floor(self._grid, chef.x + dx, chef.y + dy):
            self._put(frame, ("target",), chef.x + dx, chef.y + dy)

    def _pot(self, frame: Image.Image, place: tuple[int, int], pot: PotView) -> None:
        x, y = place
        self._put(frame, ("pot", pot), x + 0.5, y + middle(self._grid, x, y) - 0.02)

    def _chef(self, frame: Image.Image, moment: Moment, seat: int) -> None:
        chef = moment.kitchen.chefs[seat]
        x, y = moment.seen[seat]
        lift = round(moment.lifts[seat] * self._tile) / self._tile
        self._put(frame, ("shadow", lift), x + 0.5, y + STAND)
        body = ("chef", chef.facing, self._footage.hats[seat], chef.held)
        self._put(frame, body, x + 0.5, y + STAND - lift)

    def _put(self, frame: Image.Image, key: Key, x: float, y: float) -> None:
        """Paint a piece with its origin at (x, y) tiles; what lies outside the frame is cut off."""
        if key not in self._pieces:
            self._pieces[key] = self._piece(self._svg(key))
        image, left, top = self._pieces[key]
        at = (round(x * self._tile) - left, round(y * self._tile) + self._wall - top)
        frame.paste(image, at, image)

    def _svg(self, key: Key) -> str:
        match key:
            case ("chef", int(facing), str(hat), int(held)):
                return self._drawings.chef(facing, hat, held)
            case ("pot", PotView() as pot):
                return self._drawings.pot(pot, self._footage.layout.rules.cook_time_ticks)
            case ("thing", int(thing)):
                return self._drawings.thing(thing)
            case ("shadow", float(lift)):
                return ground_shadow(lift)
            case ("marker",):
                return marker()
            case _:
                return target()

    def _piece(self, svg: str) -> tuple[Image.Image, int, int]:
        """A piece cut to what is seen of it, and where in it the origin is."""
        half = 2 * self._tile
        whole = _rastered(svg, -2, -2, 2 * half, 2 * half, self._tile)
        box = whole.getbbox() or (0, 0, 1, 1)
        return whole.crop(box), half - box[0], half - box[1]

    def _backdrop(self) -> Image.Image:
        """The still kitchen over an empty strip."""
        tile, rows, columns = self._tile, len(self._grid), len(self._grid[0])
        width, height = columns * tile, rows * tile + self._wall
        still = _rastered(self._drawings.still(self._grid), 0, -self._wall / tile, width, height, tile)
        whole = Image.new("RGB", (width, height + round(STRIP * tile)), _DARK)
        whole.paste(still, (0, 0), still)
        return whole

    def _points(self, frame: Image.Image, x: int, y: int, words: str, share: float) -> None:
        rise = 1.15 * (1 - (1 - share) ** 2)
        size = max(8, round((0.38 + 0.18 * min(1, share * 6)) * self._tile))
        font = ImageFont.load_default(size)
        half = font.getlength(words) / 2 + 0.08 * self._tile
        px = min(frame.width - half, max(half, (x + 0.5) * self._tile))
        py = max(0.32 * self._tile, self._wall + (y + middle(self._grid, x, y) - rise) * self._tile)
        edge = max(1, round(0.065 * self._tile))
        draw = ImageDraw.Draw(frame)
        draw.text((px, py), words, _GOLD, font, anchor="mm", stroke_width=edge, stroke_fill=_DARK)

    def _strip(self, frame: Image.Image, moment: Moment) -> None:
        tile = self._tile
        top, height = frame.height - round(STRIP * tile), round(STRIP * tile)
        draw = ImageDraw.Draw(frame)
        bar = max(2, round(0.08 * tile))
        line = top + (height - bar) / 2
        seconds = round(moment.left_ms / 1000)
        left = f"{seconds // 60}:{seconds % 60:02d}"
        draw.text((0.2 * tile, line), f"Score {moment.score}", _CREAM, self._font, anchor="lm")
        draw.text((frame.width - 0.2 * tile, line), left, _CREAM, self._font, anchor="rm")
        draw.rectangle((0, frame.height - bar, frame.width, frame.height), _GROUND)
        draw.rectangle((0, frame.height - bar, round(frame.width * moment.share_left), frame.height), _GOLD)


def _rastered(svg: str, x: float, y: float, width: int, height: int, tile: int) -> Image.Image:
    """A piece of drawing as RGBA: `width` x `height` pixels from (x, y) tiles on."""
    box = f"{x} {y} {width / tile} {height / tile}"
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{box}" width="{width}" height="{height}">'
    drawn = resvg_py.svg_to_bytes(svg_string=f"{head}{svg}</svg>", skip_system_fonts=True)
    return Image.open(io.BytesIO(drawn)).convert("RGBA")
