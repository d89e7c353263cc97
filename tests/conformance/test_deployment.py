"""The files that put Galley on servers name only what there is: files, settings, extras, services."""

from __future__ import annotations

import json
import re
import tomllib
from dataclasses import fields
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from galley.server.settings import SETTINGS, Settings, read_settings

ROOT = Path(__file__).parents[2]
COMPOSE: dict[str, Any] = YAML(typ="safe").load((ROOT / "docker-compose.yml").read_text("utf-8"))
DOCKERFILE = (ROOT / "Dockerfile").read_text("utf-8").replace("\\\n", " ")
CADDYFILE = (ROOT / "proxy" / "Caddyfile").read_text("utf-8")
OURS = {setting.env for setting in SETTINGS}
OF_LIBRARIES = {"PATH", "PYTHONUNBUFFERED", "NUMBA_CACHE_DIR", "FORWARDED_ALLOW_IPS"}
VARIABLE = re.compile(r"\$\{(\w+)(?::([-?])([^}]*))?\}")


def instructions(name: str) -> list[str]:
    return [line[len(name) :].strip() for line in DOCKERFILE.splitlines() if line.startswith(f"{name} ")]


def filled(text: str, **given: str) -> str:
    """The text as Compose fills it in."""
    return VARIABLE.sub(lambda found: given.get(found[1], found[3] if found[2] == "-" else ""), text)


def test_the_image_is_built_from_what_there_is_and_what_the_wheel_needs() -> None:
    copied = [
        source
        for line in instructions("COPY")
        if not line.startswith("--from")
        for source in line.split()[:-1]
    ]
    let_in = {
        line[1:] for line in (ROOT / ".dockerignore").read_text("utf-8").splitlines() if line.startswith("!")
    }
    assert set(copied) == let_in
    for source in copied:
        assert (ROOT / source).exists(), source
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    for folder in project["tool"]["hatch"]["build"]["targets"]["wheel"]["only-include"]:
        assert folder.split("/")[0] in copied
    assert project["project"]["readme"] in copied
    installed = re.findall(r"pip install [^&]*'\.\[([^\]]*)\]'", DOCKERFILE)
    assert installed == ["postgres"], "what trains agents stays out of the image"
    assert "postgres" in project["project"]["optional-dependencies"]


def test_the_image_runs_as_nobody_special_and_tells_whether_it_is_well() -> None:
    after = DOCKERFILE.split("\nUSER ")[1]
    assert after.startswith("galley\n")
    command = json.loads(instructions("CMD")[-1])
    assert command[:2] == ["galley", "serve"]
    check = re.search(r"^HEALTHCHECK .*? CMD (\[.*\])$", DOCKERFILE, re.MULTILINE)
    assert check is not None
    python, option, code = json.loads(check[1])
    assert (python, option) == ("python", "-c")
    compile(code, "healthcheck", "exec")
    assert "/healthz" in code
    environment = dict(
        part.split("=", 1) for line in instructions("ENV") for part in re.findall(r"\w+=\S+", line)
    )
    assert set(environment) <= OURS | OF_LIBRARIES
    settings = read_settings({name: value for name, value in environment.items() if name in OURS})
    assert (settings.host, settings.port) == ("0.0.0.0", 8000)
    assert settings.database.startswith("sqlite:////data/")
    assert "VOLUME /data" in DOCKERFILE


def test_every_replica_gets_settings_that_there_are() -> None:
    app = COMPOSE["services"]["app"]
    environment = {
        name: filled(value, POSTGRES_PASSWORD="secret") for name, value in app["environment"].items()
    }
    assert set(environment) <= OURS | OF_LIBRARIES
    settings = read_settings({name: value for name, value in environment.items() if name in OURS})
    assert settings.database == "postgresql://galley:secret@postgres/galley"
    assert {field.name for field in fields(Settings)} >= {"think_window_ms", "log_level"}
    assert "ports" not in app, "replicas are reached through the proxy alone"
    assert "container_name" not in app, "a name would allow but one replica"
    assert int(filled(app["deploy"]["replicas"])) >= 2


def test_no_secret_is_written_down_and_none_is_left_out() -> None:
    text = (ROOT / "docker-compose.yml").read_text("utf-8")
    for name, kind, _ in VARIABLE.findall(text):
        if "PASSWORD" in name:
            assert kind == "?", f"{name} must be asked for"
    postgres = COMPOSE["services"]["postgres"]["environment"]
    url = COMPOSE["services"]["app"]["environment"]["DATABASE"]
    assert url == (
        f"postgresql://{postgres['POSTGRES_USER']}:{postgres['POSTGRES_PASSWORD']}"
        f"@postgres/{postgres['POSTGRES_DB']}"
    )


def test_volumes_networks_and_dependencies_exist() -> None:
    services = COMPOSE["services"]
    for name, service in services.items():
        for volume in service.get("volumes", []):
            source = filled(volume).split(":")[0]
            if source.startswith("."):
                assert (ROOT / source).exists(), f"{name}: {source}"
            else:
                assert source in COMPOSE["volumes"], f"{name}: {source}"
        assert set(service["networks"]) <= set(COMPOSE["networks"])
        for other, how in service.get("depends_on", {}).items():
            well = "healthcheck" in services[other] or services[other].get("build") == "."
            assert how["condition"] == "service_healthy"
            assert well, f"{name} waits for {other}, which never says that it is well"


def test_the_proxy_asks_the_port_and_the_service_that_there_are() -> None:
    assert CADDYFILE.count("{") == CADDYFILE.count("}")
    upstream = dict(re.findall(r"^\t+(name|port) (\S+)$", CADDYFILE, re.MULTILINE))
    assert upstream["name"] in COMPOSE["services"]
    assert upstream["port"] == instructions("EXPOSE")[0]
    asked = set(re.findall(r"\{\$(\w+)", CADDYFILE))
    assert asked == set(COMPOSE["services"]["proxy"]["environment"])


def test_what_the_page_names_can_be_set() -> None:
    page = (ROOT / "docs" / "scaling-out.md").read_text("utf-8")
    told = set(re.findall(r"^\| `([A-Z_]+)` \|", page, re.MULTILINE))
    text = (ROOT / "docker-compose.yml").read_text("utf-8")
    assert told == {name for name, _, _ in VARIABLE.findall(text)}
