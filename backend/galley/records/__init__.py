"""What did happen: visits, answers and rounds in one database, and the ways to write, read and check them."""

from galley.records.rows import ClockRow, Health, KeyRow, PauseRow, RoundRow, SeatRow, TickRow, VisitRow
from galley.records.store import Store

__all__ = [
    "ClockRow",
    "Health",
    "KeyRow",
    "PauseRow",
    "RoundRow",
    "SeatRow",
    "Store",
    "TickRow",
    "VisitRow",
]
