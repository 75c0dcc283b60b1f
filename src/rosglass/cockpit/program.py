"""The program ``rosglass cockpit``: arranges panels on a screen, and saves them as QML."""
# ruff: noqa: N802, N815 - the names of slots, signals and properties are QML's

from __future__ import annotations

import json
import logging
import os
import posixpath
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.bags.replay_node import replay_url
from rosglass.cockpit.first_layout import empty_layout, first_layout, panel_text, words_of
from rosglass.cockpit.history import History
from rosglass.cockpit.layout_edits import LayoutEdits
from rosglass.cockpit.layout_file import LayoutFile, Recovery, state_folder
from rosglass.cockpit.layout_imports import import_layout, is_foreign
from rosglass.cockpit.live_layout import LiveLayout
from rosglass.cockpit.own_changes import OwnChanges, content_of
from rosglass.cockpit.panels import Panel, Proposal, controls, find, folder_panels, propose, search
from rosglass.cockpit.property_form import PropertyModel
from rosglass.cockpit.qml_document import Code, Document, to_qml
from rosglass.cockpit.recordings import SCHEME, Examined, examine, is_recording, path_of
from rosglass.cockpit.robot_pages import pages_for_robots
from rosglass.cockpit.robots import FoundRobot, RobotSearch, addresses
from rosglass.cockpit.rqml import RqmlPlugin, find_plugins
from rosglass.cockpit.rqml_api import RqmlApi
from rosglass.cockpit.trust import TrustedLayouts, senders
from rosglass.controls.topics.graph_watch import GraphWatch
from rosglass.errors import Error
from rosglass.qml.engine.properties import ReadOnly, report
from rosglass.qml.engine.runtime import runtime_of
from rosglass.qml.engine.watchdog import Watchdog
from rosglass.qml.run.modules import interface_file, locate
from rosglass.qml.run.renderer_choice import choice
from rosglass.qt import QtCore, QtGui, QtQml, Signal, Slot, is_alive
from rosglass.wires.zenoh.options import shown_url

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.cockpit.qml_document import Object
    from rosglass.qml.engine.session import Session

__all__ = ["WINDOW", "CockpitProgram"]

_log = logging.getLogger("rosglass.cockpit")
#: The program's window.
WINDOW = Path(__file__).with_name("editor") / "Editor.qml"
#: Seconds for which a message stays, and between two looks at the file.
_MESSAGE_S, _LOOK_S = 10.0, 1.0
#: Name under which a layout that has no file yet is kept for a recovery.
_UNSAVED = "unsaved.qml"
#: Files opened lately that are remembered.
_MAX_RECENT = 8
#: Senders that a question lists.
_MAX_SENDERS = 8
#: The topic in whose namespaces robots are, as for RobotSwitch.
_ROBOT_TOPIC = "cmd_vel"
#: Lines of a list of what was not imported that are shown.
_MAX_LEFT_OUT = 12
#: File of the state folder that says that the tour was shown.
_HINTS_SEEN = "tour_seen"
#: Address of the robot of the tour, and the port of its router.
_TOUR_URL = "zenoh://127.0.0.1:7457"


class _Command(NamedTuple):
    """A command of the palette.

    Attributes:
        text: Its name for users.
        keys: Its keys; empty without.
        needs: "layout" if it needs an open layout, "edit" for edit mode, or empty.
        asks: Whether it asks for a file first.
    """

    text: str
    keys: str = ""
    needs: str = ""
    asks: bool = False


def _help_folder() -> Path:
    """Return the folder of the documentation's pages."""
    packaged = Path(__file__).with_name("help")
    return packaged if packaged.is_dir() else Path(__file__).parents[3] / "docs"


