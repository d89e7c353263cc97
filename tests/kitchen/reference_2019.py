"""The two encodings of 2019 once more, slowly and from their description alone."""

from __future__ import annotations

from collections import deque

from galley.kitchen import KitchenView, Layout

Place = tuple[int, int]
AHEAD = ((0, -1), (0, 1), (1, 0), (-1, 0))
ONION, DISH, SOUP = 1, 3, 4


def tile(layout: Layout, place: Place) -> str:
    letter = layout.grid[place[1]][place[0]]
    return " " if letter in "12" else letter


def cells(layout: Layout, letter: str) -> list[Place]:
    """In row-major order."""
    places = [(x, y) for y in range(layout.height) for x in range(layout.width)]
    return [place for place in places if tile(layout, place) == letter]


def grid(layout: Layout, seen: KitchenView, seat: int) -> list[list[list[int]]]:
    """[x][y][channel] of `overcooked-2019-grid`."""
    shown = [[[0] * 20 for _ in range(layout.height)] for _ in range(layout.width)]

    def mark(place: Place, channel: int, value: int = 1) -> None:
        shown[place[0]][place[1]][channel] = value

    for player, chef in enumerate((seen.chefs[seat], seen.chefs[1 - seat])):
        mark((chef.x, chef.y), player)
        mark((chef.x, chef.y), 2 + 4 * player + chef.facing)
    for channel, letter in enumerate("PXODS", 10):
        for place in cells(layout, letter):
            mark(place, channel)
    for kind, channel in ((SOUP, 17), (DISH, 18), (ONION, 19)):
        held = [(chef.x, chef.y) for chef in seen.chefs if chef.held == kind]
        lying = [place for place, thing in seen.things.items() if thing == kind]
        for place in held or lying:  # the fault: with one held, those that lie are left out
            mark(place, channel)
        if kind == SOUP and not held:
            for place, pot in seen.pots.items():
                mark(place, 15, pot.count)
                mark(place, 16, pot.ticks)
    return shown


def actions_to_face(layout: Layout, start: tuple[int, int, int], target: Place) -> int | None:
    """The fewest moves until the chef stands beside the target and faces it, breadth first."""
    queue = deque([(start, 0)])
    seen = {start}
    while queue:
        (x, y, facing), moves = queue.popleft()
        if (x + AHEAD[facing][0], y + AHEAD[facing][1]) == target:
            return moves
        for action, (dx, dy) in enumerate(AHEAD):
            free = tile(layout, (x + dx, y + dy)) == " "
            after = (x + dx, y + dy, action) if free else (x, y, action)
            if after not in seen:
                seen.add(after)
                queue.append((after, moves + 1))
    return None


def player(layout: Layout, seen: KitchenView, seat: int) -> list[int]:
    """The 29 numbers of one player."""
    chef = seen.chefs[seat]

    def offset(targets: list[Place]) -> list[int]:
        reached = []
        for order, target in enumerate(targets):
            moves = actions_to_face(layout, (chef.x, chef.y, chef.facing), target)
            if moves is not None:
                reached.append((moves, order, target))
        if not reached:
            return [0, 0]
        x, y = min(reached)[2]
        return [x - chef.x, y - chef.y]

    pots = cells(layout, "P")
    full = [place for place in pots if seen.pots[place].count == 3]
    ready = [place for place in full if seen.pots[place].ready]
    numbers = [int(chef.facing == facing) for facing in range(4)]
    numbers += [int(chef.held == kind) for kind in (ONION, SOUP, DISH)]
    numbers += [0, 0] if chef.held == ONION else offset(cells(layout, "O"))
    numbers += offset([place for place in pots if seen.pots[place].count == 0])
    numbers += [0, 0, 0, 0]
    numbers += offset([place for place in full if place not in ready])
    numbers += offset(ready)
    numbers += [0, 0] if chef.held == DISH else offset(cells(layout, "D"))
    numbers += [0, 0]
    numbers += offset(cells(layout, "S"))
    numbers += [int(tile(layout, (chef.x + dx, chef.y + dy)) != " ") for dx, dy in AHEAD]
    return numbers


def features(layout: Layout, seen: KitchenView, seat: int) -> list[int]:
    """The 62 numbers of `overcooked-2019-features`."""
    own, other, first = seen.chefs[seat], seen.chefs[1 - seat], seen.chefs[0]
    between = [other.x - own.x, other.y - own.y]
    return [*player(layout, seen, seat), *player(layout, seen, 1 - seat), *between, first.x, first.y]
