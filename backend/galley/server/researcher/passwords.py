"""Researchers' passwords: only salted Argon2id hashes of them are ever kept."""

from __future__ import annotations

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError

from galley.errors import GalleyError

SHORTEST = 10
LONGEST = 1000
LONGEST_NAME = 100

# 19 MiB, two passes: a login must not swell a serving process, nor keep a core from the rounds for long.
# Source: OWASP Password Storage Cheat Sheet, Argon2id, the second of its equally strong settings.
PASSES = 2
MEMORY_KIB = 19 * 1024


class Passwords:
    """Hashes passwords and checks them; both take tens of milliseconds on purpose."""

    def __init__(self) -> None:
        self._hasher = PasswordHasher(time_cost=PASSES, memory_cost=MEMORY_KIB, parallelism=1)
        self._nobody = self._hasher.hash("nobody has this password")

    def hashed(self, password: str) -> str:
        """What is stored of a password.

        Raises:
            GalleyError: it is too short or too long.
        """
        if not SHORTEST <= len(password) <= LONGEST:
            raise GalleyError(f"a password has {SHORTEST} to {LONGEST} characters, not {len(password)}")
        return self._hasher.hash(password)

    def right(self, password: str, stored: str | None) -> bool:
        """Whether a password is the stored one; takes as long when there is none (`stored` is None)."""
        try:
            self._hasher.verify(self._nobody if stored is None else stored, password)
        except (VerificationError, InvalidHashError):
            return False
        return stored is not None


def checked_name(name: str) -> str:
    """The name of a researcher as it is kept.

    Raises:
        GalleyError: it cannot be a name.
    """
    kept = name.strip()
    if not kept or len(kept) > LONGEST_NAME or not kept.isprintable():
        raise GalleyError(f"a researcher's name has 1 to {LONGEST_NAME} printable characters, not {name!r}")
    return kept
