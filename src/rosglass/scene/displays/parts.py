"""The parts of a display that are shown and hidden one by one, such as frames, links and joints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from rosglass.scene.configs.settings import Setting

__all__ = ["Parts"]


class Parts:
    """The visibility of a display's parts, in its panel and in ``.rviz`` files.

    Args:
        title: RViz's name of the list: ``Namespaces``, ``Frames``, ``Links`` or ``Joints``.
        names: Returns the names of the parts that there are.
        on_change: Called after the user has changed something.
        default: Returns whether a part is shown that the user has not switched.
        can_switch: Returns whether a part can be hidden: some have nothing to show.
        details: Settings that each part has of its own.
        describe: Returns what there is to say about a part, for the panel: names and values.
        as_mapping: Whether a file has a mapping for each part, not only whether it is shown.
    """

    def __init__(
        self,
        title: str,
        names: Callable[[], Iterable[str]],
        on_change: Callable[[], None],
        *,
        default: Callable[[], bool] = lambda: True,
        can_switch: Callable[[str], bool] = lambda _: True,
        details: Iterable[Setting] = (),
        describe: Callable[[str], Iterable[tuple[str, str]]] | None = None,
        as_mapping: bool = False,
    ) -> None:
        self.title, self.names, self.can_switch = title, names, can_switch
        self.describe = describe
        self.details: dict[str, Setting] = {detail.path: detail for detail in details}
        self._on_change, self._default, self._as_mapping = on_change, default, as_mapping
        #: Differences from the default, by the names of parts; also of future parts.
        self._switched: dict[str, bool] = {}
        self._values: dict[str, dict[str, Any]] = {}

    def is_enabled(self, name: str) -> bool:
        """Return whether a part is shown, now or once there is one of this name."""
        return self._switched.get(name, bool(self._default()))

    def set_enabled(self, name: str, enabled: bool) -> None:
        """Show or hide a part."""
        self._switched[name] = enabled
        self._on_change()

    def set_all(self, enabled: bool) -> None:
        """Show or hide all parts that there are."""
        self._switched.update(dict.fromkeys([*self.names(), *self._switched], enabled))
        self._on_change()

    def follow_default(self) -> None:
        """Show or hide all parts, also those to come, by the default."""
        self._switched.clear()
        self._on_change()

    def get(self, name: str, detail: str) -> Any:
        """Return the value of a setting of a part."""
        return self._values.get(name, {}).get(detail, self.details[detail].default)

    def set(self, name: str, detail: str, value: Any) -> None:
        """Change a setting of a part.

        Raises:
            Error: It cannot hold the value.
        """
        accepted = self.details[detail].kind.read(value)
        self._values.setdefault(name, {})[detail] = accepted
        self._on_change()

    def load(self, saved: Mapping[str, Any]) -> list[str]:
        """Apply the settings of parts in a file, and no others.

        Returns:
            What was left out, in words: values that do not fit.
        """
        refused = []
        self._switched.clear()
        self._values.clear()
        parts = saved.get(self.title)
        for name, state in (parts if isinstance(parts, dict) else {}).items():
            if isinstance(state, dict) != self._as_mapping:
                continue  # a setting of the list itself
            shown = state.get("Value") if self._as_mapping else state
            if isinstance(shown, bool):
                self._switched[name] = shown
            for path, detail in self.details.items():
                if path in state:
                    try:
                        self._values.setdefault(name, {})[path] = detail.restore(state[path])
                    except Error as error:
                        refused.append(f"{self.title}/{name}/{path}: {error}")
        return refused

    def save(self, kept: dict[str, Any]) -> None:
        """Write into a display's settings for a file which parts are shown.

        Only of parts that a file had or the user has changed: others are shown by the default.
        """
        before = kept.get(self.title)
        parts = dict(before) if isinstance(before, dict) else {}
        for name in dict.fromkeys([*parts, *self._switched, *self._values]):
            state = parts.get(name, {} if self._as_mapping else True)
            if isinstance(state, dict) != self._as_mapping:
                continue
            if not self._as_mapping:
                parts[name] = self.is_enabled(name)
                continue
            details = {path: self.details[path].saved(v) for path, v in self._of(name).items()}
            parts[name] = {**state, **details}
            if "Value" in state or name in self._switched:
                parts[name]["Value"] = self.is_enabled(name)
        kept[self.title] = parts

    def _of(self, name: str) -> dict[str, Any]:
        return self._values.get(name, {})
