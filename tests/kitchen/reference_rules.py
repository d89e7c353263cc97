"""The rules once more, slowly and from their description alone, to compare the kernel with."""

from __future__ import annotations

from dataclasses import dataclass, field

from galley.kitchen import ChefView, KitchenView, Layout
from tests.kitchen.pots import kind_of, pot_of

Place = tuple[int, int]
AHEAD = ((0, -1), (0, 1), (1, 0), (-1, 0))
DISPENSED = {"O": "onion", "T": "tomato", "D": "dish"}
NAMES = ("", "onion", "tomato", "dish", "onion soup", "tomato soup")


@dataclass
class Chef:
    at: Place
    facing: int
    holds: str = ""


@dataclass
class Pot:
    inside: list[str] = field(default_factory=list)
    ticks: int = 0


@dataclass
class SlowKitchen:
    layout: Layout
    chefs: list[Chef]
    counters: dict[Place, str]
    pots: dict[Place, Pot]
    tick: int
    orders_left: list[str] | None
    delivered: int = 0

    @classmethod
    def of(cls, layout: Layout, seen: KitchenView) -> SlowKitchen:
        orders = layout.rules.orders
        return cls(
            layout,
            [Chef((chef.x, chef.y), chef.facing, NAMES[chef.held]) for chef in seen.chefs],
            {place: NAMES[thing] for place, thing in seen.things.items()},
            {place: Pot([NAMES[kind_of(pot)]] * pot.count, pot.ticks) for place, pot in seen.pots.items()},
            seen.tick,
            None if orders is None else list(orders[seen.orders_delivered :]),
            seen.deliveries,
        )

    def view(self) -> KitchenView:
        pots = {}
        for place, pot in self.pots.items():
            kind = NAMES.index(pot.inside[0]) if pot.inside else 0
            ready = len(pot.inside) == 3 and pot.ticks >= self.layout.rules.cook_time_ticks
            pots[place] = pot_of(kind, len(pot.inside), pot.ticks, ready)
        first, second = (ChefView(*chef.at, chef.facing, NAMES.index(chef.holds)) for chef in self.chefs)
        left = 0 if self.orders_left is None else len(self.layout.rules.orders or ()) - len(self.orders_left)
        return KitchenView(
            (first, second),
            {place: NAMES.index(thing) for place, thing in self.counters.items()},
            pots,
            self.tick,
            left,
            self.delivered,
            self.delivered * self.layout.rules.delivery_reward,
        )

    @property
    def done(self) -> bool:
        return self.tick >= self.layout.rules.horizon_ticks or self.orders_left == []

    def tile(self, place: Place) -> str:
        tile = self.layout.grid[place[1]][place[0]]
        return " " if tile in "12" else tile

    def step(self, actions: tuple[int, int]) -> int:
        if self.done:
            return 0
        reward = 0
        for chef, action in zip(self.chefs, actions, strict=True):
            if action == 5 and self.orders_left != []:
                reward += self.interact(chef)
        wanted = []
        for chef, action in zip(self.chefs, actions, strict=True):
            goal = chef.at
            if action < 4:
                chef.facing = action
                goal = (chef.at[0] + AHEAD[action][0], chef.at[1] + AHEAD[action][1])
            wanted.append(goal if self.tile(goal) == " " else chef.at)
        a, b = (chef.at for chef in self.chefs)
        if wanted[0] != wanted[1] and wanted != [b, a]:
            self.chefs[0].at, self.chefs[1].at = wanted
        for pot in self.pots.values():
            if len(pot.inside) == 3 and pot.ticks < self.layout.rules.cook_time_ticks:
                pot.ticks += 1
        self.tick += 1
        return reward

    def interact(self, chef: Chef) -> int:
        place = (chef.at[0] + AHEAD[chef.facing][0], chef.at[1] + AHEAD[chef.facing][1])
        tile = self.tile(place)
        if tile == "X":
            lying = self.counters.pop(place, "")
            if chef.holds and lying:
                self.counters[place] = lying
            elif chef.holds:
                self.counters[place], chef.holds = chef.holds, ""
            else:
                chef.holds = lying
        elif tile in DISPENSED and not chef.holds:
            chef.holds = DISPENSED[tile]
        elif tile == "P":
            self.use(self.pots[place], chef)
        elif tile == "S" and chef.holds.endswith("soup"):
            kind = chef.holds.removesuffix(" soup")
            chef.holds = ""
            if self.orders_left is None or self.orders_left[0] == kind:
                self.orders_left = None if self.orders_left is None else self.orders_left[1:]
                self.delivered += 1
                return self.layout.rules.delivery_reward
        return 0

    def use(self, pot: Pot, chef: Chef) -> None:
        if chef.holds in ("onion", "tomato") and len(pot.inside) < 3 and set(pot.inside) <= {chef.holds}:
            pot.inside.append(chef.holds)
            chef.holds = ""
        elif chef.holds == "dish" and len(pot.inside) == 3 and pot.ticks >= self.layout.rules.cook_time_ticks:
            chef.holds = f"{pot.inside[0]} soup"
            pot.inside, pot.ticks = [], 0
