"""The language of the texts for users: of controls, layouts, and the cockpit.

Texts are English in the sources. ``translations/rosglass_de.qm`` holds the German ones; it is made
of ``rosglass_de.ts`` by ``scripts/translations.py``. A text without a translation stays English.
"""

from __future__ import annotations

import logging
import os
from pathlib import Path
from typing import Any

from rosglass.qt import QtCore

__all__ = ["FOLDER", "chosen_language", "languages", "translate_qt", "translate_texts"]

_log = logging.getLogger("rosglass.qml")
#: The folder of the translations.
FOLDER = Path(__file__).parents[2] / "translations"
#: The environment variable that chooses the language.
_VARIABLE = "ROSGLASS_LANGUAGE"


def languages() -> list[str]:
    """Return the languages that there are, as in ISO 639, English first."""
    return ["en", *sorted(one.stem.partition("_")[2] for one in FOLDER.glob("rosglass_*.qm"))]


def chosen_language() -> str:
    """Return the language of ``ROSGLASS_LANGUAGE``, or else the system's first that there is."""
    there = languages()
    wanted = os.environ.get(_VARIABLE, "")
    if wanted:
        found = _language_of(wanted)
        if found in there:
            return found
        _log.warning(
            "%s: there is no language %r; expected one of %s", _VARIABLE, wanted, ", ".join(there)
        )
        return "en"
    # A user who reads English before German gets English, although it has no file.
    spoken = [_language_of(one) for one in QtCore.QLocale.system().uiLanguages()]
    return next((one for one in spoken if one in there), "en")


def translate_texts() -> None:
    """Translate rosglass's texts in the Qt application, if there is one; safe to call twice."""
    app = QtCore.QCoreApplication.instance()
    if app is None or app.findChild(QtCore.QTranslator, "rosglass") is not None:
        return
    _install(app, "rosglass", FOLDER / f"rosglass_{chosen_language()}.qm")


def translate_qt() -> None:
    """Translate Qt's own texts, such as names of keys; for programs of rosglass alone."""
    app = QtCore.QCoreApplication.instance()
    info: Any = QtCore.QLibraryInfo
    where = getattr(info, "path", None) or info.location
    folder = Path(where(info.TranslationsPath))
    # Not those of QML, whose errors are read: "did you mean" depends on the English words.
    _install(app, "qtbase", folder / f"qtbase_{chosen_language()}.qm")


def _install(app: Any, name: str, file: Path) -> None:
    translator = QtCore.QTranslator(app)
    translator.setObjectName(name)
    # Without a file, the object remains as the mark that the language was chosen.
    if file.is_file() and translator.load(str(file)):
        app.installTranslator(translator)


def _language_of(name: str) -> str:
    """Return ``de`` for ``de_DE.UTF-8``, ``de-AT`` or ``DE``."""
    word = name.replace("-", "_").partition("_")[0].partition(".")[0].lower()
    return "en" if word in {"c", "posix"} else word
