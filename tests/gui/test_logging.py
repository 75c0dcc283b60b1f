"""Logging from QML names the file and line of the caller."""

from __future__ import annotations

import logging
from typing import Any

import pytest

from rosglass.qml.engine.log import LocationFormatter, RateLimit


@pytest.fixture
def records(caplog: Any) -> Any:
    caplog.set_level(logging.DEBUG, "rosglass.qml")
    return caplog


LEVELS = {
    "debug": logging.DEBUG,
    "info": logging.INFO,
    "warn": logging.WARNING,
    "error": logging.ERROR,
    "fatal": logging.CRITICAL,
}


@pytest.mark.both_qt
@pytest.mark.parametrize("name", LEVELS)
@pytest.mark.parametrize("logger", ["Ros2", "Ros2.getLogger('arm')"])
def test_levels_and_places(bench: Any, records: Any, name: str, logger: str) -> None:
    bench.load(
        """QtObject {
            function say() {
                %s.%s("50% done")
            }
            Component.onCompleted: say()
        }""".replace("%s", logger, 1).replace("%s", name, 1)
    )
    record = next(r for r in records.records if r.getMessage() == "50% done")
    assert record.levelno == LEVELS[name]
    assert record.name == ("rosglass.qml" if logger == "Ros2" else "rosglass.qml.arm")
    assert record.pathname.endswith("Test1.qml")
    assert record.lineno == 6
    assert record.funcName == "say"
    line = LocationFormatter().format(record)
    assert line.startswith(f"{record.pathname}:6: {logging.getLevelName(LEVELS[name])}")
    assert line.endswith("50% done")


def test_levels_can_be_set(bench: Any, records: Any, caplog: Any) -> None:
    script = """const l = Ros2.getLogger('legs');
        const ok = [l.setLoggerLevel(Ros2LoggerLevel.Error), l.setLoggerLevel(7)];
        l.warn("hidden"); l.error("shown"); return ok"""
    try:
        assert bench.run(script) == [True, False]
    finally:
        logging.getLogger("rosglass.qml.legs").setLevel(logging.NOTSET)
    texts = [r.getMessage() for r in records.records]
    assert "shown" in texts
    assert "hidden" not in texts
    assert "setLoggerLevel: 7 is not one of Ros2LoggerLevel" in texts


@pytest.mark.both_qt
def test_console_and_warnings_are_logged_with_their_place(
    bench: Any, messages: Any, records: Any
) -> None:
    bench.load(
        """QtObject {
            property int broken: nothing.here
            Component.onCompleted: {
                console.log("note", 5)
                console.error("bad")
            }
        }"""
    )
    found = {r.getMessage(): (r.levelno, r.lineno, r.name) for r in records.records}
    assert found["note 5"] == (logging.INFO, 7, "rosglass.qml")
    assert found["bad"] == (logging.ERROR, 8, "rosglass.qml")
    assert found["ReferenceError: nothing is not defined"] == (logging.WARNING, 5, "rosglass.qml")


def test_rate_limit() -> None:
    limit = RateLimit(0.2)
    assert [limit.allows("a"), limit.allows("a"), limit.allows("b")] == [True, False, True]
    limit = RateLimit(0.0)
    assert [limit.allows("a"), limit.allows("a")] == [True, True]
    many = RateLimit()
    assert all(many.allows(i) for i in range(1000))
    assert not many.allows(999)
    assert many.allows(0), "it is forgotten"


def test_formatter_leaves_other_loggers_alone() -> None:
    record = logging.LogRecord("rosglass.comm", logging.INFO, "/x/y.py", 3, "hi %d", (5,), None)
    assert LocationFormatter().format(record) == "INFO rosglass.comm: hi 5"
