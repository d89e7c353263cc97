"""Orders that a study gives out evenly: Latin squares, all permutations, permuted blocks of both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import factorial, gcd, lcm, prod
from typing import Final

from numpy.random import Generator, SeedSequence, default_rng

from galley.study.written.factors import Order

MOST_SEQUENCES: Final = 5040
"""Full counterbalancing over more sequences than this is refused: no study is that large."""

Permutation = tuple[int, ...]
Tag = tuple[int, ...]
"""What is balanced, as numbers: every tag has shuffles of its own."""


def in_blocks(seed: int, tag: Tag, number: int, size: int) -> int:
    """Which of `size` treatments the participant of this number gets, from 0.

    Every block of `size` participants in a row gets each treatment once, in an order drawn for the block.
    Source: permuted block randomisation, Zelen (1974), The randomization and stratification of patients to
    clinical trials, Journal of Chronic Diseases 27.
    """
    block, place = divmod(number, size)
    # Visits' seeds come from spawn keys of length one, so these never meet them.
    shuffle = default_rng(SeedSequence(seed, spawn_key=(len(tag), *tag, block))).permutation(size)
    return int(shuffle[place])


@dataclass(frozen=True, slots=True)
class Turn:
    """Whose turn it is to get a treatment: the participant of this number, counted with that tag.

    `given` is the treatment that several orders were counted through together for.
    """

    seed: int
    tag: Tag
    number: int
    given: int | None = None

    def of(self, size: int) -> int:
        """Which of `size` treatments this participant gets, from 0."""
        return in_blocks(self.seed, self.tag, self.number, size) if self.given is None else self.given


def together(seed: int, tag: Tag, number: int, sizes: Sequence[int]) -> tuple[int, ...]:
    """Which treatment of each of several orders, of `sizes` treatments, the participant of this number gets.

    Every block of `prod(sizes)` participants in a row gets each combination once, and within a block every
    run of `lcm(sizes)` holds each treatment of each order equally often: all orders take one step at a time
    together, and each run begins elsewhere. Treatments' names and the order of runs are drawn for the block.
    """
    whole, run = prod(sizes), lcm(*sizes)
    block, place = divmod(number, whole)
    turn, step = divmod(place, run)
    draw = default_rng(SeedSequence(seed, spawn_key=(len(tag), *tag, block)))
    names = [draw.permutation(size) for size in sizes]
    begins = int(draw.permutation(whole // run)[turn])
    given = []
    period = 1
    for size, name in zip(sizes, names, strict=True):
        # Orders so far repeat after `period` steps: this one may be shifted so far before that is the same.
        begins, shift = divmod(begins, gcd(period, size))
        given.append(int(name[(shift + step) % size]))
        period = lcm(period, size)
    return tuple(given)


def latin_square(size: int) -> tuple[Permutation, ...]:
    """Rows of numbers below `size`: each number stands equally often in each place and after each other one.

    An even size needs `size` rows, an odd one twice as many. Source: Williams (1949), Experimental designs
    balanced for the estimation of residual effects of treatments, Australian Journal of Scientific Research.
    """
    first, low, high = [0], 1, size - 1
    while len(first) < size:
        first.append(low if len(first) % 2 else high)
        low, high = (low + 1, high) if len(first) % 2 == 0 else (low, high - 1)
    rows = [tuple((number + shift) % size for number in first) for shift in range(size)]
    return tuple(rows if size % 2 == 0 or size == 1 else [*rows, *(row[::-1] for row in rows)])


def permutation_of(number: int, size: int, chosen: int | None = None) -> Permutation:
    """The `number`-th way (from 0) of laying out `chosen` of `size` things (by default all) in order."""
    left = list(range(size))
    picked = []
    for _ in range(size if chosen is None else chosen):
        number, place = divmod(number, len(left))
        picked.append(left.pop(place))
    return tuple(picked)


def permutations_count(size: int, chosen: int | None = None) -> int:
    """How many ways there are of laying out `chosen` of `size` things in order."""
    return factorial(size) // factorial(size - (size if chosen is None else chosen))


def sequences(mode: Order, size: int, units: int) -> int:
    """How many participants balance an order of `size` things for each of `units`; 0: none ever do."""
    match mode:
        case "fixed":
            return 1
        case "random":
            return 0
        case "latin_square":
            return len(latin_square(size))
        case "full":
            return int(permutations_count(size) ** units)


def orders(mode: Order, size: int, units: int, draw: Generator, turn: Turn) -> tuple[Permutation, ...]:
    """An order of `size` things for each of `units`, for the participant of this number.

    `random` takes from `draw`; `latin_square` gives the participant a row and each unit the next one; `full`
    counts through all sequences of orders.
    """
    match mode:
        case "fixed":
            return (tuple(range(size)),) * units
        case "random":
            return tuple(tuple(int(i) for i in draw.permutation(size)) for _ in range(units))
        case "latin_square":
            rows = latin_square(size)
            row = turn.of(len(rows))
            return tuple(rows[(row + unit) % len(rows)] for unit in range(units))
        case "full":
            each = permutations_count(size)
            place = turn.of(each**units)
            return tuple(permutation_of(place // each**unit % each, size) for unit in range(units))


def bits(mode: Order, units: int, draw: Generator, turn: Turn) -> tuple[int, ...]:
    """0 or 1 for each of `units`; `fixed` takes turns from 0, `latin_square` takes turns from either."""
    match mode:
        case "fixed":
            return tuple(unit % 2 for unit in range(units))
        case "random":
            return tuple(int(bit) for bit in draw.integers(2, size=units))
        case "latin_square":
            first = turn.of(2)
            return tuple((first + unit) % 2 for unit in range(units))
        case "full":
            place = turn.of(2**units)
            return tuple(place >> unit & 1 for unit in range(units))


def picks(mode: Order, things: int, chosen: int, draw: Generator, turn: Turn) -> Permutation:
    """`chosen` different ones of `things`, each thing equally often in each role (`latin_square`, `full`)."""
    match mode:
        case "fixed":
            return tuple(range(chosen))
        case "random":
            return tuple(int(i) for i in draw.permutation(things)[:chosen])
        case "latin_square":
            row = latin_square(things)[turn.of(len(latin_square(things)))]
            return row[:chosen]
        case "full":
            count = permutations_count(things, chosen)
            return permutation_of(turn.of(count), things, chosen)


def spread(mode: Order, things: int, places: int, draw: Generator, turn: Turn) -> tuple[int, ...]:
    """One of `things` for each of `places`, each thing as often as every other up to one."""
    laid = [place % things for place in range(places)]
    match mode:
        case "fixed":
            return tuple(laid)
        case "random":
            drawn, where = draw.permutation(things), draw.permutation(places)
            return tuple(int(drawn[laid[place]]) for place in where)
        case "latin_square":
            row = turn.of(things)
            return tuple((one + row) % things for one in laid)
        case "full":
            names = permutation_of(turn.of(permutations_count(things)), things)
            return tuple(names[one] for one in laid)
