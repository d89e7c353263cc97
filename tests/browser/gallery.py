"""Every page that a participant may meet, with words as a real study has them, in English and Chinese."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from galley.server.templates import translated_templates
from galley.study.study import load_study
from galley.study.written.languages import choose_language
from galley.study.written.questionnaire import Questionnaire
from galley.translations import Catalogues, language_name
from galley.workspace import Workspace
from tests.browser.site import ROOT
from tests.frontend.pages import FRONTEND, LEAVING, OUTCOMES

Words = Callable[[str, str], str]

LANGUAGES = ("en", "zh")
SOUPS = (
    ("salt", "More salt", "多放点盐"),
    ("onion", "More onions", "多放些洋葱"),
    ("time", "More time", "更多时间"),
)


def _asked(t: Words) -> Questionnaire:
    agree = {"low_label": t("strongly disagree", "非常不同意"), "high_label": t("strongly agree", "非常同意")}
    low_high = {"low_label": t("very low", "非常低"), "high_label": t("very high", "非常高")}
    options = tuple({"value": value, "label": t(en, zh)} for value, en, zh in SOUPS)
    long_label = t(
        "Something else entirely, which takes a few more words to say than all of the answers above it",
        "完全是别的原因，需要比上面所有答案都多几个字才能说清楚，因此这个选项的文字会换到下一行显示",
    )
    items = (
        {
            "id": "fluent",
            "kind": "likert",
            "text": t("We worked fluently together.", "我们配合得很流畅。"),
            **agree,
        },
        {
            "id": "words",
            "kind": "likert",
            "scale": 5,
            "text": t("How often did you wait?", "您等待的频率如何？"),
            "low_label": t("never", "从不"),
            "high_label": t("always", "总是"),
            "labels": tuple(
                t(*one)
                for one in (
                    ("never", "从不"),
                    ("seldom", "很少"),
                    ("sometimes", "有时"),
                    ("often", "经常"),
                    ("always", "总是"),
                )
            ),
        },
        {
            "id": "stars",
            "kind": "likert",
            "style": "stars",
            "scale": 5,
            "text": t("How did you like your partner?", "您喜欢这位搭档吗？"),
            **agree,
        },
        {
            "id": "poles",
            "kind": "semantic_differential",
            "text": t("My partner was …", "我的搭档……"),
            "low_label": t("unfriendly", "不友好"),
            "high_label": t("friendly", "友好"),
        },
        {
            "id": "effort",
            "kind": "likert",
            "scale": 21,
            "text": t("Mental demand", "脑力需求"),
            "help": t("How mentally demanding was the task?", "这项任务需要多少脑力活动？"),
            **low_high,
        },
        {
            "id": "trust",
            "kind": "slider",
            "text": t("How much do you trust this partner?", "您有多信任这位搭档？"),
            "low_label": t("not at all", "完全不"),
            "high_label": t("completely", "完全"),
            "unit": "%",
            "show_value": True,
        },
        {
            "id": "ranks",
            "kind": "ranking",
            "text": t("What would help most?", "什么最有帮助？"),
            "options": options,
        },
        {
            "id": "check",
            "kind": "single_choice",
            "text": t("Please choose “More salt” here.", "这一题请选“多放点盐”。"),
            "options": (*options, {"value": "other", "label": long_label}),
            "expected": "salt",
            "hint": t("Look at the words in quotes.", "请看引号里的字。"),
        },
        {
            "id": "many",
            "kind": "multiple_choice",
            "text": t("Which of these did you do?", "您做过哪些？"),
            "options": options,
            "required": False,
        },
        {
            "id": "age",
            "kind": "number",
            "text": t("How old are you?", "您的年龄？"),
            "min": 18,
            "max": 99,
            "unit": t("years", "岁"),
        },
        {
            "id": "story",
            "kind": "long_text",
            "text": t("Anything else?", "还有什么想说的吗？"),
            "required": False,
        },
    )
    intro = t("Think of the round that you have just played.", "请回想您刚刚玩过的那一轮。")
    return Questionnaire.model_validate(
        {"format": 1, "title": "x", "source": "made for tests", "intro": intro, "items": items}
    )


def _compared(t: Words) -> Questionnaire:
    ends = {"low_label": t("the first", "第一位"), "high_label": t("the second", "第二位")}
    texts = (
        t("Which partner did you cook better with?", "您和哪位搭档配合得更好？"),
        t("Which partner would you choose again?", "您会再选哪位搭档？"),
    )
    items = tuple({"id": f"q{n}", "kind": "comparison", "text": text, **ends} for n, text in enumerate(texts))
    return Questionnaire.model_validate(
        {"format": 1, "title": "x", "source": "made for tests", "items": items}
    )


def gallery(language: str) -> dict[str, tuple[str, dict[str, Any]]]:
    """(template, values) of every page by its name, in one of LANGUAGES."""

    def t(en: str, zh: str) -> str:
        return zh if language == "zh" else en

    say = Catalogues.load().translator(language)
    demo = load_study(Workspace(ROOT), "demo")
    demo = demo.in_language(choose_language(demo.languages, language))
    study = {
        "name": "demo",
        "title": t("Cooking together", "一起做饭"),
        "about": t(
            "Cook soups in small kitchens with different partners.", "在小厨房里和不同的搭档一起煮汤。"
        ),
        "minutes": 20,
    }
    asked, compared = _asked(t), _compared(t)
    one_way = "/s/demo?language="
    languages = [{"code": c, "name": language_name(c), "url": one_way + c} for c in LANGUAGES]

    def visit(kind: str, title: str, at: int, **more: Any) -> dict[str, Any]:
        step = {
            "id": kind,
            "kind": kind,
            "title": title,
            "round_no": 1,
            "partner_hat": None,
            "human_hat": "blue",
        }
        step |= {"partner_hat": more.get("partner_hat")}
        return {"step": step, "study": study, "progress": {"at": at, "of": 24}, "action": "/v/t", **more}

    blank: dict[str, Any] = {"questionnaire": asked, "values": {}, "problems": {}}
    filled = {
        "fluent": ["6"],
        "words": ["4"],
        "stars": ["4"],
        "poles": ["5"],
        "effort": ["14"],
        "trust": ["70"],
    }
    filled |= {"ranks.salt": ["2"], "ranks.onion": ["1"], "ranks.time": ["3"], "many": ["salt", "time"]}
    problems = {
        "check": say("Please choose one answer."),
        "age": say("Please enter a number from {least} to {most}.").format(least=18, most=99),
    }
    questions = t("After the round", "这一轮之后")
    texts = {name: demo.texts[name] for name in ("consent", "instructions", "debrief")}
    goal = {"score": 160, "text": say("Reach {goal} points together to earn the bonus of {bonus}.")}
    goal["text"] = str(goal["text"]).format(goal=160, bonus="0.5 EUR")
    playing = {
        "socket": "/v/token/play",
        "next": "/v/token",
        "minutes": 1.0,
        "round_no": 1,
        "of": 6,
        "goal": goal,
        "bonus": {"amount": 0.5, "unit": "EUR"},
        "human_hat": "blue",
        "partner_hat": "orange",
        "tutorial": False,
        "skippable": False,
    }
    title = say("Round {n} of {of}").format(n=1, of=6)
    pages: dict[str, tuple[str, dict[str, Any]]] = {
        "landing": (
            "landing.html",
            {"study": study, "minutes": 20, "action": "/s/demo/begin", "languages": languages},
        ),
        "studies": ("studies.html", {"studies": [study, study | {"minutes": 1}]}),
        "plain": ("plain.html", {"title": t("Unknown link", "链接无效"), "message": "…", "status": 404}),
        "consent": ("consent.html", visit("consent", texts["consent"].title, 1, html=texts["consent"].html)),
        "instructions": (
            "instructions.html",
            visit(
                "instructions",
                texts["instructions"].title,
                3,
                html=texts["instructions"].html,
                seconds_left=290,
            ),
        ),
        "questionnaire": (
            "questionnaire.html",
            visit("questionnaire", questions, 9, partner_hat="orange", skippable=True, **blank),
        ),
        "questionnaire-problems": (
            "questionnaire.html",
            visit("questionnaire", questions, 9, **(blank | {"values": filled, "problems": problems})),
        ),
        "quiz": (
            "quiz.html",
            visit(
                "quiz",
                t("Did we explain it well?", "说明清楚吗？"),
                4,
                **(blank | {"values": {"check": ["onion"]}}),
                wrong={"check": asked.items[7].hint},
                tries_left=2,
                html=texts["instructions"].html,
            ),
        ),
        "break": ("break.html", visit("break", say("Time for a break"), 12, wait_s=40, seconds_left=300)),
        "comparison": (
            "comparison.html",
            visit(
                "comparison",
                t("Your two partners", "您的两位搭档"),
                22,
                questionnaire=compared,
                values={},
                problems={},
                first={"hat": "orange"},
                second={"hat": "sky-blue"},
                human_hat="blue",
            ),
        ),
        "lobby": (
            "lobby.html",
            visit(
                "round",
                title,
                6,
                seconds_left=70,
                waited_s=50,
                poll="/v/token/lobby",
                human_hat="blue",
                fallback="exit",
                test=True,
            ),
        ),
        "round": ("round.html", visit("round", title, 6, **playing)),
        "debrief": (
            "debrief.html",
            visit(
                "debrief",
                texts["debrief"].title,
                24,
                html=texts["debrief"].html,
                completion_code="SOUP-2F7K",
                redirect=LEAVING,
            ),
        ),
    }
    for outcome in OUTCOMES:
        taken: Mapping[str, Any] = (
            {"code": "SO-7712", "redirect": LEAVING} if outcome == "screened_out" else {}
        )
        pages[f"ending-{outcome}"] = ("ending.html", {"study": study, "outcome": outcome, **taken})
    return {name: (template, values | {"language": language}) for name, (template, values) in pages.items()}


def rendered(language: str) -> dict[str, Callable[[], str]]:
    """Every page of the gallery as HTML, by its path: `/` and its name."""
    environment = translated_templates(str(FRONTEND / "templates"))

    def page(template: str, values: Mapping[str, Any]) -> Callable[[], str]:
        return lambda: environment.get_template(template).render(**values)

    return {f"/{name}": page(*shown) for name, shown in gallery(language).items()}
