#!/bin/sh
# Trains a shipped agent again, by the commands in its card, into runs/: hours on two cores.
#
#     sh benchmarks/train_agent.sh cole-sv
#
# Stopped, it goes on by the same command. What it trained becomes an agent with `galley learn export`.
set -e
cd "$(dirname "$0")/.."
card="agents/${1:?name an agent that has a card, such as cole-sv}/card.md"
[ -f "$card" ] || { echo "$card: there is no such card" >&2; exit 1; }
sed -n '/^```sh$/,/^```$/{ /^galley /p; }' "$card" | PATH="$PWD/.venv/bin:$PATH" sh -ex
