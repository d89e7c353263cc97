"""Libraries that only some commands need: which extra brings each, for one line instead of a traceback."""

from __future__ import annotations

from typing import Final

from galley.errors import GalleyError

EXTRA_OF: Final = {
    "torch": "learn",
    "onnx": "learn",
    "onnxscript": "learn",
    "tqdm": "learn",
    "tensorboard": "learn",
    "matplotlib": "plot",
    "networkx": "plot",
    "psycopg": "postgres",
    "pyarrow": "parquet",
    "distributed": "evaluate",
    "dask": "evaluate",
    "resvg_py": "video",
    "PIL": "video",
    "av": "video",
}
"""The extra to install for what is imported by these names."""


def lacking(error: ImportError) -> GalleyError | None:
    """What to tell of an import that failed; None where no extra of ours would bring what it wants."""
    library = (error.name or "").partition(".")[0]
    extra = EXTRA_OF.get(library)
    if extra is None:
        return None
    return GalleyError(f"this command needs {library}; install it: pip install 'galley[{extra}]'")
