"""Makes the displays and views of RViz's config files (``.rviz``), and writes them into one.

What rosglass does not know is kept and written back: displays of other plugins become displays that
say so (:class:`UnknownDisplay`), settings stay beside those that are known.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.scene.display import Display
from rosglass.scene.rviz_config import DisplayConfig
from rosglass.scene.rviz_formats import DISPLAYS, class_id_of, ros_of, view_type
from rosglass.scene.views import VIEWS, create_view

if TYPE_CHECKING:
    from rosglass.scene.rviz_config import RvizConfig, ViewConfig
    from rosglass.scene.scene import Scene
    from rosglass.scene.views import ViewController

__all__ = [
    "GroupDisplay",
    "UnknownDisplay",
    "collect_displays",
    "create_saved_view",
    "show_displays",
]


#: Classes of other packages that rosglass has as well.
_SAME = {"hector_rviz_overlay_controls/QmlOverlay": "rosglass/QmlOverlay"}


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

    def on_group_enabled(self) -> None:
        """Show or hide what is in it, as it or its own group is shown or hidden."""
        super().on_group_enabled()
        if self.scene is not None:
            for display in self.scene.displays:
                if display.group is self:
                    display.on_group_enabled()


def show_displays(scene: Scene, config: RvizConfig) -> list[str]:
    """Replace the displays and the fixed frame of a scene by those of a config.

    Returns:
        What was left out, a line each.
    """
    notes = list(config.warnings)
    for display in scene.displays:
        if display.group is None:
            scene.remove(display)
    try:
        scene.fixed_frame = config.fixed_frame or "map"
    except Error as error:
        notes.append(f"Fixed Frame: {error}")
    for one in config.displays:
        _add(scene, one, None, notes)
    return notes


def _add(scene: Scene, one: DisplayConfig, group: GroupDisplay | None, notes: list[str]) -> None:
    runtime = scene._find_runtime()
    display: Display
    if one.is_group:
        display = GroupDisplay(scene, runtime)
    elif (known := one.type or _SAME.get(one.class_id, one.class_id)) in scene.TYPES:
        display = scene.TYPES[known](scene, runtime)
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


def create_saved_view(saved: ViewConfig, notes: list[str]) -> ViewController | None:
    """Return the view that a config has; None, with a note, for one that rosglass does not have."""
    kind = view_type(saved.class_id)
    if kind not in VIEWS:
        notes.append(f"view {saved.class_id}: rosglass has none; the view stays as it is")
        return None
    made = create_view(saved.class_id)
    notes += [f"view {kind}: {text}" for text in made.restore(saved.settings)]
    return made


def collect_displays(scene: Scene, ros: int, group: Display | None = None) -> list[DisplayConfig]:
    """Return the displays of a scene for a config, with what its file had beside that.

    Args:
        scene: The scene.
        ros: The RViz that the config is for, 1 or 2.
        group: The group whose displays are wanted; None for those in no group.
    """
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
            one.settings["Displays"] = collect_displays(scene, ros, display)
        found.append(one)
    return found
