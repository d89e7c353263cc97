"""The browser's drawing of a kitchen as SVG text, made of the same sprites; lengths in tiles.

What moves by itself (flames, steam, signs) is drawn as for somebody who asked for less movement.
Source: frontend/js/{kitchen,sprites,draw,pots}.js, function by function.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from galley.film.sizes import (
    CHEF_SIZE,
    CORNER,
    FACINGS,
    FEET,
    HANDS,
    HAT_BOX,
    HATS,
    HELD_SIZE,
    SHRINK,
    SIZES,
    STATIONS,
    THINGS,
    WALL,
)
from galley.kitchen.state import PotView

_INGREDIENTS = 3
_RING = 0.4
_SPOTS = ((0.35, 0.255), (0.65, 0.26), (0.5, 0.31))


class Drawings:
    """The sprites of a folder, and whole pieces of a kitchen put together from them."""

    def __init__(self, folder: Path) -> None:
        self._inner = {file.stem: _parts(file.read_text(encoding="utf-8")) for file in folder.glob("*.svg")}

    def sprite(self, name: str, x: float, y: float, w: float, h: float, style: str = "") -> str:
        """One sprite that fills a box."""
        box, inner = self._inner[name]
        frame = f'<svg x="{x:.4f}" y="{y:.4f}" width="{w:.4f}" height="{h:.4f}" viewBox="{box}"'
        drawn = f'{frame} preserveAspectRatio="none">{inner}</svg>'
        return f"<g {style}>{drawn}</g>" if style else drawn

    def still(self, grid: Sequence[str]) -> str:
        """The kitchen without anything that moves; `grid` has its starts shown as floor."""
        width = len(grid[0])
        cells = [(x, y, tile) for y, row in enumerate(grid) for x, tile in enumerate(row)]
        parts = [_SHADES]
        parts += [self.sprite("wall", x, -WALL, 1.01, WALL + 0.01) for x in range(width)]
        parts += [self.sprite("floor-dark" if (x + y) % 2 else "floor", x, y, 1, 1) for x, y, _ in cells]
        for x, y, tile in cells:
            if tile == " ":
                if not is_floor(grid, x, y - 1):
                    parts.append(f'<rect x="{x}" y="{y}" width="1" height="0.34" fill="url(#above)"/>')
                if not is_floor(grid, x - 1, y):
                    parts.append(f'<rect x="{x}" y="{y}" width="0.24" height="1" fill="url(#beside)"/>')
        parts += [part for x, y, tile in cells if tile != " " for part in self._worktop(grid, x, y, tile)]
        return "".join(parts)

    def _worktop(self, grid: Sequence[str], x: int, y: int, tile: str) -> Iterator[str]:
        north, east = is_floor(grid, x, y - 1), is_floor(grid, x + 1, y)
        south, west = is_floor(grid, x, y + 1), is_floor(grid, x - 1, y)
        lip = has_lip(grid, x, y)
        radii = [CORNER * both for both in (north and west, north and east, south and east, south and west)]
        yield f'<clipPath id="c{x}-{y}"><path d="{_rounded(x, y, radii)}"/></clipPath>'
        yield f'<g clip-path="url(#c{x}-{y})">' + self.sprite("counter", x, y, 1, 1)
        if lip:
            yield self.sprite("stove-front" if tile == "P" else "front", x, y, 1, 1)
        edge = "".join(_edges(x, y, radii, north, east, west))
        yield f'<path d="{edge}" fill="none" stroke="#5f3619" stroke-width="0.035"/></g>' if edge else "</g>"
        if tile in STATIONS:
            yield self.sprite(STATIONS[tile], x, y + (0 if lip else 0.09), 1, 1)

    def thing(self, thing: int) -> str:
        """A thing that lies on a counter, with its shadow, around its middle."""
        name = THINGS[thing]
        if name is None:
            return ""
        w, h = SIZES[name]
        shadow = _ellipse(0.025, h * 0.42, w * 0.46, h * 0.16, 'fill="#321808" fill-opacity="0.32"')
        return shadow + self.sprite(name, -w / 2, -h / 2, w, h)

    def chef(self, facing: int, hat: str, held: int) -> str:
        """A chef and what it carries, around the point it stands on."""
        side = FACINGS[facing]
        w, h = CHEF_SIZE[0] * SHRINK, CHEF_SIZE[1] * SHRINK
        left, top = -w / 2, -FEET * SHRINK
        parts = [self.sprite(f"chef-{side}", left, top, w, h), _tint(HATS[hat])]
        parts.append(self.sprite(f"cloth-{side}", left, top, w, h, 'filter="url(#tint)"'))
        if side in ("east", "west"):
            parts.append(self.sprite(f"chef-{side}-arm", left, top, w, h))
        shift = {"east": 0.015, "west": -0.015}.get(side, 0.0)
        x, y, hat_w, hat_h = (length * SHRINK for length in HAT_BOX)
        parts.append(self.sprite(f"hat-{hat}", left + x + shift * SHRINK, top + y, hat_w, hat_h))
        name = THINGS[held]
        if name is not None:
            hx, hy = HANDS[facing]
            tw, th = (HELD_SIZE * length for length in SIZES[name])
            at = left + hx * SHRINK - tw / 2, top + hy * SHRINK - th / 2
            parts.append(self.sprite(name, *at, tw, th))
        return "".join(parts)

    def pot(self, pot: PotView, cook_time: int) -> str:
        """A pot on its stove with what it holds, around the middle of its ring."""
        cooking = pot.count == _INGREDIENTS and not pot.ready
        parts = [_ring(1 if pot.ready else pot.ticks / cook_time, pot.ready)] if cooking or pot.ready else []
        heat = 1 if cooking else 0.62
        w, h = 0.24 * heat, 0.26 * heat
        parts += [self.sprite("flame", dx - w / 2, 0.38 - h, w, h) for dx in (-0.17, 0.17, 0)]
        size = SIZES["pot"][0]
        left, top = -size / 2, -0.42
        parts.append(self.sprite("pot", left, top, size, size))
        name = "tomato" if pot.tomatoes > pot.onions else "onion"
        if cooking or pot.ready:
            parts.append(self.sprite(f"broth-{name}", left, top, size, size))
        if pot.ready:
            share = 0.35
            wide = 0.3 + 0.2 * share
            faint = f'opacity="{0.85 * math.sin(math.pi * share):.3f}"'
            parts.append(
                self.sprite("steam", -wide / 2 - 0.06, -0.2 - (0.26 + 0.36 * share), wide, wide, faint)
            )
            parts.append(self.sprite("ready", 0.15, -0.42, *SIZES["ready"]))
        elif pot.count:
            for sx, sy in _SPOTS[: pot.count]:
                wide = 0.27
                parts.append(
                    self.sprite(name, left + sx * size - wide / 2, top + sy * size - wide * 0.62, wide, wide)
                )
            parts += [_pip(i, pot, top + 0.63 * size) for i in range(_INGREDIENTS)]
        return "".join(parts)


def ground_shadow(lift: float = 0.0) -> str:
    """The shadow of a chef `lift` above the floor, around the point it stands on."""
    return _ellipse(0.03, 0.02, 0.27 - lift, 0.085, 'fill="#3a1e0a" fill-opacity="0.34"')


def marker() -> str:
    """The ring under a participant's chef, around the point it stands on."""
    look = 'fill="#fff" fill-opacity="0.35" stroke="#fff" stroke-opacity="0.95" stroke-width="0.045"'
    return _ellipse(0, -0.01, 0.38, 0.15, look)


