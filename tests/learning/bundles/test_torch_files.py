"""PyTorch policies become ONNX that answers as PyTorch does, and no file runs code to get there."""

from __future__ import annotations

import os
import pickle
import shutil
import subprocess
import sys
import warnings
import zipfile
from pathlib import Path

import numpy as np
import onnxruntime as ort
import pytest
import torch
from torch import nn

from galley.errors import GalleyError, InvalidFiles
from galley.learning.bundles.described_network import KNOWN, described_onnx, network_named
from galley.learning.bundles.onnx_adapting import conform
from galley.learning.bundles.torch_files import from_state_dict, from_torchscript
from tests.agents.admission.newcomers import cole_weights
from tests.serving import run_galley

ROOT = Path(__file__).parents[3]

GRID = (26, 4, 5)
SEEN = np.random.default_rng(2).integers(0, 3, (6, *GRID)).astype(np.float32)


def cole() -> nn.Sequential:
    """The paper's network in PyTorch, its weights those of `cole_weights`."""
    made = nn.Sequential(
        *(nn.Conv2d(26, 25, 5, padding=2), nn.LeakyReLU(0.2)),
        *(nn.Conv2d(25, 25, 3, padding=1), nn.LeakyReLU(0.2)),
        *(nn.Conv2d(25, 25, 3), nn.LeakyReLU(0.2), nn.Flatten()),
        *(nn.Linear(25 * 2 * 3, 64), nn.LeakyReLU(0.2)),
        *(nn.Linear(64, 64), nn.LeakyReLU(0.2)),
        *(nn.Linear(64, 64), nn.LeakyReLU(0.2)),
        nn.Linear(64, 6),
    )
    weights = list(cole_weights(GRID).values())
    with torch.no_grad():
        for parameter, numbers in zip(made.parameters(), weights, strict=True):
            parameter.copy_(torch.from_numpy(numbers))
    return made.eval()


def answers(content: bytes, seen: np.ndarray = SEEN) -> np.ndarray:
    session = ort.InferenceSession(content, providers=["CPUExecutionProvider"])
    return np.asarray(session.run(["logits"], {"observation": seen})[0])


def wanted(network: nn.Module) -> np.ndarray:
    with torch.no_grad():
        return np.asarray(network(torch.from_numpy(SEEN)).numpy())


def traced(path: Path, network: nn.Module, rows: int) -> Path:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch.jit.save(torch.jit.trace(network, torch.zeros(rows, *GRID)), str(path))
    return path


@pytest.mark.parametrize("rows", [1, 2])
def test_torchscript(tmp_path: Path, rows: int) -> None:
    network = cole()
    made = from_torchscript(traced(tmp_path / "policy.pt", network, rows), GRID)
    assert np.allclose(answers(made.content), wanted(network), atol=1e-4)
    assert "exported to ONNX by PyTorch" in made.notes[0]


def test_torchscript_that_ends_in_a_softmax(tmp_path: Path) -> None:
    network = nn.Sequential(*cole(), nn.Softmax(dim=1))
    made = from_torchscript(traced(tmp_path / "policy.pt", network, 1), GRID)
    assert np.allclose(answers(made.content), wanted(cole()), atol=1e-4)


def test_a_state_dict_with_a_known_network(tmp_path: Path) -> None:
    network = cole()
    torch.save({"state_dict": network.state_dict(), "step": 5}, tmp_path / "policy.pth")
    made = from_state_dict(tmp_path / "policy.pth", "cole-cnn", GRID)
    assert np.allclose(answers(made.content), wanted(network), atol=1e-4)
    assert made.notes == ("exported from a PyTorch state dict under 'state_dict'",)


DESCRIBED = """\
format: 1
channels: last
ignore: [critic.]
layers:
  - {kind: conv, filters: 8, kernel: 3, stride: 2, padding: 1, activation: relu, weights: body.0}
  - {kind: dense, width: 16, activation: elu}
  - {kind: dense, width: 6, weights: head}
"""


def test_a_state_dict_with_a_network_of_ones_own(tmp_path: Path) -> None:
    body = nn.Sequential(nn.Conv2d(20, 8, 3, stride=2, padding=1), nn.ReLU(), nn.Flatten(), nn.Linear(48, 16))
    head, critic = nn.Linear(16, 6), nn.Linear(16, 1)
    parts = {"head": head, "body": body, "critic": critic}
    tensors = {f"{name}.{key}": one for name, part in parts.items() for key, one in part.state_dict().items()}
    torch.save(tensors, tmp_path / "policy.pth")
    (tmp_path / "network.yaml").write_text(DESCRIBED, "utf-8")
    made = from_state_dict(tmp_path / "policy.pth", str(tmp_path / "network.yaml"), (5, 4, 20))
    seen = np.random.default_rng(0).random((3, 5, 4, 20)).astype(np.float32)
    with torch.no_grad():
        hidden = nn.functional.elu(body(torch.from_numpy(seen).permute(0, 3, 1, 2)))
        assert np.allclose(answers(made.content, seen), head(hidden).numpy(), atol=1e-4)


