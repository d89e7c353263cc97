# Everything people and CI call. `make help` lists the targets; each sets up what it needs, once.
.DEFAULT_GOAL := help
.PHONY: serve test lint verify bench help

PORT ?= 8000
DATABASE ?=
STUDY ?= demo
VENV := .venv
PY := $(VENV)/bin/python
GALLEY := $(VENV)/bin/galley
PIP := $(PY) -m pip --disable-pip-version-check --quiet
BASE := $(VENV)/.base-installed
ALL := $(VENV)/.all-installed
KERNELS := $(VENV)/.kernels-compiled
SOURCES := $(shell find backend/galley/compiled backend/galley/kitchen backend/galley/planning backend/galley/agents -name '*.py')
JOBS ?= 3
NODE := node_modules/.installed

help: ## list the targets
	@grep -hE '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):.*## /\1|/' | awk -F'|' '{printf "make %-8s %s\n", $$1, $$2}'

serve: $(BASE) ## set up without PyTorch, then serve the demo study (PORT=8000 DATABASE=sqlite:///file; STUDY= for all)
	@$(GALLEY) serve . $(if $(STUDY),--study $(STUDY)) --port $(PORT) $(if $(DATABASE),--database '$(DATABASE)')

test: $(ALL) $(KERNELS) ## set up everything, then run the tests (JOBS=3 at a time: many of them wait)
	@sh tests/chromium.sh > /dev/null
	@sh tests/postgres.sh
	@sh tests/nginx.sh
	@$(PY) tests/overcooked_package.py > /dev/null
	@CHROMIUM="$$(sh tests/chromium.sh)" $(PY) -m pytest --numprocesses=$(JOBS) --dist=loadfile

lint: $(ALL) $(NODE) ## ruff, mypy, import-linter, tsc on the frontend
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/mypy
	$(VENV)/bin/lint-imports
	npx --no-install tsc --project tsconfig.json

bench: $(ALL) ## run every benchmark, one JSON object per figure
	@set -e; for file in benchmarks/*.py; do $(PY) $$file --json; done

verify: lint ## no time limit: lint, tests with long fuzzing, the whole demo study in Chromium, benchmarks
	@sh tests/chromium.sh > /dev/null
	@sh tests/postgres.sh
	@sh tests/nginx.sh
	@$(PY) tests/overcooked_package.py > /dev/null
	CHROMIUM="$$(sh tests/chromium.sh)" $(PY) -m pytest -m "full or not full" --hypothesis-profile=long --timeout=7200
	$(MAKE) bench

# The first Python of these that fits; `make PYTHON=/path/to/python3.12` names another.
PYTHON ?= $(shell for python in python3 python3.13 python3.12 python3.11; do \
	$$python -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 14))' 2>/dev/null && echo $$python && break; done)

$(PY):
	@test -n "$(PYTHON)" || { echo "Galley needs Python 3.11, 3.12 or 3.13; python3 here is '$$(python3 --version 2>&1)'." >&2; \
		echo "Install one of them (Debian 12 or newer, Ubuntu 24.04 or newer: apt-get install python3 python3-venv), or name it: make $(firstword $(MAKECMDGOALS)) PYTHON=/path/to/python3.12" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
		echo "$(PYTHON) cannot make virtual environments; install what is missing with: apt-get install python3-venv python$$($(PYTHON) -c 'import sys; print("%d.%d" % sys.version_info[:2])')-venv" >&2; exit 1; }
	@echo "Setting up $(VENV) with $$($(PYTHON) --version) ..."
	@$(PYTHON) -m venv $(VENV)

$(BASE): pyproject.toml | $(PY)
	@echo "Installing Galley ..."
	@$(PIP) install --editable .
	@touch $@

$(ALL): pyproject.toml | $(PY)
	@echo "Installing Galley with all extras (PyTorch is large: some minutes the first time) ..."
	@$(PIP) install --editable '.[learn,design,dev]'
	@touch $@ $(BASE)

$(KERNELS): $(ALL) $(SOURCES)
	@echo "Compiling kernels (a minute or two the first time) ..."
	@$(PY) -m galley.agents.all_kernels
	@touch $@

$(NODE): package.json
	@command -v npm > /dev/null || { echo "make lint checks the browser code with TypeScript and needs npm; install it with: apt-get install nodejs npm" >&2; exit 1; }
	@npm install --no-package-lock --no-audit --no-fund --silent
	@touch $@