class CockpitProgram(QtCore.QObject):
    """The model of the window of ``rosglass cockpit``: its texts, and what its buttons do.

    Args:
        layout: The layout or recording to open; empty for the start page.
        url: The robot; empty to look for one.
        panels: Folders with further panels: QML files, and plugins of RQml.
        import_paths: Further folders with QML modules.
        kiosk: Whether the layout alone is shown.

    Raises:
        Error: A file or folder cannot be read.
    """

    opened = ReadOnly(bool, False)
    #: Whether there is a layout, also while the start page is shown.
    hasLayout = ReadOnly(bool, False)
    path = ReadOnly(str, "")
    name = ReadOnly(str, "")
    modified = ReadOnly(bool, False)
    undoText = ReadOnly(str, "")
    redoText = ReadOnly(str, "")
    editing = ReadOnly(bool, False)
    message = ReadOnly(str, "")
    #: Why the layout, or its last change, cannot be shown.
    problem = ReadOnly(str, "")
    connected = ReadOnly(bool, False)
    connection = ReadOnly(str, "")
    url = ReadOnly(str, "")
    searching = ReadOnly(bool, False)
    robots: Any = ReadOnly("QVariantList", ())  # type: ignore[arg-type]
    proposals: Any = ReadOnly("QVariantList", ())  # type: ignore[arg-type]
    catalogue: Any = ReadOnly("QVariantList", ())  # type: ignore[arg-type]
    recent: Any = ReadOnly("QStringList", ())  # type: ignore[arg-type]
    kiosk = ReadOnly(bool, False)
    #: Whether a panel is selected, and its title.
    selected = ReadOnly(bool, False)
    selectedTitle = ReadOnly(str, "")
    form = ReadOnly(QtCore.QObject, None)
    #: A question to the user, and its answers.
    question = ReadOnly(str, "")
    #: The answer that Return takes.
    firstAnswer = ReadOnly(int, 0)
    answers: Any = ReadOnly("QStringList", ())  # type: ignore[arg-type]
    #: Title and text (Markdown) of the page of help that is shown; empty if none is.
    helpText = ReadOnly(str, "")
    folder = ReadOnly(QtCore.QUrl, QtCore.QUrl())
    #: Name of the recording that is shown instead of a robot; empty for a robot.
    recording = ReadOnly(str, "")

    #: The recorder is to start or stop, and to write a mark.
    recordRequested = Signal()
    markRequested = Signal()
    #: Whether the tour is shown: at the first start, and when it is asked for.
    hints = ReadOnly(bool, False)

    #: The keyboard is wanted in the "catalogue" or the "form".
    focusWanted = Signal(str)

    _found = Signal(object)
    _examined = Signal(object)

    def __init__(
        self,
        layout: str | os.PathLike[str] = "",
        *,
        url: str = "",
        panels: Sequence[str | os.PathLike[str]] = (),
        import_paths: Sequence[str | os.PathLike[str]] = (),
        kiosk: bool = False,
    ) -> None:
        super().__init__()
        self._panels: list[Panel] = [*controls()]
        for place in panels:
            self._panels += folder_panels(os.fspath(place))
        self._titles = [words_of(one.name) for one in self._panels]
        plugins = find_plugins(os.environ, panels)
        for problem in plugins.problems:
            _log.warning("%s", problem)
        self._plugin_names = {plugin.id: plugin.name for plugin in plugins.plugins}
        #: Id of a plugin of RQml -> its place in the catalogue.
        self._plugins: dict[str, int] = {}
        self._plugin_folders = [os.fspath(place) for place in panels]
        for plugin in plugins.plugins:
            self._plugins[plugin.id] = len(self._panels)
            self._panels.append(_plugin_panel(plugin))
            self._titles.append(plugin.name)
        self._recording_url, self._robot_url = "", ""
        if layout and is_recording(layout):
            layout, url = "", replay_url(str(Path(layout).absolute()))
        self._to_open, self._url_given = (locate(layout) if layout else None), url
        if self._to_open is not None and self._to_open.suffix == ".qml":
            interface_file(layout)  # names the nearest file
        if self._to_open is not None:
            choice.expect(self._to_open)
        self._import_paths = list(import_paths)
        self._proposed: list[Proposal] = []
        self._results: dict[str, FoundRobot] = {}
        self._search: RobotSearch | None = None
        self._session: Session | None = None
        self._window: Any = None
        self._stage: Any = None
        self._plugin_engine: Any = None
        self._file: LayoutFile | None = None
        self._history = History("")
        self._live: LiveLayout | None = None
        self._own_changes: OwnChanges | None = None
        self._at_home = True
        self._said_at = 0.0
        self._reply: Callable[[int], object] | None = None
        self._tour: list[subprocess.Popen[bytes]] = []
        self._wanted = ""
        self._properties: PropertyModel | None = None
        self._graph: GraphWatch | None = None
        self._state = state_folder()
        self._trusted = TrustedLayouts()
        self._found.connect(self._on_found)
        self._examined.connect(self._on_examined)
        self._page = ""
        self._timer = QtCore.QTimer(self)
        self._timer.setInterval(round(_LOOK_S * 1000))
        self._timer.timeout.connect(self._look)
        report(self, kiosk=kiosk, recent=self._read_recent())
        report(self, folder=QtCore.QUrl.fromLocalFile(str(Path.cwd())))
        self._list_catalogue()

    # -- the robot -------------------------------------------------------------------------------

    @Slot()
    def searchRobots(self) -> None:
        """Look for robots at the address given, or at the usual ones."""
        if self._search is not None:
            self._search.close()
        urls = [self._url_given] if self._url_given else addresses()
        self._results = {}
        self._search = RobotSearch(urls, self._found.emit)
        report(self, searching=True)
        self._show_robots()

    def _on_found(self, robot: FoundRobot) -> None:
        self._results[robot.url] = robot
        waits = self._search is not None and len(self._results) < len(self._search.urls)
        report(self, searching=waits)
        self._show_robots()
        used = self._session is not None and self._session.url == robot.url
        answering = [one for one in self._results.values() if one.answers]
        if used or (not waits and len(answering) == 1 and not self._is_initialized()):
            self.connectTo(answering[0].url if answering else robot.url)

    def _is_initialized(self) -> bool:
        return self._session is not None and self._session.is_initialized

    def _show_robots(self) -> None:
        urls = self._search.urls if self._search is not None else []
        mine = self._session.url if self._is_initialized() and self._session is not None else ""
        rows = []
        for url in urls:
            robot = self._results.get(url)
            if robot is None:
                text = self.tr("looking …")
            elif robot.answers:
                text = self.tr("{} nodes, {} topics").format(len(robot.nodes), len(robot.topics))
            else:
                text = robot.problem
            answers = robot is not None and robot.answers
            rows.append(
                {"url": shown_url(url), "text": text, "answers": answers, "used": url == mine}
            )
        report(self, robots=rows)

    @Slot(str)
    def connectTo(self, url: str) -> None:
        """Connect to a robot; its panels are proposed once it has answered."""
        assert self._session is not None
        url = next((one for one in self._results if shown_url(one) == url), url.strip())
        if url.startswith(SCHEME):
            self._open_recording(url)
            return
        self._recording_url = ""
        self._session.url = url
        if not self._session.is_initialized:
            self._session.init("rosglass_cockpit")
        robot = self._results.get(url)
        if robot is None:
            self._search = RobotSearch([url], self._found.emit)
            self._results.pop(url, None)
            report(self, searching=True)
        elif robot.answers:
            self._propose(robot)
        self._show_robots()
        self._look()

    def _propose(self, robot: FoundRobot) -> None:
        usable = [one for one in self._panels if not one.problem]
        self._proposed = propose(robot.topics, usable)
        rows = [
            {"title": _title_of(one.panel.name), "reason": one.reason} for one in self._proposed
        ]
        report(self, proposals=rows)
        self._list_catalogue()

    def _open_recording(self, url: str) -> None:
        """Show a recording instead of the robot, once it could be read."""
        self._recording_url = url
        self.say(self.tr("reading {} …").format(path_of(url)))
        examined = self._examined.emit
        threading.Thread(
            target=lambda: examined(examine(url)), name="open a recording", daemon=True
        ).start()

    def _on_examined(self, found: Examined) -> None:
        session = self._session
        if session is None or found.url != self._recording_url:
            return  # another one was chosen since
        if found.error:
            _log.error("%s", found.error)
            self._recording_url = session.url if session.url.startswith(SCHEME) else ""
            self._ask(found.error, [self.tr("Close")], lambda _: None)
            if not self._is_initialized() and self._search is None:
                self.searchUsual()
            return
        if self._search is not None:
            self._search.close()
            self._search = None
            report(self, searching=False)
        if not session.url.startswith(SCHEME):
            self._robot_url = session.url if session.is_initialized else ""
        session.url = found.url
        if not session.is_initialized:
            session.init("rosglass_cockpit")
        self._propose(FoundRobot(found.url, found.topics, ("/recording",)))
        self.say(found.problem or self.tr("{} is open").format(path_of(found.url)))
        self._look()
        if not self._has_layout() and self._proposed:
            self._start(first_layout(self._proposed, self.tr("Recording")), self.tr("Recording"))
            self._edit_mode(False)

    @Slot()
    def closeRecording(self) -> None:
        """Return to the robot that was shown before; to the start page without one."""
        if not self.recording:
            self.say(self.tr("no recording is open"))
            return
        self._recording_url = ""
        if self._robot_url:
            self.connectTo(self._robot_url)
            return
        assert self._session is not None
        self._session.shutdown()
        self._look()
        self._at_home = True
        self._edit_mode(False)
        self._refresh()
        self.searchUsual()

    def searchUsual(self) -> None:
        """Look for robots at the usual addresses, in place of a recording."""
        if self._url_given.startswith(SCHEME):
            self._url_given = ""
        self.searchRobots()

    def _record(self) -> None:
        if self.recording:
            self.say(self.tr("this is a recording; connect to a robot to record it"))
            return
        if not self._is_initialized():
            self.say(self.tr("connect to a robot first"))
            return
        self.recordRequested.emit()

    @Slot()
    def startTour(self) -> None:
        """Start a simulated robot on this machine, and connect to it."""
        if not self._tour:
            command = [sys.executable, "-m", "rosglass"]
            where = ["--listen", _TOUR_URL.replace("zenoh://", "tcp/")]
            for words in (["router", *where], ["robot", "--url", _TOUR_URL]):
                self._tour.append(
                    subprocess.Popen(
                        [*command, *words],
                        stdin=subprocess.DEVNULL,
                        stdout=subprocess.DEVNULL,
                        stderr=subprocess.DEVNULL,
                    )
                )
        self.say(self.tr("a simulated robot is being started"))
        # Its first topics take about two seconds.
        QtCore.QTimer.singleShot(3000, lambda: self._connect_to_tour(5))

    def _connect_to_tour(self, tries: int) -> None:
        if not is_alive(self) or not self._tour:
            return
        ended = [one.returncode for one in self._tour if one.poll() is not None]
        if ended:
            self.say(self.tr("the simulated robot could not be started: try `rosglass demo`"))
            self._end_tour()
            return
        del tries
        self.connectTo(_TOUR_URL)

    def _end_tour(self) -> None:
        for process in reversed(self._tour):
            process.terminate()
        self._tour = []

    # -- the catalogue ---------------------------------------------------------------------------

    @Slot(str)
    def searchCatalogue(self, text: str) -> None:
        """List the panels that a text finds; all for an empty one, those that suit first."""
        self._wanted = text
        self._list_catalogue()

    def _list_catalogue(self) -> None:
        fitting = {one.panel.name for one in self._proposed}
        lines = [_translated(one.line) for one in self._panels]
        names = [
            f"{one.name} {title}" for one, title in zip(self._panels, self._titles, strict=True)
        ]
        found = search(self._wanted, names, lines)
        if not self._wanted:
            found = sorted(found, key=lambda at: self._panels[at].name not in fitting)
        report(
            self,
            catalogue=[
                {
                    "index": at,
                    "title": self._titles[at],
                    "line": self._panels[at].problem or lines[at],
                    "icon": self._panels[at].icon,
                    "group": _translated(self._panels[at].group),
                    "fits": self._panels[at].name in fitting,
                }
                for at in found
            ],
        )

    @Slot(int)
    def add(self, index: int) -> None:
        """Add a panel of the catalogue, beside the selected one."""
        if not 0 <= index < len(self._panels):
            return
        panel = self._panels[index]
        if panel.problem:
            self.say(panel.problem)
            return
        proposal = next((one for one in self._proposed if one.panel.name == panel.name), None)
        snippet = proposal.snippet if proposal is not None else panel.snippet
        self._add(panel, snippet, self._titles[index])

    @Slot()
    def addAll(self) -> None:
        """Show all proposed panels in a new layout."""
        self._start(first_layout(self._proposed, self.tr("Robot"), _title_of), self.tr("Robot"))

    # -- what is remembered ----------------------------------------------------------------------

    def _read_recent(self) -> list[str]:
        try:
            found = json.loads((self._state / "recent.json").read_text(encoding="utf-8"))
            return [str(one) for one in found if Path(str(one)).is_file()][:_MAX_RECENT]
        except (OSError, ValueError, TypeError):
            return []

    def _remember(self, path: Path) -> None:
        files = [str(path), *(one for one in self._read_recent() if one != str(path))][:_MAX_RECENT]
        try:
            self._state.mkdir(parents=True, exist_ok=True)
            (self._state / "recent.json").write_text(json.dumps(files), encoding="utf-8")
        except OSError as error:
            _log.warning("%s: files opened lately are not remembered: %s", self._state, error)
        report(self, recent=files)

    # -- messages and questions ------------------------------------------------------------------

    @Slot(str)
    def say(self, text: str) -> None:
        """Show a message in the status bar for some seconds."""
        self._said_at = time.monotonic()
        report(self, message=text)

    def _ask(
        self, text: str, answers: list[str], reply: Callable[[int], object], first: int = 0
    ) -> None:
        """Ask the user; Return takes the answer with the number `first`."""
        self._reply = reply
        report(self, answers=answers, firstAnswer=first, question=text)

    @Slot(int)
    def answer(self, index: int) -> None:
        """Answer the question that is shown."""
        reply, self._reply = self._reply, None
        report(self, question="", answers=[])
        if reply is not None:
            reply(index)

    # -- the layout ------------------------------------------------------------------------------

    @Slot(QtCore.QObject, QtCore.QObject)
    def begin(self, window: Any, stage: Any) -> None:
        """Set the window and the item that shows the layout; called by the window."""
        self._window = window
        runtime = runtime_of(window)
        assert runtime is not None
        self._session = runtime.session
        # The node begins when the user connects.
        self._session.reminds = False
        self._stage = stage
        Watchdog.of(runtime.session).script_ended.connect(self._on_script_ended)
        if choice.renderer == "software":
            self._panels = [
                replace(one, problem=self.tr("needs OpenGL: start with --renderer opengl"))
                if one.name == "SceneView"
                else one
                for one in self._panels
            ]
        # Only now there is a Qt application, with its language.
        self._titles = [_translated(one) for one in self._titles]
        self._list_catalogue()
        self._timer.start()
        self._look()
        # Not over a layout that was given, of which it would cover controls.
        first = self._to_open is None and not (self._state / _HINTS_SEEN).exists()
        report(self, hints=first)
        if self._to_open is not None:
            self.open(str(self._to_open))
        if self._url_given.startswith(SCHEME):
            self._open_recording(self._url_given)
        elif self._to_open is None:
            self.searchRobots()
            self._recover_new()

    def _recover_new(self) -> None:
        """Offer a layout that never had a file, if the cockpit ended before it was saved."""
        unsaved = self._state / _UNSAVED
        text = Recovery.find(unsaved)
        if text is None:
            return

        def decide(index: int) -> None:
            if index == 1:
                Recovery.drop(unsaved)
                return
            name = self.tr("Cockpit")
            if self._try(lambda: Document(text, name)):
                self._start(text, name)
                self._keep_recovery()

        self._ask(
            self.tr("The cockpit ended before a new layout was saved."),
            [self.tr("Restore it"), self.tr("Discard it")],
            decide,
        )

    def _on_script_ended(self, engine: Any, text: str) -> None:
        del engine
        self.say(text)

    def _keep_closed(self) -> None:
        """Offer robots, unless there is a layout to go on with."""
        if not self._has_layout() and self._search is None:
            self.searchRobots()

    @Slot(str)
    def open(self, path: str) -> None:
        """Open a layout; an error is shown, and what is open stays."""
        file = Path(path).absolute()
        self._leave(lambda: self._open(file))

    def _open(self, path: Path) -> None:
        try:
            if is_foreign(path):
                self._import(path)
                return
            file = LayoutFile.open(path)
            document = Document(file.text, str(path))
        except Error as error:
            _log.error("%s", error)
            report(self, problem=str(error))
            self.say(str(error))
            self._keep_closed()
            return
        found = [] if self._trusted.knows(path, file.text) else senders(document)
        if not found:
            self._accept(file, document)
            return
        more = self.tr(" and {} more").format(len(found) - _MAX_SENDERS)
        shown = ", ".join(found[:_MAX_SENDERS]) + (more if len(found) > _MAX_SENDERS else "")
        self._ask(
            self.tr(
                "{} was not opened here before. It can send to the robot: {}. Open it only if you "
                "know where it comes from."
            ).format(path, shown),
            [
                self.tr("Open, and trust this folder"),
                self.tr("Open once"),
                self.tr("Do not open"),
            ],
            lambda index: self._decide_on(index, file, document),
            first=2,
        )

    def _import(self, path: Path) -> None:
        """Show a layout of another program as a new one, and list what is not as it was there."""
        imported = import_layout(path, self._plugin_names)
        self._begin(imported.text, path.stem)
        left_out = [*imported.left_out]
        scene = self._about("SceneView")
        if "SceneView" in imported.text and scene is not None and scene.problem:
            left_out.append(f"SceneView: {scene.problem}")
        for line in left_out:
            _log.warning("%s: %s", path, line)
        if left_out:
            lines = [f"• {line}" for line in left_out[:_MAX_LEFT_OUT]]
            if len(left_out) > _MAX_LEFT_OUT:
                more = len(left_out) - _MAX_LEFT_OUT
                lines.append(self.tr("and {} more, which are logged").format(more))
            text = self.tr("This layout of {} was read, except for:").format(imported.program)
            self._ask("\n".join([text, *lines]), [self.tr("Go on")], lambda _: None)
        else:
            self.say(self.tr("this layout of {} was read").format(imported.program))

    def _decide_on(self, index: int, file: LayoutFile, document: Document) -> None:
        if index == 2:
            self._keep_closed()
            return
        if index == 0:
            self._try(lambda: self._trusted.trust_folder(file.path.parent))
        self._accept(file, document)

    def _try(self, job: Callable[[], object]) -> bool:
        """Call a function, and say its error; return whether there was none."""
        try:
            job()
        except Error as error:
            self.say(str(error))
            return False
        return True

    def _accept(self, file: LayoutFile, document: Document) -> None:
        path = file.path
        self._file = file
        self._show_layout(document, path.name)
        self._remember(path)
        recovered = Recovery.find(path)
        if recovered is not None and recovered != file.text:
            self._ask(
                self.tr("The cockpit ended before changes of {} were saved.").format(path.name),
                [self.tr("Restore them"), self.tr("Discard them")],
                lambda index: self._restore(recovered) if index == 0 else Recovery.drop(path),
            )

    def _restore(self, text: str) -> None:
        try:
            self._apply(self.tr("Restore"), Document(text, self.path))
        except Error as error:
            self.say(str(error))

    def _start(self, text: str, name: str) -> None:
        """Show a layout that has no file yet, in the place of the present one."""
        self._leave(lambda: self._begin(text, name))

    def _begin(self, text: str, name: str) -> None:
        self._file = None
        self._show_layout(Document(text, name), name)
        self._edit_mode(True)

    def _show_layout(self, document: Document, name: str) -> None:
        assert self._session is not None
        path = self._file.path if self._file is not None else Path.cwd() / "layout.qml"
        if self._properties is None:
            # Before there is a node, elements ask the user to call init().
            self._properties = PropertyModel(self, runtime_of(self._window))
            self._properties.edited.connect(self._on_property_edited)
            report(self, form=self._properties)
            self._graph = GraphWatch(self, runtime_of(self._window))
        live = LiveLayout(path, self._session, self._stage, import_paths=self._import_paths)
        live.edited.connect(self._apply)
        live.refused.connect(self.say)
        live.problem_changed.connect(self._on_problem)
        live.loaded.connect(self._on_loaded)
        self._own_changes = OwnChanges(live)
        self._own_changes.edited.connect(self._on_own_change)
        self._own_changes.refused.connect(self.say)
        before, self._live = self._live, live
        self._history, self._at_home = History(document.text), False
        report(
            self, name=name, path=str(self._file.path) if self._file is not None else "", problem=""
        )
        self._show(document)
        if before is not None:
            before.close()

    def _on_loaded(self) -> None:
        """Follow the root, which is a new one."""
        assert self._live is not None
        root = self._live.root
        root.setProperty("editing", self.editing)
        root.currentChanged.connect(self._show_selected)
        root.helpRequested.connect(self._on_help_requested)
        engine = QtQml.qmlEngine(root)
        if engine is not None and engine is not self._plugin_engine:
            self._plugin_engine, api = engine, RqmlApi.of(engine)
            api.folders = self._plugin_folders
            # Later: the layout changes while the plugin's handler runs.
            api.pluginRequested.connect(
                self._on_plugin_requested, QtCore.Qt.ConnectionType.QueuedConnection
            )
        self._show_selected()

    @Slot(str)
    def _on_plugin_requested(self, plugin: str) -> None:
        """Add a plugin of RQml that another one asks for; Undo takes it away again."""
        if self.kiosk:
            self.say(self.tr("A plugin asks for {}: a kiosk's layout stays").format(plugin))
        elif plugin in self._plugins:
            self.add(self._plugins[plugin])

    def _on_help_requested(self, item: Any) -> None:
        live = self._live
        shown = content_of(live.object_of(item)) if live is not None else None
        about = self._about(shown.type) if shown is not None else None
        self.help(about.page if about is not None else "")

    @property
    def _selection(self) -> Object | None:
        """The selected panel in the document."""
        live = self._live
        if live is None or not is_alive(live.root):
            return None
        return live.object_of(live.root.property("current"))

    def _show(self, document: Document) -> None:
        assert self._live is not None
        assert self._own_changes is not None
        self._own_changes.paused = True
        try:
            self._live.show(document)
            self._own_changes.follow()
        finally:
            self._own_changes.paused = False
        self._refresh()

    def _on_own_change(self, name: str, document: Document) -> None:
        self._apply(name, document, merge=name)

    def _apply(self, name: str, document: Document, merge: str = "") -> None:
        """Make a change: the text is the truth, and the screen follows."""
        self._history.push(name, document.text, merge)
        self._show(document)
        self._keep_recovery()

    def _edit(self, name: str, change: Callable[[LayoutEdits], object]) -> None:
        """Change the layout by edits; a change that is not possible is said."""
        assert self._live is not None
        if self._live.document is None:
            return
        edits = LayoutEdits(self._live.document)
        try:
            change(edits)
        except Error as error:
            self.say(str(error))
            return
        self._apply(name, edits.document)

    def _refresh(self) -> None:
        history = self._history
        report(
            self,
            opened=self._has_layout() and not self._at_home,
            hasLayout=self._has_layout(),
            modified=self._is_modified(),
            undoText=history.undo_name,
            redoText=history.redo_name,
        )
        self._show_selected()

    def _is_modified(self) -> bool:
        """Return whether the layout has another text than its file, or no file."""
        file = self._file
        return self._has_layout() and (file is None or file.text != self._history.text)

    def _has_layout(self) -> bool:
        return self._live is not None and self._live.document is not None

    @Slot()
    def undo(self) -> None:
        """Take the last change back."""
        self._go(self._history.undo())

    @Slot()
    def redo(self) -> None:
        """Make the change again that was taken back last."""
        self._go(self._history.redo())

    def _go(self, text: str) -> None:
        if self._has_layout():
            self._show(Document(text, self.path or self.name))
            self._keep_recovery()

    def _keep_recovery(self) -> None:
        path = Path(self.path) if self.path else self._state / _UNSAVED
        try:
            if self._is_modified():
                Recovery.keep(path, self._history.text)
            else:
                Recovery.drop(path)
        except Error as error:
            self.say(str(error))

    # -- panels ----------------------------------------------------------------------------------

    def _add(self, panel: Panel, snippet: str, title: str) -> None:
        if not self._has_layout():
            self._start(empty_layout(self.tr("Cockpit")), self.tr("Cockpit"))
        live = self._live
        assert live is not None
        target, page = self._selection, None
        if is_alive(live.root):
            page = live.object_of(live.root.property("page"))
        text = panel_text(panel, snippet, title)

        def change(edits: LayoutEdits) -> None:
            if target is not None:
                edits.add(text, target, "right" if _is_wide(live.item_of(target)) else "bottom")
            else:
                edits.add(text, page)
            for module in panel.imports:
                place, _, alias = module.partition(" as ")
                name, _, version = place.partition(" ")
                edits.document = edits.document.add_import(name.strip('"'), version, alias)

        self._edit(self.tr("Add {}").format(title), change)
        self._edit_mode(True)

    @Slot()
    def _show_selected(self) -> None:
        panel = self._selection
        report(
            self,
            selected=panel is not None,
            selectedTitle=_literal_title(panel),
        )
        shown = content_of(panel)
        about = None if shown is None else self._about(shown.type)
        values = {}
        if shown is not None:
            values = {
                one.name: one.text
                for one in shown.members
                if one.kind in ("literal", "binding") and one.name != "id"
            }
        if self._properties is not None:
            self._properties.show(about, values)

    def _about(self, kind: str) -> Panel | None:
        return find(kind, self._panels)

    def _on_property_edited(self, name: str, expression: str) -> None:
        live, shown = self._live, content_of(self._selection)
        if live is None or live.document is None or shown is None:
            return
        document = live.document
        try:
            if expression:
                document = document.set_property(shown, name, Code(expression), overwrite=True)
            else:
                document = document.remove_property(shown, name)
        except Error as error:
            self.say(str(error))
            return
        self._apply(self.tr("Change {}").format(name), document, merge=f"{shown.path}.{name}")

    @Slot(str)
    def rename(self, title: str) -> None:
        """Give the selected panel another title."""
        panel = self._selection
        if panel is not None:
            self._edit(self.tr("Rename"), lambda edits: edits.rename(panel, title))

    # -- commands --------------------------------------------------------------------------------

    def _commands(self) -> dict[str, tuple[_Command, Callable[[], object]]]:
        """Return the commands by name; those of panels and pages are added by :meth:`commands`."""
        return {
            "palette": (_Command(self.tr("Commands"), "Ctrl+P"), lambda: None),
            "home": (
                _Command(self.tr("Start page: robots and layouts"), "Ctrl+H"),
                self._toggle_home,
            ),
            "new": (_Command(self.tr("New layout"), "Ctrl+N"), self._new),
            "open": (_Command(self.tr("Open a layout"), "Ctrl+O", asks=True), lambda: None),
            "save": (
                _Command(self.tr("Save the layout"), "Ctrl+S", "layout"),
                lambda: self.save(""),
            ),
            "save as": (
                _Command(self.tr("Save the layout as …"), "Ctrl+Shift+S", "layout", True),
                lambda: None,
            ),
            "edit": (
                _Command(self.tr("Edit the layout, or use it"), "F4", "layout"),
                self._toggle_edit,
            ),
            "undo": (_Command(self.tr("Undo"), "Ctrl+Z", "edit"), self.undo),
            "redo": (_Command(self.tr("Redo"), "Ctrl+Shift+Z", "edit"), self.redo),
            "remove": (_Command(self.tr("Remove the selected panel"), "", "edit"), self._remove),
            "add page": (_Command(self.tr("Add a page"), "", "edit"), self._add_page),
            "robot pages": (
                _Command(self.tr("Pages for all robots"), "", "edit"),
                self._add_robot_pages,
            ),
            "add all": (_Command(self.tr("New layout of what the robot offers")), self.addAll),
            "search": (_Command(self.tr("Search robots")), self.searchRobots),
            "tour": (_Command(self.tr("Try it on a simulated robot")), self.startTour),
            "open recording": (_Command(self.tr("Open a recording"), asks=True), lambda: None),
            "close recording": (_Command(self.tr("Close the recording")), self.closeRecording),
            "record": (_Command(self.tr("Record, or stop recording"), "Ctrl+R"), self._record),
            "mark": (
                _Command(self.tr("Mark this moment in the recording"), "Ctrl+M"),
                self.markRequested.emit,
            ),
            "catalogue": (
                _Command(self.tr("Find a panel to add"), "Ctrl+I", "layout"),
                lambda: self._focus("catalogue"),
            ),
            "form": (
                _Command(self.tr("Properties of the selected panel"), "Ctrl+E", "layout"),
                lambda: self._focus("form"),
            ),
            "keys": (_Command(self.tr("Keys")), self.showKeys),
            "hints": (_Command(self.tr("Tour of the cockpit")), lambda: report(self, hints=True)),
            "help": (_Command(self.tr("Help")), lambda: self.help("")),
        }

    @Slot(str, result="QVariantList")
    def commands(self, text: str) -> list[dict[str, Any]]:
        """Return the commands that a text finds, best first; all of them for an empty one."""
        rows = [
            {
                "name": name,
                "text": one.text,
                "keys": one.keys,
                "shown": _shown_keys(one.keys),
                "file": one.asks,
            }
            for name, (one, _) in self._commands().items()
            if not one.needs or self._has_layout() or not text
        ]
        if not text:
            return rows
        rows += [
            {
                "name": f"add {at}",
                "text": self.tr("Add panel: {}").format(title),
                "keys": "",
                "shown": "",
            }
            for at, title in enumerate(self._titles)
        ]
        for word in text.split():
            rows = [rows[at] for at in search(word, [str(row["text"]) for row in rows])]
        return rows

    @Slot(str)
    def run(self, name: str) -> None:
        """Carry out a command of the palette."""
        word, _, number = name.partition(" ")
        if word == "add" and number.isdigit():
            self.add(int(number))
            return
        found = self._commands().get(name)
        if found is None:
            self.say(self.tr("there is no command {}").format(repr(name)))
            return
        command, carry_out = found
        if command.needs and not self._has_layout():
            self.say(self.tr("open or make a layout first"))
            return
        if command.needs == "edit" and not self.editing:
            self.say(self.tr("the layout is changed in edit mode only: F4"))
            return
        self.halt()
        carry_out()

    @Slot()
    def halt(self) -> None:
        """Halt all commands of the layout: what is held has to be let go first."""
        if self._live is not None and is_alive(self._live.root):
            QtCore.QMetaObject.invokeMethod(self._live.root, "halt")

    def _toggle_home(self) -> None:
        if self._has_layout():
            self._at_home = not self._at_home
            self._edit_mode(False)
            self._refresh()
            if self._at_home and self._search is None:
                self.searchRobots()

    def _new(self) -> None:
        self._start(empty_layout(self.tr("Cockpit")), self.tr("Cockpit"))

    def _toggle_edit(self) -> None:
        self._edit_mode(not self.editing)

    def _edit_mode(self, on: bool) -> None:
        if self._live is not None and self._has_layout():
            if is_alive(self._live.root):
                self._live.root.setProperty("editing", on)
            report(self, editing=on)
            self._show_selected()

    def _remove(self) -> None:
        panel = self._selection
        if panel is None:
            self.say(self.tr("select a panel first"))
            return
        self._edit(self.tr("Remove {}").format(_literal_title(panel) or self.tr("panel")),
                   lambda edits: edits.remove(panel))  # fmt: skip

    def _add_page(self) -> None:
        self._edit(self.tr("Add page"), lambda edits: edits.add_page(self.tr("Page")))

    def _add_robot_pages(self) -> None:
        """Make a page for each robot from the first one."""
        live = self._live
        assert live is not None
        if live.document is None:
            return
        assert self._graph is not None
        robots = self._graph.namespaces(_ROBOT_TOPIC)
        try:
            pages = pages_for_robots(live.document, robots, self._has_ns)
        except Error as error:
            self.say(str(error))
            return
        if not pages.made:
            self.say(self.tr("each of the {} robots has its page").format(len(robots)))
            return
        self._apply(self.tr("Pages for all robots"), pages.document)
        if pages.same:
            listed = ", ".join(pages.same[:_MAX_SENDERS])
            self.say(self.tr("{} pages; the same on all: {}").format(len(pages.made), listed))
        else:
            self.say(self.tr("{} pages").format(len(pages.made)))

    def _has_ns(self, kind: str) -> bool:
        about = self._about(kind)
        return about is not None and about.property("ns") is not None

    # -- files -----------------------------------------------------------------------------------

    @Slot(result=QtCore.QObject)
    def findNameField(self) -> QtCore.QObject | None:
        """Return where the name is typed in Qt's own file dialog; None in those of the system."""
        found = self._window.findChildren(QtCore.QObject, "fileNameTextField")
        return next((one for one in found if one.property("visible")), None)

    @Slot(result=QtCore.QUrl)
    def proposedFile(self) -> QtCore.QUrl:
        """Return the file that `save as` proposes."""
        folder = Path(self.folder.toLocalFile() or Path.cwd())
        return QtCore.QUrl.fromLocalFile(self.path or str(folder / "cockpit.qml"))

    @Slot(str, QtCore.QUrl, bool)
    def useFile(self, purpose: str, url: QtCore.QUrl, ask: bool) -> None:
        """Use a file for a command that has asked for one.

        Args:
            purpose: The command.
            url: The file.
            ask: Whether to ask before a file is replaced: the dialog has not.
        """
        # Qt's dialog joins absolute paths, and those with ~, to the folder that it shows.
        path = Path(url.toLocalFile())
        _, found, typed = url.path().partition("//")
        if found:
            path = Path("/", typed.lstrip("/"))
        _, found, typed = url.path().partition("/~/")
        if found:
            path = Path.home() / typed
        report(self, folder=QtCore.QUrl.fromLocalFile(str(path.parent)))
        if purpose == "open":
            self.open(str(path))
        elif purpose == "open recording":
            self._open_recording(replay_url(str(path)))
        elif ask and path.exists() and str(path) != self.path:
            self._ask(
                self.tr("{} exists already.").format(path),
                [self.tr("Replace it"), self.tr("Go on")],
                lambda index: self.save(str(path)) if index == 0 else None,
            )
        else:
            self.save(str(path))

    @Slot(str, result=bool)
    def save(self, path: str) -> bool:
        """Save the layout; where it was opened for an empty path. Returns whether it is saved."""
        if not path and self._file is None:
            self.say(self.tr("choose a file first: Ctrl+Shift+S"))
            return False
        text = self._history.text
        try:
            if path:
                file = Path(path).absolute()
                self._file = LayoutFile.create(file, text)
            else:
                assert self._file is not None
                self._file.save(text)
        except Error as error:
            self.say(str(error))
            return False
        Recovery.drop(self._file.path)
        saved = self._file.path
        self._try(lambda: self._trusted.trust(saved, text))
        self._remember(saved)
        report(self, path=str(self._file.path), name=self._file.path.name)
        self.say(self.tr("saved to {}").format(self._file.path))
        self._refresh()
        return True

    @Slot()
    def discard(self) -> None:
        """Forget changes that are not saved."""
        Recovery.drop(Path(self.path) if self.path else self._state / _UNSAVED)

    def _leave(self, go_on: Callable[[], None]) -> None:
        """Go on to another layout, once the user has decided on changes of this one."""
        if not self.modified:
            go_on()
            return

        def decide(index: int) -> None:
            if index == 2 or (index == 0 and not self.save("")):
                return
            if index == 1:
                self.discard()
            go_on()

        self._ask(
            self.tr("{} has changes that are not saved.").format(self.name),
            [self.tr("Save"), self.tr("Discard"), self.tr("Go on")],
            decide,
        )

    # -- help, and the clock ---------------------------------------------------------------------

    @Slot(str)
    def help(self, page: str) -> None:
        """Show a page of the documentation; the page about the cockpit for an empty one.

        Args:
            page: Such as ``controls/Battery.html``.
        """
        name = (page or "cockpit.html").removesuffix(".html") + ".md"
        file = _help_folder() / name
        try:
            report(self, helpText=_readable(file.read_text(encoding="utf-8")))
            self._page = name
        except OSError as error:
            self.say(f"{file}: {error.strerror or error}")

    @Slot(str)
    def follow(self, link: str) -> None:
        """Open the page that a link of the help leads to."""
        address = link.partition("#")[0]
        name = posixpath.normpath(posixpath.join(posixpath.dirname(self._page), address))
        if not (address.endswith(".md") and (_help_folder() / name).is_file()):
            self.say(
                self.tr("this is not among the pages that come with the cockpit: {}").format(link)
            )
            return
        self.help(f"{name.removesuffix('.md')}.html")

    @Slot(QtGui.QColor)
    def useLinkColor(self, color: QtGui.QColor) -> None:
        """Show links of help in a colour: Markdown's come from the application's palette."""
        palette = QtGui.QGuiApplication.palette()
        palette.setColor(QtGui.QPalette.ColorRole.Link, color)
        QtGui.QGuiApplication.setPalette(palette)

    @Slot()
    def closeHelp(self) -> None:
        """Close the page of help."""
        report(self, helpText="")

    @Slot()
    def showKeys(self) -> None:
        """Show the keys of the editor, of the layout, and of edit mode."""
        editor = [(_shown_keys(one.keys), one.text) for one, _ in self._commands().values()]
        groups = {self.tr("Keys"): [row for row in editor if row[0]]}
        if self._live is not None and is_alive(self._live.root):
            for name, title in (
                ("keyMap", self.tr("In a layout")),
                ("editKeyMap", self.tr("In edit mode")),
            ):
                groups[title] = _plain(self._live.root.property(name))
        text = "\n".join(
            f"# {title}\n\n" + "\n".join(f"- **{keys}**: {said}" for keys, said in rows) + "\n"
            for title, rows in groups.items()
        )
        report(self, helpText=text)

    @Slot(str, result=str)
    def keysOf(self, name: str) -> str:
        """Return the keys of a command, as they are written on the user's keyboard."""
        return _shown_keys(self._commands()[name][0].keys)

    def _focus(self, place: str) -> None:
        """Give the keyboard to the catalogue or the form, in edit mode."""
        if place == "form" and self._selection is None:
            self.say(self.tr("select a panel first"))
            return
        self._edit_mode(True)
        self.focusWanted.emit(place)

    @Slot()
    def endHints(self) -> None:
        """Remember that the tour was shown."""
        report(self, hints=False)
        try:
            self._state.mkdir(parents=True, exist_ok=True)
            (self._state / _HINTS_SEEN).touch()
        except OSError as error:
            _log.warning("%s: the tour will be shown again: %s", self._state, error)

    def _on_problem(self) -> None:
        if self._live is None:
            return
        report(self, problem=self._live.problem)

    def _look(self) -> None:
        """Follow the connection, and what others do to the file; every second."""
        session = self._session
        if session is None or not is_alive(self._window):
            self._timer.stop()
            return
        if self.message and time.monotonic() - self._said_at > _MESSAGE_S:
            report(self, message="")
        state = session.state if session.is_initialized else ""
        shown = {
            "connected": self.tr("connected"),
            "connecting": self.tr("connecting"),
            "lost": self.tr("connection lost"),
            "closed": self.tr("closed"),
            "failed": self.tr("failed"),
        }.get(state, state)
        detail = f"{shown}: {session.detail}" if session.detail and state != "connected" else shown
        report(
            self,
            connected=state == "connected",
            connection=detail,
            url=shown_url(session.url) if session.is_initialized else "",
            recording=path_of(session.url).name
            if session.is_initialized and session.url.startswith(SCHEME)
            else "",
        )
        if self._file is not None and self._file.changed_outside() and not self.question:
            self._on_changed_outside(self._file)

    def _on_changed_outside(self, file: LayoutFile) -> None:
        try:
            theirs = file.reread()
            merged, conflicts = file.merge(self._history.text)
            document = Document(merged, str(file.path))
        except Error as error:
            self.say(str(error))
            return
        if not conflicts:
            file.accept(theirs)
            self._apply(self.tr("Changes from outside"), document)
            self.say(self.tr("{} was changed by another program; merged").format(file.path.name))
            return

        def decide(index: int) -> None:
            file.accept(theirs)
            if index == 0:
                self._apply(self.tr("Changes from outside"), Document(theirs, str(file.path)))

        self._ask(
            self.tr("{} was changed by another program, in the same lines as here.").format(
                file.path.name
            ),
            [self.tr("Take theirs"), self.tr("Keep mine")],
            decide,
            first=1,
        )

    def close(self) -> None:
        """End what the program has started; safe to call twice."""
        self._timer.stop()
        if self._search is not None:
            self._search.close()
        live, self._live = self._live, None
        if live is not None:
            live.close()
        self._end_tour()