OWN = """\
format: 1
layers:
  - {kind: dense, width: 32, activation: relu, weights: body}
  - {kind: dense, width: 6, weights: actor}
ignore: [critic.]
"""


@pytest.mark.parametrize(
    "renamed",
    [
        "_orig_mod.{}.{}",
        "{}._orig_mod.{}",
        "module.{}.{}",
        "_orig_mod.module.{}.{}",
        "module._orig_mod.{}.{}",
        "agent.policy.{}.{}",
    ],
)
def test_f25_a_prefix_that_all_keys_share_is_left_out(tmp_path: Path, renamed: str) -> None:
    sizes = {"body": (26 * 4 * 5, 32), "actor": (32, 6), "critic": (32, 1)}
    parts = {name: nn.Linear(*size) for name, size in sizes.items()}
    tensors = {
        renamed.format(name, key): one
        for name, part in parts.items()
        for key, one in part.state_dict().items()
    }
    torch.save(tensors, tmp_path / "policy.pth")
    (tmp_path / "network.yaml").write_text(OWN, "utf-8")
    made = from_state_dict(tmp_path / "policy.pth", str(tmp_path / "network.yaml"), GRID)
    with torch.no_grad():
        hidden = torch.relu(parts["body"](torch.from_numpy(SEEN).flatten(1)))
        assert np.allclose(answers(made.content), parts["actor"](hidden).numpy(), atol=1e-4)
    assert "names of tensors without" in " ".join(made.notes)


def test_f25_a_description_that_names_the_prefix_is_taken_as_it_is(tmp_path: Path) -> None:
    part = nn.Linear(26 * 4 * 5, 6)
    torch.save({f"net.{key}": one for key, one in part.state_dict().items()}, tmp_path / "policy.pth")
    text = "format: 1\nlayers:\n  - {kind: dense, width: 6, weights: net}\n"
    (tmp_path / "network.yaml").write_text(text, "utf-8")
    made = from_state_dict(tmp_path / "policy.pth", str(tmp_path / "network.yaml"), GRID)
    assert made.notes[0] == "exported from a PyTorch state dict"
    assert "names of tensors" not in " ".join(made.notes)


def test_what_does_not_fit_is_told_all_at_once() -> None:
    weights = cole_weights((26, 5, 8))
    weights["extra.weight"] = np.zeros((2, 2), dtype=np.float32)
    with pytest.raises(GalleyError, match=r"no layer takes extra\.weight; describe them, or list them"):
        described_onnx(KNOWN["cole-cnn"], weights, GRID)
    del weights["extra.weight"]
    weights["net.0.bias"] = np.zeros(3, dtype=np.float32)
    with pytest.raises(GalleyError) as caught:
        described_onnx(KNOWN["cole-cnn"], weights, GRID)
    assert str(caught.value) == (
        "'net.0.bias' has shape [3], not [25]; 'net.3.weight' has shape [64, 450], not [64, 150]"
    )
    with pytest.raises(GalleyError, match="has 7 layers, the state dict weights for 1"):
        described_onnx(KNOWN["cole-cnn"], {"a.weight": weights["net.0.weight"]}, GRID)


def test_wrong_descriptions_are_told_with_their_lines(tmp_path: Path) -> None:
    path = tmp_path / "network.yaml"
    path.write_text(DESCRIBED.replace("filters: 8", "filters: none").replace("elu}", "gelu}"), "utf-8")
    with pytest.raises(InvalidFiles) as caught:
        network_named(str(path))
    assert [problem.line for problem in caught.value.problems] == [5, 6]
    with pytest.raises(GalleyError, match=r"'cole-cn' is neither a known network .* did you mean 'cole-cnn'"):
        network_named("cole-cn")


