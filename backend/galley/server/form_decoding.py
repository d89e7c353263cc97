"""Reads submitted forms: small ones, in the one encoding that our pages send."""

from __future__ import annotations

from collections.abc import Mapping
from urllib.parse import parse_qsl

from starlette.requests import ClientDisconnect, Request

OWN_BYTES, OWN_FIELDS = 4096, 20
"""What the fields of the pages themselves take at most."""
READ_ON_BYTES = 4 * 1024 * 1024
"""How much of a form that is too long is read and dropped: browsers show an answer only once all is sent."""
MAX_FIELDS = 1000
"""How many fields a form may have of which nothing else is known."""
FORM_TYPE = "application/x-www-form-urlencoded"


class FormError(ValueError):
    """A body that cannot be read as a form; `status` is the HTTP status that says so."""

    def __init__(self, status: int, reason: str) -> None:
        super().__init__(reason)
        self.status = status


async def read_form(
    request: Request, max_bytes: int, expected: tuple[int, int] = (0, 0)
) -> Mapping[str, list[str]]:
    """Every field of the request's form with its values in order; blank ones are kept.

    `expected` are the bytes and fields that the questions of the page may take, if they are more.

    Raises:
        FormError: it is not urlencoded, longer than `max_bytes`, breaks off, or has over MAX_FIELDS fields.
    """
    max_bytes = max(max_bytes, expected[0] + OWN_BYTES)
    max_fields = max(MAX_FIELDS, expected[1] + OWN_FIELDS)
    kind = request.headers.get("content-type", FORM_TYPE).split(";")[0].strip().lower()
    if kind != FORM_TYPE:
        raise FormError(415, f"forms are sent as {FORM_TYPE}")
    body, received = bytearray(), 0
    try:
        async for chunk in request.stream():
            received += len(chunk)
            if received <= max_bytes:
                body += chunk
            elif received > max_bytes + READ_ON_BYTES:
                break
    except ClientDisconnect:  # nobody is there to read an answer
        raise FormError(400, "the form broke off") from None
    if received > max_bytes:
        raise FormError(413, f"forms have at most {max_bytes} bytes")
    try:
        pairs = parse_qsl(body.decode("ascii", "replace"), keep_blank_values=True, max_num_fields=max_fields)
    except ValueError as error:
        raise FormError(400, f"forms have at most {max_fields} fields") from error
    form: dict[str, list[str]] = {}
    for name, value in pairs:
        form.setdefault(name, []).append(value)
    return form
