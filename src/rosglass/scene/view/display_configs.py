"""Makes the displays and views of RViz's config files (``.rviz``), and writes them into one.

What rosglass does not know is kept and written back: displays of other plugins become displays that
say so (:class:`UnknownDisplay`), settings stay beside those that are known.
"""

from __future__ import annotations

from copy import deepcopy
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error, shown
from rosglass.overlay.orbit import Orbit, Point
from rosglass.overlay.view_controller_settings import CONTROLLER_CLASS
from rosglass.scene.configs.rviz_config import DisplayConfig
from rosglass.scene.configs.rviz_formats import (
    DISPLAYS,
    class_id_of,
    read_bool,
    read_vector,
    ros_of,
    setting_text,
    view_type,
)
from rosglass.scene.displays.display import Display
from rosglass.scene.view_controllers.views import VIEWS, create_view

if TYPE_CHECKING:
    from rosglass.scene.configs.rviz_config import RvizConfig, ViewConfig
    from rosglass.scene.displays.scene import Scene
    from rosglass.scene.view_controllers.view_controller import ViewController

__all__ = [
    "GroupDisplay",
    "UnknownDisplay",
    "add_controller",
    "check_panels",
    "check_saved_views",
    "collect_displays",
    "create_saved_view",
    "duplicate_display",
    "show_displays",
]


#: Panels of other packages that are named.
_MAX_PANELS = 10
#: Classes of other packages that rosglass has as well.
_SAME = {"hector_rviz_overlay_controls/QmlOverlay": "rosglass/QmlOverlay"}
#: A view of another package: an Orbit with a display View Controller has the same.
_HECTOR_VIEW = "hector_rviz_plugins/HectorViewController"
#: Its settings with another name in the display.
_HECTOR_SETTINGS = {
    "Movement speed (m/s)": "Movement Speed",
    "Tracked Frame P-Gain": "Tracking Gain",
}


#: Replacements for displays of hector_rviz_plugins, by their class.
_INSTEAD = {
    "hector_rviz_plugins/GraphDisplay": "nothing replaces it: publish the graph as a MarkerArray",
    "hector_rviz_plugins/MultiRobotModel": "add a RobotModel with a TF Prefix for each robot",
    "hector_rviz_plugins/MultiRobotState": "nothing replaces it: a RobotModel with a TF Prefix "
    "shows a state whose transforms are published with that prefix",
    "hector_rviz_plugins/PointCloudFilter": "nothing replaces it: filter the cloud on the robot, "
    "and show the result with PointCloud2",
    "hector_rviz_plugins/PointCloudNormal": "nothing replaces it: publish the normals as markers",
}


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
        instead = _INSTEAD.get(self.class_id)
        self.set_status("Class", "warn", f"{text}; {instead}" if instead else text)


class GroupDisplay(Display):
    """A group of displays, which are shown and hidden together."""

    TYPE = "Group"

    if TYPE_CHECKING:
        scene: Scene | None

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
    with scene.changing():
        for display in scene.displays:
            if display.group is None:
                scene.remove(display)
        try:
            scene.fixed_frame = config.fixed_frame or "map"
        except Error as error:
            notes.append(f"Fixed Frame: {error}")
        for one in config.displays:
            _add(scene, one, None, notes)
        if config.current_view is not None:
            add_controller(scene, config.current_view, notes)
    return notes


def add_controller(scene: Scene, view: ViewConfig, notes: list[str]) -> None:
    """Show the settings of hector_rviz_plugins' view in a display View Controller.

    It is added unless there is one; nothing is done for other views.
    """
    if view.class_id != _HECTOR_VIEW:
        return
    found: Any = next((one for one in scene.displays if one.TYPE == CONTROLLER_CLASS), None)
    if found is None:
        own = {"Class": CONTROLLER_CLASS, "Name": "View Controller", "Enabled": True}
        given = {_HECTOR_SETTINGS.get(name, name): value for name, value in view.settings.items()}
        kept = {
            name: given[name] for name in scene.TYPES[CONTROLLER_CLASS].SETTINGS if name in given
        }
        _add(scene, DisplayConfig({**kept, **own}), None, notes)
        found = scene.displays[-1]
    try:
        found.mode2D = read_bool(view.settings.get("2D Mode", False))
    except Error as error:
        notes.append(f"view {view.class_id}: 2D Mode: {error}")
    found.trackedFrame = setting_text(view.settings.get("Tracked Frame"))


