"""What did happen: visits, answers and rounds in one database, and the ways to write, read and check them."""

from galley.records.database.leases import Lease, LeaseLost
from galley.records.rows import (
    Arrival,
    Begun,
    ClockRow,
    Health,
    KeyRow,
    NewRound,
    PauseRow,
    Planned,
    RoundRow,
    SeatRow,
    SlotRow,
    StandInRow,
    TickRow,
    VisitRow,
)
from galley.records.store.store import Store

__all__ = [
    "Arrival",
    "Begun",
    "ClockRow",
    "Health",
    "KeyRow",
    "Lease",
    "LeaseLost",
    "NewRound",
    "PauseRow",
    "Planned",
    "RoundRow",
    "SeatRow",
    "SlotRow",
    "StandInRow",
    "Store",
    "TickRow",
    "VisitRow",
]
