"""Policies of PyTorch as ONNX: TorchScript files and state dicts."""

from __future__ import annotations

import importlib
import sys
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import torch
from torch import nn

from galley.agents.admission.adding import Converted
from galley.errors import GalleyError
from galley.files.scratch import Scratch
from galley.learning.bundles.described_network import described_onnx, network_named
from galley.learning.bundles.onnx_adapting import conform
from galley.learning.bundles.onnx_writing import OPSET

WRAPPINGS: Final = ("state_dict", "model_state_dict", "model", "policy", "actor")
"""Keys under which checkpoints keep the state dict itself."""

COMPILED: Final = "_orig_mod."
"""What `torch.compile` puts into the names of a compiled network, and of compiled parts of one."""


def from_torchscript(path: Path, shape: tuple[int, ...]) -> Converted:
    """A TorchScript policy as ONNX. TorchScript is a program: it is run here, once, to be exported.

    Raises:
        GalleyError: it cannot be read, run on observations of `shape`, or exported.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # PyTorch calls TorchScript deprecated; people still bring it
        try:
            module = torch.jit.load(str(path), map_location="cpu")
        except (RuntimeError, ValueError) as error:
            raise GalleyError(f"the file is not TorchScript ({_first_line(error)})") from None
    return _exported(module, shape)


def from_state_dict(path: Path, network: str, shape: tuple[int, ...]) -> Converted:
    """A state dict with the network of a known name, of a description, or of a class `module:Class`.

    The file is read with `weights_only=True`, so no code in it is run. `module:Class` imports that module,
    from the working directory too: it is the one way that runs code of others, and only when asked for.

    Raises:
        GalleyError: file and network cannot be read, or do not fit each other.
    """
    tensors, notes = _state_dict(path)
    whole_class = ":" in network and not Path(network).is_file()
    try:
        content, more = _with_weights(network, tensors, shape, whole_class)
    except GalleyError:
        shared, bare = _without_shared_prefix(tensors)
        if not shared:
            raise
        try:
            content, more = _with_weights(network, bare, shape, whole_class)
        except GalleyError:
            pass
        else:
            return Converted(content, (*notes, f"names of tensors without the shared '{shared}'", *more))
        raise
    return Converted(content, (*notes, *more))


def _with_weights(
    network: str, tensors: Mapping[str, torch.Tensor], shape: tuple[int, ...], whole_class: bool
) -> tuple[bytes, tuple[str, ...]]:
    """ONNX of a class or of a described network with these weights, and what had to be mended."""
    if whole_class:
        module = _made(network)
        try:
            module.load_state_dict(tensors)
        except RuntimeError as error:
            raise GalleyError(" ".join(str(error).split())[:500]) from None
        made = _exported(module, shape)
    else:
        arrays = {name: tensor.detach().float().numpy() for name, tensor in tensors.items()}
        made = conform(described_onnx(network_named(network), arrays, shape), shape)
    return made.content, made.notes


def _without_shared_prefix(tensors: Mapping[str, torch.Tensor]) -> tuple[str, dict[str, torch.Tensor]]:
    """The parts that open every name, such as `module.` of DataParallel, and the tensors without them."""
    shared = ""
    bare = dict(tensors)
    while len({name.partition(".")[0] for name in bare}) == 1 and all("." in name for name in bare):
        first = next(iter(bare)).partition(".")[0] + "."
        shared += first
        bare = {name.removeprefix(first): tensor for name, tensor in bare.items()}
    return shared, bare


def _state_dict(path: Path) -> tuple[dict[str, torch.Tensor], tuple[str, ...]]:
    try:
        found: Any = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # pickle's and zip's errors, all meaning the same here
        raise GalleyError(
            "the file is no state dict that can be read without running its code "
            f"({_first_line(error)}); save it with torch.save(model.state_dict(), FILE)"
        ) from None
    notes: tuple[str, ...] = ("exported from a PyTorch state dict",)
    if isinstance(found, dict):
        for key in WRAPPINGS:
            if isinstance(found.get(key), dict):
                found, notes = found[key], (f"exported from a PyTorch state dict under '{key}'",)
                break
    if not isinstance(found, dict) or not found or not all(torch.is_tensor(one) for one in found.values()):
        keys = f" with keys {', '.join(map(str, found))}"[:500] if isinstance(found, dict) else ""
        raise GalleyError(f"the file holds {type(found).__name__}{keys}, not a state dict of tensors")
    if any(COMPILED in name for name in found):
        found = {name.replace(COMPILED, ""): tensor for name, tensor in found.items()}
        notes = (*notes, f"names of tensors without '{COMPILED}' of torch.compile")
    return found, notes


def _made(network: str) -> nn.Module:
    module_name, _, class_name = network.partition(":")
    sys.path.insert(0, str(Path.cwd()))
    try:
        made = getattr(importlib.import_module(module_name), class_name)()
    except Exception as error:  # whatever the module of someone else raises
        raise GalleyError(f"--network {network}: {type(error).__name__}: {_first_line(error)}") from None
    finally:
        sys.path.pop(0)
    if not isinstance(made, nn.Module):
        raise GalleyError(f"--network {network}: the class is no torch.nn.Module")
    return made


def _exported(module: nn.Module, shape: tuple[int, ...]) -> Converted:
    """The module as ONNX, whatever its batch size turns out to be."""
    module.eval()
    axes = {"observation": {0: "B"}, "output": {0: "B"}}
    with Scratch("galley-torch-") as folder, warnings.catch_warnings():
        path = folder / "policy.onnx"
        warnings.simplefilter("ignore")  # tracing warns of what `conform` then finds out by trying
        try:
            torch.onnx.export(
                module,
                (torch.zeros(1, *shape),),
                path,
                dynamo=False,
                input_names=["observation"],
                output_names=["output"],
                dynamic_axes=axes,
                opset_version=OPSET,
            )
        except Exception as error:  # the exporter raises errors of many kinds
            raise GalleyError(
                f"PyTorch {torch.__version__} cannot export it for observations {[1, *shape]} "
                f"({_first_line(error)}); export it to ONNX yourself and add that"
            ) from None
        made = conform(path, shape)
    notes = tuple(note for note in made.notes if "renamed" not in note)
    return Converted(made.content, (f"exported to ONNX by PyTorch {torch.__version__}", *notes))


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:200]
