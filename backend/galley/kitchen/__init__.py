"""The kitchen: layouts, rules, observations, trajectories. Needs NumPy and Numba only."""

from galley.kitchen.batch import KitchenBatch
from galley.kitchen.codes import ACTIONS, EAST, FACINGS, INTERACT, NORTH, SOUTH, STAY, THINGS, WEST
from galley.kitchen.events import EVENTS, Event, decode
from galley.kitchen.kitchen import Kitchen
from galley.kitchen.layout import Layout, Rules
from galley.kitchen.observations import ENCODINGS, Encoder
from galley.kitchen.state import ChefView, KitchenView, PotView, from_view, state_size, view
from galley.kitchen.warm_up import warm

__all__ = [
    "ACTIONS",
    "EAST",
    "ENCODINGS",
    "EVENTS",
    "FACINGS",
    "INTERACT",
    "NORTH",
    "SOUTH",
    "STAY",
    "THINGS",
    "WEST",
    "ChefView",
    "Encoder",
    "Event",
    "Kitchen",
    "KitchenBatch",
    "KitchenView",
    "Layout",
    "PotView",
    "Rules",
    "decode",
    "from_view",
    "state_size",
    "view",
    "warm",
]
