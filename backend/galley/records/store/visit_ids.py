"""What a visit is known by: the secret of its link, and its participant's name in every export."""

from __future__ import annotations

import base64
import secrets


def link_secret() -> str:
    """The token of a new visit's link, which nobody can guess."""
    return secrets.token_urlsafe(24)


def participant_name() -> str:
    """The name of a new visit's participant in exports; it has nothing to do with the link."""
    return "p" + base64.b32encode(secrets.token_bytes(10)).decode().lower()