class Bomb:
    """Writes a file when it is unpickled by the usual loader."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (str(self.path),)


def test_no_code_in_a_file_is_run(tmp_path: Path) -> None:
    torch.save({"weight": Bomb(tmp_path / "ran")}, tmp_path / "policy.pth")
    (tmp_path / "plain.pth").write_bytes(pickle.dumps(Bomb(tmp_path / "ran")))
    for name in ("policy.pth", "plain.pth"):
        with pytest.raises(GalleyError, match="no state dict that can be read without running its code"):
            from_state_dict(tmp_path / name, "cole-cnn", GRID)
        with pytest.raises(GalleyError, match="not TorchScript"):
            from_torchscript(tmp_path / name, GRID)
    assert not (tmp_path / "ran").exists()


MODULE = """\
from torch import nn


class Policy(nn.Sequential):
    def __init__(self):
        super().__init__(nn.Flatten(), nn.Linear(520, 6))
"""


def test_a_class_is_imported_only_when_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "guest_networks.py").write_text(MODULE, "utf-8")
    network = nn.Sequential(nn.Flatten(), nn.Linear(520, 6))
    torch.save(network.state_dict(), tmp_path / "policy.pth")
    monkeypatch.chdir(tmp_path)
    made = from_state_dict(tmp_path / "policy.pth", "guest_networks:Policy", GRID)
    assert np.allclose(answers(made.content), wanted(network), atol=1e-4)
    for name, message in (
        ("guest_networks:Other", "AttributeError"),
        ("no_such:Thing", "ModuleNotFoundError"),
    ):
        with pytest.raises(GalleyError, match=message):
            from_state_dict(tmp_path / "policy.pth", name, GRID)


def test_without_the_extra_the_way_to_install_it_is_told(tmp_path: Path) -> None:
    code = (
        "import importlib.util, sys; found = importlib.util.find_spec\n"
        "importlib.util.find_spec = lambda name, *a: None if name in ('torch', 'onnx') else found(name, *a)\n"
        "from galley.cli import main; main()"
    )
    (tmp_path / "layouts").mkdir()
    root = Path(__file__).parents[3]
    (tmp_path / "layouts" / "room.yaml").write_bytes((root / "layouts" / "cramped_room.yaml").read_bytes())
    (tmp_path / "room.onnx").write_bytes(b"something")
    common = ["agents", "add", "room.onnx", "--name", "guest", "--encoding", "grid"]
    for more in (["--from", "torchscript"], ["--from", "state-dict", "--network", "cole-cnn"], []):
        done = subprocess.run(
            [sys.executable, "-c", code, *common, *more],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 1
        assert "pip install 'galley[learn]'" in done.stderr
        assert done.stderr.count("\n") == 1


def test_d12_what_pytorch_exports_as_its_documentation_shows_is_taken(tmp_path: Path) -> None:
    network = cole()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch.onnx.export(network, torch.zeros(1, *GRID), str(tmp_path / "a.onnx"), verbose=False)
    made = conform(tmp_path / "a.onnx", GRID)
    assert np.allclose(answers(made.content), wanted(network), atol=1e-4)


def _saved(path: Path, kind: str) -> None:
    network = nn.Linear(4, 6)
    if kind == "torch.save":
        torch.save(network.state_dict(), path)
    elif kind == "old torch.save":
        torch.save(network.state_dict(), path, _use_new_zipfile_serialization=False)
    elif kind == "torchscript":
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            torch.jit.save(torch.jit.script(network), str(path))
    elif kind == "stable-baselines3":
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("policy.pth", b"")
            archive.writestr("data", b"{}")
    elif kind == "keras":
        path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(64))


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        ("torch.save", "a file of torch.save; name `--from state-dict"),
        ("old torch.save", "a pickle (torch.save in its old form?); name `--from state-dict"),
        ("torchscript", "TorchScript; name `--from torchscript`"),
        ("stable-baselines3", "a zip with PyTorch files (as stable-baselines3 saves); take the .pth out"),
        ("keras", "an HDF5 file (Keras?); export it to ONNX"),
    ],
)
def test_d13_a_file_of_another_kind_is_told_how_it_is_added(tmp_path: Path, kind: str, told: str) -> None:
    (tmp_path / "layouts").mkdir()
    shutil.copy(ROOT / "layouts" / "cramped_room.yaml", tmp_path / "layouts")
    _saved(tmp_path / "policy.pth", kind)
    line = [
        "agents",
        "add",
        "policy.pth",
        "--name",
        "guest",
        "--encoding",
        "grid",
        "--layout",
        "cramped_room",
    ]
    refused = run_galley(*line, cwd=tmp_path)
    assert refused.returncode == 1
    assert f"this is no ONNX file but {told}" in refused.stderr
    assert refused.stderr.count("\n") == 1
