"""What renders the pages: participants' in the language of the visit, researchers' in English."""

from __future__ import annotations

import jinja2
from jinja2.runtime import Context

from galley.server.base_path import Paths
from galley.study.written.hats import HAT_WORDS
from galley.translations import SOURCE, Catalogues, Translator, text_direction


def templates(folder: str) -> jinja2.Environment:
    """The templates of a folder; everything put into them is escaped unless it is marked as HTML."""
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        extensions=[Paths],
    )


def translated_templates(folder: str, catalogues: Catalogues | None = None) -> jinja2.Environment:
    """The same, each in the language whose code it is given as `language`, English if it is given none.

    Without `catalogues` those that are shipped are read.
    """
    environment = templates(folder)
    environment.add_extension("jinja2.ext.i18n")
    environment.filters["direction"] = text_direction
    environment.globals["hat_words"] = HAT_WORDS
    known = Catalogues.load() if catalogues is None else catalogues

    def translator(context: Context) -> Translator:
        return known.translator(str(context.get("language") or SOURCE))

    @jinja2.pass_context
    def gettext(context: Context, message: str) -> str:
        return translator(context).gettext(message)

    @jinja2.pass_context
    def ngettext(context: Context, one: str, many: str, n: int) -> str:
        return translator(context).ngettext(one, many, n)

    environment.install_gettext_callables(gettext, ngettext, newstyle=True)  # type: ignore[attr-defined]
    return environment
