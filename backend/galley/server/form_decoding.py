"""Reads submitted forms: small ones, in the one encoding that our pages send."""

from __future__ import annotations

from collections.abc import Mapping
from urllib.parse import parse_qsl

from starlette.requests import ClientDisconnect, Request

MAX_FIELDS = 1000
FORM_TYPE = "application/x-www-form-urlencoded"


class FormError(ValueError):
    """A body that cannot be read as a form; `status` is the HTTP status that says so."""

    def __init__(self, status: int, reason: str) -> None:
        super().__init__(reason)
        self.status = status


async def read_form(request: Request, max_bytes: int) -> Mapping[str, list[str]]:
    """Every field of the request's form with its values in order; blank ones are kept.

    Raises:
        FormError: it is not urlencoded, longer than `max_bytes`, breaks off, or has over MAX_FIELDS fields.
    """
    kind = request.headers.get("content-type", FORM_TYPE).split(";")[0].strip().lower()
    if kind != FORM_TYPE:
        raise FormError(415, f"forms are sent as {FORM_TYPE}")
    body = bytearray()
    try:
        async for chunk in request.stream():
            body += chunk
            if len(body) > max_bytes:
                raise FormError(413, f"forms have at most {max_bytes} bytes")
    except ClientDisconnect:  # nobody is there to read an answer
        raise FormError(400, "the form broke off") from None
    try:
        pairs = parse_qsl(body.decode("ascii", "replace"), keep_blank_values=True, max_num_fields=MAX_FIELDS)
    except ValueError as error:
        raise FormError(400, f"forms have at most {MAX_FIELDS} fields") from error
    form: dict[str, list[str]] = {}
    for name, value in pairs:
        form.setdefault(name, []).append(value)
    return form
