"""A study whose one page asks a question of every kind, and a quiz."""

EVERY = """
format: 1
title: Everything
source: made for tests
items:
  - {id: agree, kind: likert, text: I agree., scale: 7, low_label: no, high_label: yes}
  - {id: star, kind: likert, text: How good?, scale: 5, low_label: bad, high_label: good, style: stars}
  - {id: poles, kind: semantic_differential, text: It felt, scale: 7, low_label: cold, high_label: warm}
  - {id: one, kind: single_choice, text: One?, options: [{value: a, label: A}, {value: b, label: B}]}
  - id: after_a
    kind: short_text
    text: Why A?
    when: {item: one, any_of: [a]}
  - id: several
    kind: multiple_choice
    text: Several?
    options: [{value: a, label: A}, {value: b, label: B}, {value: c, label: C}]
  - {id: age, kind: number, text: How old are you?, min: 71, max: 79}
  - {id: load, kind: slider, text: How hard?, min: 0, max: 100, step: 5, low_label: low, high_label: high}
  - id: rank
    kind: ranking
    text: Which first?
    options: [{value: x, label: X}, {value: y, label: Y}, {value: z, label: Z}]
  - {id: short, kind: short_text, text: In a word?}
  - {id: long, kind: long_text, text: At length?, required: false}
"""
QUIZ = """
format: 1
title: Understood?
source: made for tests
items:
  - id: key
    kind: single_choice
    text: Which key?
    expected: space
    options: [{value: enter, label: Enter}, {value: space, label: Space}, {value: tab, label: Tab}]
  - {id: soups, kind: number, text: Onions in a soup?, min: 0, max: 9, expected: 3}
"""
STUDY = """
format: 1
title: Every item
seed: 11
tick_ms: 20
horizon_ticks: 60
countdown_s: 0
abandon_after_s: 2
recruitment: {participant: PROLIFIC_PID, once: true}
completion: {code: EVERY-1}
stages:
  - {kind: consent, text: consent}
  - {kind: questionnaire, id: every, questionnaire: every}
  - {kind: quiz, id: quiz, questionnaire: understood, tries: 1, after_last: end, text: instructions}
  - {kind: break, id: rest, at_least_s: 1}
  - {kind: tutorial, layout: cramped_room, agent: stay, horizon_ticks: 20, skippable: true}
  - kind: rounds
    agents: [random, stay]
    after_each: after-round
    layouts: [{layout: cramped_room, goal: 20}]
  - {kind: comparison, questionnaire: comparison}
  - {kind: debrief, text: debrief}
"""
