"""Editors of registered properties in RViz's panel: widgets of the Qt binding that RViz uses."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from rosglass.rviz.host import pyqt

if TYPE_CHECKING:
    from rosglass.rviz.property_sources import Sources
    from rosglass.rviz.registered_property import RegisteredProperty

__all__ = ["make_editor"]


def make_editor(model: RegisteredProperty, parent: Any, sources: Sources) -> Any:
    """Return the widget that edits a property; None where RViz's own will do.

    Args:
        model: The property.
        parent: The widget that it is shown in.
        sources: What choosers offer.
    """
    kind, options = model.kind.NAME, model.kind.options
    if kind == "int":
        return _spin_box(model, parent)
    if kind == "enum":
        return _combo_box(parent, list(options["choices"]), sources, model, editable=False)
    if kind == "topic":
        offered = sources.topics(options.get("messageType", ""))
        return _combo_box(parent, offered, sources, model, editable=True)
    if kind == "frame":
        offered = sources.frames(fixed=options.get("includeFixedFrame", False))
        return _combo_box(parent, offered, sources, model, editable=True)
    if kind in {"color", "path"}:
        return _line_with_button()(model, parent, sources)
    return None


def _spin_box(model: RegisteredProperty, parent: Any) -> Any:
    box = pyqt("QtWidgets").QSpinBox(parent)
    kind: Any = model.kind
    box.setRange(kind.min, kind.max)
    box.setSingleStep(kind.step)
    box.setFrame(False)
    return box


def _combo_box(
    parent: Any, offered: list[str], sources: Sources, model: RegisteredProperty, *, editable: bool
) -> Any:
    box = pyqt("QtWidgets").QComboBox(parent)
    box.setFrame(False)
    box.setEditable(editable)
    box.addItems(offered)
    if editable:
        box.setInsertPolicy(pyqt("QtWidgets").QComboBox.NoInsert)
        box.setEditText(str(model.get()))

    def choose(text: str) -> None:
        sources.edit(model, text)

    box.textActivated.connect(choose)
    return box


@cache
def _line_with_button() -> Any:
    core, widgets = pyqt(), pyqt("QtWidgets")

    class LineWithButton(widgets.QLineEdit):  # type: ignore[name-defined,misc]
        """A text, and a button that opens a dialog to choose it with."""

        def __init__(self, model: RegisteredProperty, parent: Any, sources: Sources) -> None:
            super().__init__(parent)
            self.setFrame(False)
            action = self.addAction(
                self.style().standardIcon(widgets.QStyle.SP_DirOpenIcon)
                if model.kind.NAME == "path"
                else _colour_icon(model),
                widgets.QLineEdit.TrailingPosition,
            )
            window = self.window()
            # The dialog takes the focus, which ends this editor.
            action.triggered.connect(
                lambda: core.QTimer.singleShot(0, lambda: _choose(model, window, sources))
            )

    return LineWithButton


def _colour_icon(model: RegisteredProperty) -> Any:
    gui = pyqt("QtGui")
    picture = gui.QPixmap(16, 16)
    picture.fill(gui.QColor(model.kind.saved(model.get())))
    return gui.QIcon(picture)


def _choose(model: RegisteredProperty, window: Any, sources: Sources) -> None:
    widgets = pyqt("QtWidgets")
    if model.kind.NAME == "color":
        gui = pyqt("QtGui")
        dialog = widgets.QColorDialog(gui.QColor(model.kind.saved(model.get())), window)
        dialog.setOption(widgets.QColorDialog.ShowAlphaChannel)
        dialog.colorSelected.connect(
            lambda colour: sources.edit(model, colour.name(gui.QColor.HexArgb))
        )
    else:
        dialog = widgets.QFileDialog(window, model.path[-1], str(model.get()))
        dialog.setFileMode(widgets.QFileDialog.ExistingFile)
        dialog.setNameFilter(model.kind.options.get("filter", "All files (*)"))
        dialog.fileSelected.connect(lambda file: sources.edit(model, file))
    dialog.setAttribute(pyqt().Qt.WA_DeleteOnClose)
    dialog.open()