def target() -> str:
    """The frame on the tile that a participant's chef faces, from the tile's corner."""
    box = '<rect x="0.05" y="0.05" width="0.9" height="0.9" rx="0.14"'
    return f'{box} fill="none" stroke="#fff" stroke-width="0.05" opacity="0.8"/>'


def is_floor(grid: Sequence[str], x: int, y: int) -> bool:
    """Whether a place is floor; outside is not."""
    return 0 <= y < len(grid) and 0 <= x < len(grid[y]) and grid[y][x] == " "


def has_lip(grid: Sequence[str], x: int, y: int) -> bool:
    """Whether the front of a worktop is seen."""
    return is_floor(grid, x, y + 1) or y == len(grid) - 1


def middle(grid: Sequence[str], x: int, y: int) -> float:
    """How far below its tile's upper edge the middle of a worktop's top is."""
    return 0.38 if has_lip(grid, x, y) else 0.47


_SHADES = (
    '<linearGradient id="above" x1="0" y1="0" x2="0" y2="1"><stop offset="0" stop-color="#4a2810" '
    'stop-opacity="0.42"/><stop offset="1" stop-color="#4a2810" stop-opacity="0"/></linearGradient>'
    '<linearGradient id="beside" x1="0" y1="0" x2="1" y2="0"><stop offset="0" stop-color="#4a2810" '
    'stop-opacity="0.3"/><stop offset="1" stop-color="#4a2810" stop-opacity="0"/></linearGradient>'
)


