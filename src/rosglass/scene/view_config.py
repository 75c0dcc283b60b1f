"""Takes RViz's config files (``.rviz``) into a view, and writes a view into one.

What rosglass does not know is kept and written back: displays of other plugins become displays that
say so (:class:`UnknownDisplay`), settings stay beside those that are known.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qt import QtGui
from rosglass.scene.display import Display
from rosglass.scene.rviz_config import DisplayConfig, RvizConfig, ToolConfig, ViewConfig
from rosglass.scene.rviz_formats import DISPLAYS, class_id_of, ros_of, view_type
from rosglass.scene.views import VIEWS, create_view

if TYPE_CHECKING:
    import os

    from rosglass.scene.scene import Scene
    from rosglass.scene.scene_view import SceneView

__all__ = ["GroupDisplay", "UnknownDisplay", "apply_config", "collect_config", "load_config"]


class UnknownDisplay(Display):
    """A display of a config that rosglass does not have; it shows nothing, and is written back."""

    TYPE = "Unknown"

    def __init__(self, parent: Any = None, runtime: Any = None, *, class_id: str = "") -> None:
        super().__init__(parent, runtime)
        self.class_id = class_id
        self._restyle()

    @property
    def label(self) -> str:
        """The display in error messages."""
        return f"display {self.name!r}"

    def _restyle(self) -> None:
        text = f"rosglass has no display {self.class_id}; it is kept in the file as it is"
        self.set_status("Class", "warn", text)


class GroupDisplay(Display):
    """A group of displays, which are shown and hidden together."""

    TYPE = "Group"

    def _on_enabled(self) -> None:
        super()._on_enabled()
        if self.scene is not None:
            for display in self.scene.displays:
                if display.group is self:
                    display.on_group_enabled()


def load_config(view: SceneView, path: str | os.PathLike[str]) -> list[str]:
    """Replace what a view shows by a config.

    Args:
        view: The view.
        path: The file.

    Returns:
        What was left out, a line each.

    Raises:
        Error: It cannot be read; nothing has changed then.
    """
    config = RvizConfig.load(path)
    notes = apply_config(view, config)
    view.config = config
    return notes


def apply_config(view: SceneView, config: RvizConfig) -> list[str]:
    """Replace what a view shows; see :func:`load_config`."""
    notes = list(config.warnings)
    scene = view.scene
    for display in scene.displays:
        scene.remove(display)
    try:
        scene.fixed_frame = config.fixed_frame or "map"
    except Error as error:
        notes.append(f"Fixed Frame: {error}")
    red, green, blue, _ = config.background_color
    view.setProperty("background", QtGui.QColor.fromRgbF(red, green, blue))
    for one in config.displays:
        _add(scene, one, None, notes)
    if config.tools:
        notes += view.tools.load_configs(one.settings for one in config.tools)
    if config.current_view is not None:
        _show_view(view, config.current_view, notes)
    return notes


def _add(scene: Scene, one: DisplayConfig, group: GroupDisplay | None, notes: list[str]) -> None:
    runtime = scene._find_runtime()
    display: Display
    if one.is_group:
        display = GroupDisplay(scene, runtime)
    elif one.type in scene.TYPES:
        display = scene.TYPES[one.type](scene, runtime)
    else:
        display = UnknownDisplay(scene, runtime, class_id=one.class_id)
        notes.append(f"display {one.name!r}: rosglass has no {one.class_id}; it is kept as it is")
    display.group, display.saved = group, dict(one.settings)
    display.name = one.name
    try:
        refused = display.load_settings(one.settings)
    except Error as error:
        refused = [str(error)]
    notes += [f"display {one.name!r}: {text}" for text in refused]
    display.enabled = one.enabled
    scene.adopt(display)
    if isinstance(display, GroupDisplay):
        for inner in one.displays:
            _add(scene, inner, display, notes)


def _show_view(view: SceneView, saved: ViewConfig, notes: list[str]) -> None:
    kind = view_type(saved.class_id)
    if kind not in VIEWS:
        notes.append(f"view {saved.class_id}: rosglass has none; Orbit is used")
        return
    made = create_view(saved.class_id)
    notes += [f"view {kind}: {text}" for text in made.restore(saved.settings)]
    view.show_view(made)


def collect_config(view: SceneView, ros: int = 2) -> RvizConfig:
    """Return the config of what a view shows, with what its file had beside that.

    Args:
        view: The view.
        ros: The RViz that a new file is for, 1 or 2; the file's own if there is one.
    """
    config = view.config or RvizConfig(ros)
    scene = view.scene
    config.fixed_frame = scene.fixed_frame
    config.background_color = view.property("background").getRgbF()
    del config.displays[:]
    config.displays.extend(_collect(scene, None, config.ros))
    config.tools[:] = [ToolConfig(one) for one in view.tools.save_configs(config.ros)]
    state = view.controller.state()
    current = config.current_view
    if current is None:
        config.current_view = ViewConfig(state)
    else:
        current.settings = {**current.settings, **state}
        config.current_view = current
    return config


def _collect(scene: Scene, group: Display | None, ros: int) -> list[DisplayConfig]:
    found = []
    for display in scene.displays:
        if display.group is not group:
            continue
        if isinstance(display, UnknownDisplay):
            one = DisplayConfig(dict(display.saved))
            one.settings["Class"] = display.class_id
        elif display.saved:
            one = DisplayConfig(display.save_settings(display.saved, ros))
            if ros_of(one.class_id) not in (None, ros):
                # From a file of the other RViz.
                one.settings["Class"] = class_id_of(DISPLAYS, display.TYPE, ros)
        else:
            one = DisplayConfig.new(display.TYPE, ros)
            one.settings = display.save_settings(one.settings, ros)
        one.name, one.enabled = display.name, display.enabled
        if isinstance(display, GroupDisplay):
            one.settings["Displays"] = _collect(scene, display, ros)
        found.append(one)
    return found
