"""From a browser that came to one serving process to the round that another one has, and back."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import Final

import httpx
from starlette.websockets import WebSocket, WebSocketDisconnect
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException

from galley.errors import GalleyError
from galley.protocol.messages import CLOSE_BUSY, CLOSE_NORMAL, CLOSE_RESTART

LOG = logging.getLogger(__name__)
RELAYED: Final = "x-galley-relayed"
"""What comes with this header is not passed on again: its sender took this process for the owner."""

OPEN_WITHIN_S = 2.0
FORM_WITHIN_S = 10.0
PING_EVERY_S = 5.0
PING_WITHIN_S = 10.0
NO_CODE = 1006
FOR_BROWSERS = range(1000, 5000)
UNSENDABLE = (1004, 1005, NO_CODE, 1015)


async def pass_on(
    websocket: WebSocket, address: str, path: str, hello: str | bytes, pace: Callable[[], Awaitable[None]]
) -> int:
    """Carry frames both ways until either side closes; the code to close the browser's connection with.

    `hello` is what the browser said already; `pace` waits as long as the browser has to before its next
    message.
    """
    try:
        async with connect(
            f"ws://{address}{path}",
            additional_headers={RELAYED: "1"},
            compression=None,
            proxy=None,
            open_timeout=OPEN_WITHIN_S,
            ping_interval=PING_EVERY_S,
            ping_timeout=PING_WITHIN_S,
        ) as there:
            await there.send(hello)
            ways = [
                asyncio.create_task(_up(websocket, there, pace)),
                asyncio.create_task(_down(there, websocket)),
            ]
            try:
                await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
            finally:
                for way in ways:
                    way.cancel()
                await asyncio.gather(*ways, return_exceptions=True)
        code = there.close_code
    except (OSError, TimeoutError, WebSocketException) as error:
        LOG.info("the server at %s cannot be reached: %s", address, error)
        return CLOSE_BUSY
    if code is None or code not in FOR_BROWSERS or code in UNSENDABLE:
        return CLOSE_BUSY
    return code


async def _up(websocket: WebSocket, there: ClientConnection, pace: Callable[[], Awaitable[None]]) -> None:
    try:
        while True:
            event = await websocket.receive()
            if event["type"] == "websocket.disconnect":
                await there.close(CLOSE_RESTART if event.get("code") == CLOSE_RESTART else CLOSE_NORMAL)
                return
            text = event.get("text")
            await there.send(event.get("bytes") or b"" if text is None else text)
            await pace()
    except WebSocketException:
        return


async def _down(there: ClientConnection, websocket: WebSocket) -> None:
    try:
        async for frame in there:
            await websocket.send_text(frame if isinstance(frame, str) else frame.decode())
    except (WebSocketException, WebSocketDisconnect, RuntimeError, OSError):
        return


async def hand_over(address: str, path: str, form: Mapping[str, Sequence[str]]) -> None:
    """Return once the process at `address` has used a form.

    Raises:
        GalleyError: it cannot be reached or did not use it.
    """
    fields = {name: list(values) for name, values in form.items()}
    try:
        async with httpx.AsyncClient(trust_env=False, timeout=FORM_WITHIN_S) as http:
            answer = await http.post(f"http://{address}{path}", data=fields, headers={RELAYED: "1"})
    except httpx.HTTPError as error:
        raise GalleyError(
            f"the server at {address}, which has the round, cannot be reached: {error}"
        ) from None
    if answer.status_code >= 400:
        raise GalleyError(f"the server at {address}, which has the round, answered {answer.status_code}")
