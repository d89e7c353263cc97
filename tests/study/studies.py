"""Small studies as text, for tests that change one thing in them."""

from __future__ import annotations

GOOD = """\
format: 1
title: Good
seed: 11
completion: {code: DONE}
stages:
  - {kind: consent, text: consent}
  - {kind: questionnaire, questionnaire: before-game}
  - {kind: instructions, text: instructions}
  - {kind: tutorial, layout: simple, agent: stay}
  - kind: rounds
    agents: [random, myopic]
    after_each: after-round
    layouts:
      - {layout: cramped_room, goal: 160}
      - {layout: coordination_ring}
  - {kind: comparison, questionnaire: comparison}
  - {kind: debrief, text: debrief}
"""
