"""`galley learn`: agents made from data (needs the extra `learn`)."""

from __future__ import annotations

import importlib.util

import typer

from galley.errors import GalleyError

app = typer.Typer(help="Make agents (needs PyTorch: pip install 'galley[learn]').", no_args_is_help=True)


def _need_torch() -> None:
    for module in ("torch", "onnx"):
        if importlib.util.find_spec(module) is None:
            raise GalleyError(f"galley learn needs {module}; install it with: pip install 'galley[learn]'")
