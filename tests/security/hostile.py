"""Script for every place where text can be written, and a study that carries it in each of its own."""

from __future__ import annotations

import json
from pathlib import Path

from galley.workspace import Workspace
from tests.study.workspaces import study_workspace

MARK = "zqx7"
SCRIPTS = (
    f"<script>{MARK}(1)</script>",
    f"\"'><img src=x onerror={MARK}(1)>",
    f"</textarea></title><svg onload={MARK}(1)>",
    f"javascript:{MARK}(1)",
    f"{{{{{MARK}}}}}{{% {MARK} %}}${{{MARK}}}",
    f"' onfocus={MARK}(1) autofocus x='",
    f"<!--{MARK}--><b>{MARK}</b>&lt;{MARK}&gt;",
)
ALL = " ".join(SCRIPTS)
MARKDOWN = f"""# {SCRIPTS[0]} {SCRIPTS[1]}

{SCRIPTS[0]}

{SCRIPTS[1]}

[press](javascript:{MARK}(1)) ![see](javascript:{MARK}(1)) <a href="javascript:{MARK}(1)">x</a>
[data](data:text/html,{MARK})

```js{SCRIPTS[1]}
{SCRIPTS[0]}
```

![{SCRIPTS[5]}](tile:pot)
"""


def hostile_workspace(folder: Path) -> Workspace:
    """A workspace whose only study, `hostile`, has script in every text."""
    text = json.dumps(ALL)
    study = f"""
format: 1
title: {text}
about: {text}
seed: 1
tick_ms: 20
horizon_ticks: 100
countdown_s: 0
abandon_after_s: 30
recruitment: {{keep: [PROLIFIC_PID, other]}}
completion: {{code: H-1, redirect: "https://example.org/?cc={{code}}"}}
stages:
  - {{kind: consent, text: consent}}
  - {{kind: questionnaire, id: asked, questionnaire: asked, title: {text}}}
  - {{kind: instructions, text: hostile}}
  - kind: rounds
    agents: [random]
    goal_text: {json.dumps(" ".join(script for script in SCRIPTS if "{" not in script))}
    layouts: [{{layout: cramped_room, goal: 20}}]
  - {{kind: debrief, text: hostile}}
"""
    questionnaire = f"""
format: 1
title: {text}
intro: {text}
source: made for tests
items:
  - {{id: often, kind: likert, text: {text}, help: {text}, scale: 3, low_label: {text}, high_label: {text}}}
  - {{id: words, kind: short_text, text: {text}}}
  - {{id: sentences, kind: long_text, text: {text}}}
  - id: kind
    kind: single_choice
    text: {text}
    options: [{{value: a, label: {text}}}, {{value: b, label: {text}}}]
"""
    workspace = study_workspace(folder, study, "hostile")
    (workspace.folder("questionnaires") / "asked.yaml").write_text(questionnaire, encoding="utf-8")
    (workspace.folder("texts") / "hostile.md").write_text(MARKDOWN, encoding="utf-8")
    return workspace
