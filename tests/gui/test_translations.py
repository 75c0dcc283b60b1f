"""The texts for users in other languages: complete, up to date, and shown."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator


@pytest.fixture
def script() -> Any:
    pytest.importorskip("PySide6", reason="lupdate and lrelease come with PySide6")
    sys.path.insert(0, str(Path(__file__).parents[2] / "scripts"))
    import translations

    return translations


@pytest.fixture
def clean(app: Any) -> Iterator[Any]:
    """The Qt application without translations, before the test and after it."""
    from rosglass.qt import QtCore

    def remove() -> None:
        for one in app.findChildren(QtCore.QTranslator):
            app.removeTranslator(one)
            one.setParent(None)

    remove()
    yield app
    remove()


def test_every_text_is_translated_with_its_placeholders(script: Any, tmp_path: Path) -> None:
    for file in script.files():
        new = script.updated(file, tmp_path)
        problems = script.problems(new)
        assert not problems, "\n".join([f"run {script.COMMAND}, and translate:", *problems])
        known, now = ({one[:2] for one in script.texts(each)} for each in (file, new))
        assert known == now, f"run {script.COMMAND}: {known ^ now}"


def test_compiled_translations_hold_the_texts_of_their_sources(script: Any) -> None:
    from rosglass.qt import QtCore

    for file in script.files():
        translator = QtCore.QTranslator()
        assert translator.load(str(file.with_suffix(".qm")))
        wrong = [
            one.source
            for one in script.texts(file)
            if translator.translate(one.context, one.source) != one.translation
        ]
        assert not wrong, f"run {script.COMMAND}: {wrong}"


@pytest.mark.parametrize("fault", ["unfinished", "placeholder", "empty"])
def test_faults_of_a_translation_are_found(script: Any, tmp_path: Path, fault: str) -> None:
    translation = {
        "unfinished": '<translation type="unfinished">%1 da</translation>',
        "placeholder": "<translation>%2 da</translation>",
        "empty": "<translation></translation>",
    }[fault]
    file = tmp_path / "rosglass_de.ts"
    file.write_text(
        f"<TS><context><name>A</name><message><source>%1 there</source>{translation}"
        "</message></context></TS>"
    )
    assert len(script.problems(file)) == 1


@pytest.mark.both_qt
@pytest.mark.parametrize(
    ("language", "shown"),
    [("de", "Not-Halt"), ("de_AT.UTF-8", "Not-Halt"), ("en", "Emergency stop")],
)
def test_language_is_chosen_by_a_variable(
    monkeypatch: pytest.MonkeyPatch, clean: Any, language: str, shown: str
) -> None:
    from rosglass.qml.engine.language import translate_texts

    monkeypatch.setenv("ROSGLASS_LANGUAGE", language)
    translate_texts()
    translate_texts()
    assert clean.translate("EmergencyStop", "Emergency stop") == shown


def test_system_language_is_the_first_of_those_that_are_spoken(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from rosglass.qml.engine import language
    from rosglass.qt import QtCore

    monkeypatch.delenv("ROSGLASS_LANGUAGE")
    for spoken, chosen in ((["en-GB", "de-DE"], "en"), (["fr-FR", "de-CH"], "de"), (["C"], "en")):

        class System:
            @staticmethod
            def system(spoken: list[str] = spoken) -> Any:
                return type("Locale", (), {"uiLanguages": staticmethod(lambda: spoken)})

        monkeypatch.setattr(QtCore, "QLocale", System)
        assert language.chosen_language() == chosen, spoken


def test_unknown_language_is_reported_with_those_there_are(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    from rosglass.qml.engine.language import chosen_language

    monkeypatch.setenv("ROSGLASS_LANGUAGE", "xx")
    assert chosen_language() == "en"
    assert "no language 'xx'; expected one of en, de" in caplog.text


@pytest.mark.both_qt
def test_interface_is_shown_in_the_language(platform: dict[str, str], tmp_path: Path) -> None:
    file = tmp_path / "stop.qml"
    file.write_text(
        'import QtQuick 2.15\nimport RosControls 1.0\nEmergencyStop { service: "/stop"\n'
        "    Component.onCompleted: { console.warn(Accessible.name); Qt.quit() } }\n"
    )
    done = subprocess.run(
        [sys.executable, "-m", "rosglass", "run", str(file), "--url", "local://translations"],
        env={**os.environ, **platform, "ROSGLASS_LANGUAGE": "de"},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert "Not-Halt" in done.stderr, done.stderr
