"""A process that serves a store until it is killed: `python serving.py FILE` prints what it did."""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from galley.errors import GalleyError
from galley.records import Store
from tests.records.helpers import START_MS, begin, joint_actions, open_round, tick_rows


def main(file: str) -> None:
    """Journal a tick every few milliseconds and store an answer now and then, telling of each afterwards."""
    try:
        store = Store.open(file, serving=True)
    except GalleyError as error:
        sys.exit(str(error))
    visit = begin(store)
    round_id = open_round(store, visit)
    print(f"serving {visit.id} {round_id}", flush=True)
    for row in tick_rows(joint_actions(1, 5000)):
        store.journal(round_id, [row])
        print(f"tick {row.tick} {time.monotonic()}", flush=True)
        if row.tick % 20 == 0:
            store.save_answers(
                visit.id, f"step-{row.tick}", {"tick": row.tick}, 1, "active", START_MS
            ).result()
            print(f"answer {row.tick}", flush=True)
        time.sleep(0.005)


if __name__ == "__main__":
    main(sys.argv[1])