def _plugin_panel(plugin: RqmlPlugin) -> Panel:
    """Return a plugin of RQml as an entry of the catalogue."""
    return Panel(
        "Plugin",
        "RQml",
        f"{plugin.name}, of {plugin.package}",
        plugin.name[:1].upper(),
        f"Plugin {{\n    source: {to_qml(plugin.source)}\n}}",
        imports=("RosCockpit 1.0",),
        page="cockpit.html",
    )


def _translated(text: str) -> str:
    """Return a text of the catalogue, which is read from QML files, in the user's language."""
    return str(QtCore.QCoreApplication.translate("Catalogue", text))


def _plain(value: Any) -> list[tuple[str, str]]:
    """Return a list of keys and texts of QML."""
    rows = value.toVariant() if hasattr(value, "toVariant") else value
    return [(str(keys), str(text)) for keys, text in rows or ()]


def _shown_keys(keys: str) -> str:
    """Return keys as they are written on the user's keyboard, such as ``Strg+P``."""
    return QtGui.QKeySequence(keys).toString(QtGui.QKeySequence.SequenceFormat.NativeText)


def _title_of(name: str) -> str:
    """Return the name of a type as words, in the user's language."""
    return _translated(words_of(name))


def _is_wide(item: Any) -> bool:
    """Return whether a panel is better split by a vertical line than by a horizontal one."""
    return item is None or item.width() >= item.height()


def _literal_title(panel: Any) -> str:
    member = panel.get("title") if panel is not None else None
    return str(member.value) if member is not None and member.kind == "literal" else ""


def _readable(text: str) -> str:
    """Return a page as one text: without images, and with the files that it includes."""
    lines = []
    for line in text.splitlines():
        if line.startswith("--8<--"):
            lines += _example(line.split('"')[1])
        elif not line.startswith("!["):
            lines.append("```" if line.startswith("```") else line)
    return "\n".join(lines)


def _example(name: str) -> list[str]:
    """Return the lines of an example; none if it does not come with the installation."""
    for folder in (Path(__file__).parents[1] / "examples", Path(__file__).parents[3] / "examples"):
        if (folder / name).is_file():
            return (folder / name).read_text(encoding="utf-8").splitlines()
    return []