def _parts(text: str) -> tuple[str, str]:
    """The viewBox of an SVG file and what stands in it."""
    found = re.search(r'<svg[^>]*viewBox="([^"]+)"[^>]*>(.*)</svg>', text, re.DOTALL)
    if found is None:
        raise ValueError("a sprite without a viewBox")
    return found[1], found[2]


def _rounded(x: float, y: float, radii: Sequence[float]) -> str:
    """A tile whose corners, from the upper left clockwise, have these radii."""
    a, b, c, d = radii
    return (
        f"M{x + a} {y}H{x + 1 - b}A{b} {b} 0 0 1 {x + 1} {y + b}"
        f"V{y + 1 - c}A{c} {c} 0 0 1 {x + 1 - c} {y + 1}"
        f"H{x + d}A{d} {d} 0 0 1 {x} {y + 1 - d}V{y + a}A{a} {a} 0 0 1 {x + a} {y}Z"
    )


def _edges(x: float, y: float, radii: Sequence[float], north: bool, east: bool, west: bool) -> Iterator[str]:
    """The upper and outer sides of a tile that border on floor, with the corners between two of them."""
    a, b, c, d = radii
    if north:
        yield f"M{x + a} {y}H{x + 1 - b}"
    if b:
        yield f"M{x + 1 - b} {y}A{b} {b} 0 0 1 {x + 1} {y + b}"
    if east:
        yield f"M{x + 1} {y + b}V{y + 1 - c}"
    if c:
        yield f"M{x + 1} {y + 1 - c}A{c} {c} 0 0 1 {x + 1 - c} {y + 1}"
    if d:
        yield f"M{x + d} {y + 1}A{d} {d} 0 0 1 {x} {y + 1 - d}"
    if west:
        yield f"M{x} {y + 1 - d}V{y + a}"
    if a:
        yield f"M{x} {y + a}A{a} {a} 0 0 1 {x + a} {y}"


def _ellipse(x: float, y: float, rx: float, ry: float, look: str) -> str:
    return f'<ellipse cx="{x:.4f}" cy="{y:.4f}" rx="{rx:.4f}" ry="{ry:.4f}" {look}/>'


def _tint(colour: str) -> str:
    """A filter `tint` that multiplies a white-and-grey drawing with a colour."""
    red, green, blue = (int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5))
    values = f"{red:.4f} 0 0 0 0 0 {green:.4f} 0 0 0 0 0 {blue:.4f} 0 0 0 0 0 1 0"
    matrix = f'<feColorMatrix values="{values}"/>'
    return f'<filter id="tint" color-interpolation-filters="sRGB">{matrix}</filter>'


def _ring(done: float, ready: bool) -> str:
    parts = ['<circle r="0.46" fill="#5adc82" fill-opacity="0.45"/>'] if ready else []
    parts.append(f'<circle r="{_RING}" fill="none" stroke="#20140c" stroke-width="0.1"/>')
    look = f'fill="none" stroke="{"#4cd07d" if ready else "#ffc23d"}" stroke-width="0.062"'
    angle = 2 * math.pi * max(0.02, done)
    if done >= 1:
        parts.append(f'<circle r="{_RING}" {look}/>')
    else:
        end = f"{_RING * math.sin(angle):.4f} {-_RING * math.cos(angle):.4f}"
        arc = f"M0 {-_RING}A{_RING} {_RING} 0 {int(angle > math.pi)} 1 {end}"
        parts.append(f'<path d="{arc}" stroke-linecap="round" {look}/>')
    return "".join(parts)


def _pip(number: int, pot: PotView, y: float) -> str:
    inside = ["#f0a83c"] * pot.onions + ["#e0402c"] * pot.tomatoes + ["#f4f6f8"] * _INGREDIENTS
    look = f'fill="{inside[number]}" stroke="#3b2418" stroke-width="0.022"'
    return f'<circle cx="{(number - 1) * 0.135}" cy="{y:.4f}" r="0.048" {look}/>'
