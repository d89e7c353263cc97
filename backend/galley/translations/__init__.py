"""What participants read, in their language: catalogues in gettext's format, shipped and of a workspace."""

from galley.translations.catalogue_file import MOST_LISTED, Forms, shortened
from galley.translations.catalogues import (
    DOMAIN,
    FOLDER,
    KEYWORDS,
    LANGUAGE,
    SOURCE,
    Catalogues,
    language_name,
    mark,
    text_direction,
)
from galley.translations.translator import Translator
from galley.translations.unfinished import unfinished

__all__ = [
    "DOMAIN",
    "FOLDER",
    "KEYWORDS",
    "LANGUAGE",
    "MOST_LISTED",
    "SOURCE",
    "Catalogues",
    "Forms",
    "Translator",
    "language_name",
    "mark",
    "shortened",
    "text_direction",
    "unfinished",
]
