"""Every kernel compiled (or fetched from Numba's cache) before it is needed."""

from __future__ import annotations

import numpy as np

from galley.kitchen.batch import KitchenBatch
from galley.kitchen.codes import OUT_SIZE, STAY
from galley.kitchen.kitchen import Kitchen
from galley.kitchen.layout import Layout
from galley.kitchen.observations import ENCODINGS, Encoder
from galley.kitchen.rules.tick import run
from galley.kitchen.state import state_size


def warm() -> None:
    """Compile, or fetch from the cache, all that kitchens call. Takes seconds the first time on a machine."""
    layout = Layout.from_ascii("warm", "XPOX\nX12X\nXDSX")
    kitchen = Kitchen(layout)
    kitchen.step(STAY, STAY)
    _ = kitchen.done
    batch = KitchenBatch(layout, 1)
    batch.step(np.full((1, 2), STAY))
    out = np.zeros((1, OUT_SIZE), dtype=np.int32)
    states = np.zeros((2, state_size(layout)), dtype=np.int16)
    run(layout.spec, kitchen.state, np.full((1, 2), STAY, dtype=np.uint8), states, out)
    for name in ENCODINGS:
        encoder = Encoder(layout, name)
        encoder.both(batch.states)
        encoder.seat(batch.states, 0)