def _add(scene: Scene, one: DisplayConfig, group: Display | None, notes: list[str]) -> Display:
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
    return display


def check_saved_views(config: RvizConfig) -> list[str]:
    """Return which saved views of a config are of types that rosglass does not have, a line each.

    They are kept as they are; those of hector_rviz_plugins are shown as an Orbit.
    """
    notes = []
    for saved in config.saved_views:
        if view_type(saved.class_id) not in VIEWS:
            instead = " and shown as an Orbit" if saved.class_id == _HECTOR_VIEW else ""
            notes.append(
                f"saved view {saved.name!r}: rosglass has no {saved.class_id}; "
                f"it is kept as it is{instead}"
            )
    return notes


def check_panels(config: RvizConfig) -> list[str]:
    """Return which panels of a config are of other packages than RViz, in one line at most.

    They are kept as they are.
    """
    classes = (setting_text(one.get("Class")) for one in config.panels if isinstance(one, dict))
    others = list(dict.fromkeys(one for one in classes if one and ros_of(one) is None))
    if not others:
        return []
    names = ", ".join(shown(one) for one in others[:_MAX_PANELS])
    more = f" and {len(others) - _MAX_PANELS} more" if len(others) > _MAX_PANELS else ""
    return [f"panels {names}{more}: rosglass has no such panels; they are kept as they are"]


def create_saved_view(saved: ViewConfig, notes: list[str]) -> ViewController | None:
    """Return the view that a config has; None, with a note, for one that rosglass does not have."""
    if saved.class_id == _HECTOR_VIEW:
        return _orbit_of_hector(saved, notes)
    kind = view_type(saved.class_id)
    if kind not in VIEWS:
        notes.append(
            f"view {saved.class_id}: rosglass has none; the view stays as it is, and the file "
            "keeps its own until another one is chosen"
        )
        return None
    made = create_view(saved.class_id)
    notes += [f"view {kind}: {text}" for text in made.restore(saved.settings)]
    return made


def _orbit_of_hector(saved: ViewConfig, notes: list[str]) -> ViewController:
    """Return hector_rviz_plugins' view as an Orbit."""

    def point(name: str, default: Point) -> Point:
        try:
            given = saved.settings.get(name)
            return default if given is None else Point(*read_vector(given, name))
        except Error as error:
            notes.append(f"view {saved.class_id}: {error}")
            return default

    orbit = Orbit.between(point("Eye", Point(4.0, 0.0, 3.0)), point("Focus", Point(0.0, 0.0, 0.0)))
    made = create_view("Orbit")
    for setting, value in (
        ("Focal Point", orbit.focus),
        ("Distance", orbit.distance),
        ("Yaw", orbit.yaw),
        ("Pitch", orbit.pitch),
    ):
        made.set(setting, value)
    notes.append(f"view {saved.class_id}: shown as an Orbit with the display View Controller")
    return made


def collect_displays(scene: Scene, ros: int, group: Display | None = None) -> list[DisplayConfig]:
    """Return the displays of a scene for a config, with what its file had beside that.

    Args:
        scene: The scene.
        ros: The RViz that the config is for, 1 or 2.
        group: The group whose displays are wanted; None for those in no group.
    """
    displays = (display for display in scene.displays if display.group is group)
    return [_config_of(scene, display, ros) for display in displays]


def _config_of(scene: Scene, display: Display, ros: int) -> DisplayConfig:
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
    return one


def duplicate_display(scene: Scene, display: Display) -> Display:
    """Add another display with the settings of one, behind it; of a group, with all in it.

    Returns:
        The new one.

    Raises:
        Error: It cannot be written as a config has it.
    """
    node = scene.node
    ros = 1 if node is not None and node.wire == "ros1" else 2
    beside = [one for one in scene.displays if one.group is display.group]
    after = beside[beside.index(display) + 1 :]
    made = _add(scene, deepcopy(_config_of(scene, display, ros)), display.group, [])
    scene.move(made, after[0] if after else None, display.group)
    return made
