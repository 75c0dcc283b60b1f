"""Registered properties: values, kinds, files; and their editors in the panel."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from rosglass.errors import ConversionError, Error

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

KINDS: list[tuple[str, dict[str, Any], Any, Any]] = [
    ("bool", {}, True, 1),
    ("int", {"min": 1, "max": 5}, 4, 6),
    ("int", {}, -7, 2**31),
    ("float", {"min": 0}, 0.1, -0.1),
    ("float", {}, 1e-300, float("nan")),
    ("string", {}, "1.5", 1.5),
    ("string", {}, 'ä: "q"\n- #', "\0"),
    ("enum", {"choices": ["slow", "fast"]}, "fast", "medium"),
    ("topic", {"messageType": "sensor_msgs/LaserScan"}, "/robot/scan", "no topic"),
    ("frame", {}, "base_link", 3),
    ("color", {}, "#80ff8800", "nonsense"),
    ("vector", {}, (0.1, -2, 3e7), (1, 2)),
    ("quaternion", {}, {"x": 0.5, "y": 0.5, "z": 0.5, "w": 0.5}, (0, 0, 0, 1)),
]


@pytest.fixture
def owner(app: Any) -> Any:
    from rosglass.overlay.registered_properties import RegisteredProperties

    return RegisteredProperties()


@pytest.mark.parametrize(("kind", "options", "good", "bad"), KINDS)
def test_each_kind_keeps_its_values_and_refuses_others(
    app: Any, tmp_path: Path, kind: str, options: dict[str, Any], good: Any, bad: Any
) -> None:
    from rosglass.overlay.property_values import plain_config, to_config
    from rosglass.overlay.registered_properties import RegisteredProperties
    from rosglass.rviz.host import rviz

    first, second = RegisteredProperties(), RegisteredProperties()
    made = first.register(kind, "It", **options)
    made.set(good)
    with pytest.raises(Error):
        made.set(bad)
    # Through a real file of RViz, whose scalars are all text.
    config, read = rviz().Config(), rviz().Config()
    to_config(config, first.save(), plain=True)
    file = str(tmp_path / "values.yaml")
    rviz().YamlConfigWriter().writeFile(config, file)
    rviz().YamlConfigReader().readFile(read, file)
    second.load(plain_config(read))
    assert second.register(kind, "It", **options).get() == made.get()


def test_registering_again_returns_the_same(owner: Any) -> None:
    changes: list[Any] = []
    speed = owner.registerFloatProperty("Speed", 0.5, "m/s", min=0, max=2)
    speed.valueChanged.connect(lambda value: changes.append(value))  # noqa: PLW0108
    speed.set(1.5)
    assert owner.registerFloatProperty("Speed", 0.5, "now in km/h", {"max": 1}) is speed
    # What is out of the new range is the default.
    assert (speed.get(), speed.description, changes) == (0.0, "now in km/h", [1.5, 0.0])
    with pytest.raises(Error, match="Speed: a property of this name exists, of kind float"):
        owner.registerStringProperty("Speed")
    owner.begin_load()
    assert owner.registerStringProperty("Speed", "fast").get() == "fast"


def test_parents(owner: Any) -> None:
    box = owner.registerPropertyContainer("Box", "holds others")
    inner = owner.registerBoolProperty(box, "Inner", True)
    below = owner.registerIntProperty(inner, "Below", 3)
    assert owner.registerBoolProperty("Inner") is not inner
    assert owner.save() == {"Box": {"Inner": {"Value": True, "Below": 3}}, "Inner": False}
    owner.load({"Box": {"Inner": {"Value": "false", "Below": "5"}}, "Later": "x"})
    assert (inner.get(), below.get()) == (False, 5)
    assert owner.save()["Later"] == "x"
    vector = owner.registerVectorProperty("Vector")
    with pytest.raises(Error, match="is a vector, which holds no others"):
        owner.registerBoolProperty(vector, "Inner")
    with pytest.raises(Error, match="files store the parent's own value "):
        owner.registerBoolProperty(inner, "Value")


def test_config_keeps_what_a_file_can(owner: Any) -> None:
    from datetime import datetime

    owner.set_config({"a": [1, {"b": (1, 2)}]})
    assert owner.get_config() == {"a": [1, {"b": [1, 2]}]}
    with pytest.raises(ConversionError, match=r"config\.a\[1\]\.b: expected null, true"):
        owner.set_config({"a": [1, {"b": datetime(2026, 1, 1)}]})
    with pytest.raises(Error, match="expected a map"):
        owner.set_config([1])
    assert owner.get_config() == {"a": [1, {"b": [1, 2]}]}


QML = """import QtQuick 2.15
Item {
    Component.onCompleted: {
        rviz.registerIntProperty("Count", 3, "", 1, 5)
        rviz.registerEnumProperty("Mode", "slow", ["slow", "fast"])
        rviz.registerColorProperty("Tint", "orange")
        rviz.registerVectorProperty("At", Qt.vector3d(1, 2, 3))
        rviz.registerRosTopicProperty("Topic", "", "std_msgs/String")
        rviz.registerTfFrameProperty("Frame", "", "", true)
        rviz.registerStringProperty("Fixed", "text", "", {readOnly: true})
        rviz.registerStringProperty("Secret", "text", "", {hidden: true})
    }
}
"""


@pytest.fixture
def shown(app: Any, wait: Callable[..., None], tmp_path: Path) -> Any:
    """The overlay, the tree's model, and the index of a property's value."""
    from rosglass.rviz.host import pyqt

    file = tmp_path / "Kinds.qml"
    file.write_text(QML)
    overlay = app.add_qml(file)
    wait(lambda: app.entries.of(overlay) is not None)
    views = app.window.frame.findChildren(pyqt("QtWidgets").QTreeView)
    view = next(v for v in views if v.model().index(0, 0).data() == "Global Options")
    model = view.model()

    def index(*path: str) -> Any:
        at = pyqt().QModelIndex()
        for name in ("Kinds", "Configuration", *path):
            below = [model.index(row, 0, at) for row in range(model.rowCount(at))]
            at = next(one for one in below if one.data() == name)
        return at.siblingAtColumn(1)

    return overlay.properties.properties, view, index


@pytest.fixture
def edit(app: Any, shown: Any) -> Any:
    """Open a property's editor, close it with a key; return a function's result for it."""
    from rosglass.rviz.host import pyqt

    _, view, index = shown
    keys, test = pyqt().Qt, pyqt("QtTest").QTest
    view.expand(index().parent().siblingAtColumn(0))

    def edit(name: str, use: Callable[[Any], Any], key: str = "Key_Return") -> Any:
        at = index(name)
        view.scrollTo(at)
        view.edit(at)
        editor = view.indexWidget(at)
        said = use(editor)
        test.keyClick(editor, getattr(keys, key))
        app.qt.processEvents()
        return said

    return edit


def _items(box: Any) -> list[str]:
    return [box.itemText(at) for at in range(box.count())]


def test_editors_suit_their_kinds(shown: Any, edit: Any) -> None:
    from rosglass.rviz.host import pyqt

    properties, _, index = shown
    assert edit("Count", lambda spin: (spin.minimum(), spin.maximum())) == (1, 5)
    edit("Count", lambda spin: spin.setValue(4))
    assert properties["Count"].get() == 4
    assert edit("Mode", _items) == ["slow", "fast"]
    edit("Mode", lambda box: box.setCurrentText("fast"))
    assert properties["Mode"].get() == "fast"
    assert edit("Frame", _items, "Key_Escape")[0] == "<Fixed Frame>"
    edit("Frame", lambda box: box.setEditText("base_link"))
    assert properties["Frame"].get() == "base_link"
    swatch = index("Tint").data(pyqt().Qt.DecorationRole)
    assert swatch.name() == "#ffa500"
    edit("Tint", lambda line: line.setText("#123456"))
    assert properties["Tint"].get().name() == "#123456"
    edit("Tint", lambda line: line.setText("no colour"))
    assert index("Tint").data() == "#123456"


def test_a_colour_is_chosen_in_a_dialog(
    app: Any, shown: Any, edit: Any, wait: Callable[..., None]
) -> None:
    from rosglass.rviz.host import pyqt

    properties, _, _ = shown
    kind = pyqt("QtWidgets").QColorDialog

    def dialogs() -> Any:
        return app.window.frame.findChildren(kind)

    edit("Tint", lambda line: line.actions()[0].trigger(), "Key_Escape")
    wait(dialogs)
    dialogs()[0].setCurrentColor(pyqt("QtGui").QColor(1, 2, 3, 4))
    dialogs()[0].accept()
    wait(lambda: not dialogs())
    assert properties["Tint"].get().getRgb() == (1, 2, 3, 4)


def test_read_only_and_hidden_properties(shown: Any) -> None:
    from rosglass.rviz.host import pyqt

    properties, _, index = shown
    assert not index("Fixed").flags() & pyqt().Qt.ItemIsEditable
    properties["Fixed"].set("by the interface")
    assert index("Fixed").data() == "by the interface"
    with pytest.raises(StopIteration):
        index("Secret")
    properties["Secret"].hidden = False
    assert index("Secret").data() == "text"
    properties["Secret"].hidden = True
    with pytest.raises(StopIteration):
        index("Secret")


def test_parts_of_a_vector_are_edited_alone_or_together(shown: Any) -> None:
    properties, view, index = shown
    model, at = view.model(), properties["At"]

    def parts() -> tuple[float, float, float]:
        value = at.get()
        return value.x(), value.y(), value.z()

    model.setData(index("At", "Y"), 5.0)
    assert parts() == (1, 5, 3)
    assert index("At").data() == "1; 5; 3"
    model.setData(index("At"), "7; 8; 9")
    assert parts() == (7, 8, 9)
    assert index("At", "X").data() == 7
    model.setData(index("At"), "7; eight; 9")
    assert parts() == (7, 8, 9)
    assert index("At").data() == "7; 8; 9"


def test_choosers_offer_the_robots_topics(app: Any, edit: Any, wait: Callable[..., None]) -> None:
    app.connect()
    wait(lambda: app.session.node is not None)
    publisher = app.session.node.create_publisher("/offered", "std_msgs/msg/String")
    other = app.session.node.create_publisher("/not_offered", "std_msgs/msg/Bool")
    wait(lambda: {"/offered", "/not_offered"} <= set(app.session.node.topics()))
    offered = edit("Topic", _items, "Key_Escape")
    assert "/offered" in offered
    assert "/not_offered" not in offered
    publisher.close()
    other.close()
