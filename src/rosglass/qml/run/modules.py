"""Finds QML files, and registers the QML modules with Qt and engines."""
# ruff: noqa: PTH112, PTH113, PTH208 - the names of slots and signals are QML's

from __future__ import annotations

import ctypes
import logging
import os
import warnings
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from rosglass.comm.names import similar
from rosglass.errors import Error, QmlError, UnsupportedError
from rosglass.qml.engine.runtime import Runtime, runtime_of
from rosglass.qt import QT6, QtCore, QtQml, QtQuick, address

if TYPE_CHECKING:
    from rosglass.qml.engine.session import Session


__all__ = [
    "IMPORT_PATHS",
    "import_folder",
    "install",
    "interface_file",
    "is_own_window",
    "locate",
    "near",
    "register",
    "register_class",
    "show_plain_labels",
]

_log = logging.getLogger("rosglass.qml")
_LIBRARY = "libQt5Qml.so.5"
_LIBRARIES = {".so", ".dylib", ".dll"}
_PACKAGE = "package://"
_REMOTE = ("http://", "https://", "ftp://")
#: Folder of rosglass's own windows, whose program registers the types that they use.
_OWN = Path(__file__).parents[2] / "scene/app/panels"


def locate(place: str | os.PathLike[str]) -> Path:
    """Return the path of a file or folder, optionally in a ROS package.

    Args:
        place: A path, or ``package://name/path``; packages are searched in ``ROS_PACKAGE_PATH``,
            ``AMENT_PREFIX_PATH`` and ``CMAKE_PREFIX_PATH``.

    Raises:
        QmlError: The package is not in these paths.
    """
    text = os.fspath(place)
    if not text.startswith(_PACKAGE):
        return Path(text).absolute()
    package, _, rest = text.removeprefix(_PACKAGE).partition("/")
    if not package:
        raise QmlError(f"{text}: expected package://name/path")
    # Slow to import; most files are not named so.
    from rosglass.interfaces.provider import workspace  # noqa: PLC0415

    folder = workspace(os.environ).package(package)
    if not folder:
        raise QmlError(
            f"{text}: there is no package {package!r} in ROS_PACKAGE_PATH, AMENT_PREFIX_PATH and "
            "CMAKE_PREFIX_PATH; source its workspace first"
        )
    return Path(folder, rest).absolute()


def interface_file(place: str | os.PathLike[str]) -> Path:
    """Return the path of a QML file.

    Args:
        place: See :func:`locate`.

    Raises:
        QmlError: The file does not exist, or is not a QML file.
    """
    if os.fspath(place).lower().startswith(_REMOTE):
        raise QmlError(f"{os.fspath(place)}: interfaces are run from files of this machine only")
    path = locate(place)
    shown = path if os.fspath(place).startswith(_PACKAGE) else place
    if os.path.isdir(path):
        inside = sorted(file.name for file in path.glob("*.qml"))
        hint = f"name a file in it: {', '.join(inside[:5])}" if inside else "it has no QML files"
        raise QmlError(f"{shown}: this is a folder; {hint}")
    if not os.path.isfile(path):
        raise QmlError(f"{shown}: there is no such file{near(path)}")
    if path.suffix == ".rviz":
        raise QmlError(f"{shown}: a config file of RViz, no QML file: rosglass rviz {shown}")
    if path.suffix != ".qml":
        raise QmlError(f"{shown}: not a QML file, whose name would end in .qml")
    return path


def near(path: Path) -> str:
    """Return a hint at a file with a similar name; empty if there is none."""
    with suppress(OSError, ValueError):  # a hint only
        return similar(path.name, (n for n in os.listdir(path.parent) if n.endswith(path.suffix)))
    return ""


def import_folder(place: str | os.PathLike[str]) -> Path:
    """Return the path of a folder with QML modules.

    Args:
        place: See :func:`locate`.

    Raises:
        QmlError: The folder does not exist.
    """
    path = locate(place)
    if not os.path.isdir(path):
        raise QmlError(f"{os.fspath(place)}: there is no such folder to import QML modules from")
    return path


#: Directories for the QML import path: modules for all Qt versions, and those for this version
#: only. The types also need :func:`register`.
IMPORT_PATHS = (
    *(Path(__file__).parents[1] / name for name in ("imports", "imports6" if QT6 else "imports5")),
    Path(__file__).parents[2] / "controls/imports",
    Path(__file__).parents[2] / "cockpit/imports",
)


def is_own_window(file: Path) -> bool:
    """Return whether a file is the window of ``rosglass view``.

    It uses neither ``Ros`` nor ``Ros2``, nor most types of ``RosScene``, whose import takes long.
    """
    return file.parent == _OWN


class _Replaced(NamedTuple):
    """A type of Qt's controls whose place a QML file of ours takes."""

    module: str
    name: str
    #: All versions but that which our file imports.
    versions: list[tuple[int, int]]
    #: Qt's plugin with the module, and the module to load it by.
    plugin: str
    loader: str


_REPLACED = (
    [
        _Replaced(
            "QtQuick.Controls.impl",
            "IconLabel",
            [(2, 4), (6, 0)],
            "QtQuick/Controls/impl/*qtquickcontrols2implplugin.*",
            "QtQuick.Controls.impl",
        ),
        _Replaced(
            "QtQuick.Templates",
            "ToolTip",
            [(2, 6), (6, 9)],
            "QtQuick/Templates/*qtquicktemplates2plugin.*",
            "QtQuick.Templates",
        ),
    ]
    if QT6
    else [
        _Replaced(
            "QtQuick.Controls.impl",
            "IconLabel",
            [(2, 4)],
            "QtQuick/Controls.2/*qtquickcontrols2plugin.*",
            "QtQuick.Controls",
        ),
        _Replaced(
            "QtQuick.Templates",
            "ToolTip",
            [(2, 6)],
            "QtQuick/Templates.2/*qtquicktemplates2plugin.*",
            "QtQuick.Templates",
        ),
    ]
)
#: QQmlPrivate::qmlregister(), mangled by the Itanium C++ ABI, and its arguments for a class and for
#: a QML file.
_REGISTER, _CLASS, _COMPOSITE = "_ZN11QQmlPrivate11qmlregisterENS_16RegistrationTypeEPv", 0, 4


class _CompositeType(ctypes.Structure):
    """QQmlPrivate::RegisterCompositeType of Qt 5."""

    _fields_: ClassVar = [
        ("url", ctypes.c_void_p),
        ("uri", ctypes.c_char_p),
        ("major", ctypes.c_int),
        ("minor", ctypes.c_int),
        ("name", ctypes.c_char_p),
    ]


class _ClassType(ctypes.Structure):
    """QQmlPrivate::RegisterType of Qt 5."""

    _fields_: ClassVar = [
        ("version", ctypes.c_int),
        ("type_id", ctypes.c_int),
        ("list_id", ctypes.c_int),
        ("size", ctypes.c_int),
        ("create", ctypes.c_void_p),
        ("no_creation_reason", ctypes.c_void_p),
        ("uri", ctypes.c_char_p),
        ("major", ctypes.c_int),
        ("minor", ctypes.c_int),
        ("name", ctypes.c_char_p),
        ("meta_object", ctypes.c_void_p),
        ("attached", ctypes.c_void_p),
        ("attached_meta_object", ctypes.c_void_p),
        ("parser_status", ctypes.c_int),
        ("value_source", ctypes.c_int),
        ("value_interceptor", ctypes.c_int),
        ("extension", ctypes.c_void_p),
        ("extension_meta_object", ctypes.c_void_p),
        ("custom_parser", ctypes.c_void_p),
        ("revision", ctypes.c_int),
    ]


#: Classes that PySide2 registers for us. It takes 50 at most, and no item beyond these, although it
#: does not count items.
_MOST_PYSIDE2 = 40
#: The classes that were registered, without items. Qt keeps addresses of those of ours.
_registered: list[Any] = []


def register_class(kind: type[QtCore.QObject], uri: str, name: str) -> None:
    """Register a class as version 1.0 of a QML type."""
    # PySide takes texts for names, which its hints do not say.
    register_type: Any = QtQml.qmlRegisterType
    if not QT6 and not issubclass(kind, QtQuick.QQuickItem) and len(_registered) >= _MOST_PYSIDE2:
        _register_further(kind, uri.encode(), name.encode())
    else:
        register_type(kind, uri, 1, 0, name)
        if not QT6:
            _registered.append(kind)
            _restore_lists()


def _register_further(kind: type[QtCore.QObject], uri: bytes, name: bytes) -> None:
    """Register a class with Qt 5 in the way in which PySide2 does it."""
    # Also finds the symbols of libpyside2, on which it depends.
    pyside: Any = ctypes.PyDLL(QtCore.__file__)
    next_address = pyside["_ZN6PySide24setNextQObjectMemoryAddrEPv"]
    next_address.argtypes, next_address.restype = [ctypes.c_void_p], None
    size = pyside["_ZN6PySide16getSizeOfQObjectEP13SbkObjectType"]
    size.argtypes = [ctypes.py_object]
    meta_object = pyside["_ZN6PySide18retrieveMetaObjectEP11_typeobject"]
    meta_object.argtypes, meta_object.restype = [ctypes.py_object], ctypes.c_void_p

    def make(memory: int) -> None:
        next_address(memory)
        try:
            # Never freed, like all objects of PySide2 that QML creates.
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(kind()))
        finally:
            next_address(None)

    create = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(make)
    _registered.append((create, uri, name, kind))
    function = ctypes.cast(create, ctypes.c_void_p)
    _register_object(meta_object(kind), size(kind), function, uri, name)
    _restore_lists()


def _restore_lists() -> None:
    """Let lists of objects take all of them again.

    PySide2 registers each class as if it were QObject, so that lists, such as the children of an
    item, take objects of the last one only; Qt Quick does the same as this when it is loaded.
    """
    plain: Any = QtCore.QObject
    _register_object(address(plain.staticMetaObject), 0, None, None, None)


def _register_object(
    meta_object: int, size: int, create: Any, uri: bytes | None, name: bytes | None
) -> None:
    """Call Qt's function for types with the metatype of QObject."""
    core = ctypes.CDLL("libQt5Core.so.5")
    type_id = core["_ZN9QMetaType4typeEPKc"]
    type_id.argtypes = [ctypes.c_char_p]
    no_reason = ctypes.addressof(ctypes.c_char.in_dll(core, "_ZN10QArrayData11shared_nullE"))
    ids = type_id(b"QObject*"), type_id(b"QQmlListProperty<QObject>")
    made = _ClassType(
        0, *ids, size, create, no_reason, uri, int(bool(uri)), 0, name, meta_object, None, None,
        -1, -1, -1,
    )  # fmt: skip
    call = ctypes.CDLL(_LIBRARY)[_REGISTER]
    call.argtypes = [ctypes.c_int, ctypes.c_void_p]
    if call(_CLASS, ctypes.byref(made)) < 0:
        raise UnsupportedError(f"Qt refuses the type {name!r} of the module {uri!r}")


@cache
def show_plain_labels() -> None:
    """Limit texts of controls to plain text and a length; only the first call has an effect.

    These are buttons, menu items, delegates and tool tips. Qt's IconLabel makes its text without a
    context, and crashes at the first image in it: one text of a robot would end the interface. A
    tool tip that is attached has no text format to choose, and takes seconds to wrap a long word.

    Of two types of one name, Qt takes the one that was registered last, so ours follow Qt's own.
    """
    folder = Path(_qml_folder())
    done = True
    handler = QtCore.qInstallMessageHandler(lambda *_: None)  # "it cannot be protected"
    try:
        for replaced in _REPLACED:
            plugin = next((p for p in folder.glob(replaced.plugin) if p.suffix in _LIBRARIES), None)
            if plugin is None:
                continue  # without controls
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", DeprecationWarning)
                engine: Any = QtQml.QQmlEngine()
                engine.importPlugin(str(plugin), replaced.loader, [])
            done &= all(_register_file(replaced, *version) for version in replaced.versions)
    except (OSError, AttributeError):
        done = False
    finally:
        QtCore.qInstallMessageHandler(handler)
    if not done:
        _log.warning(
            "controls were loaded before rosglass.qml.install(): a text with <img ...> in a Button "
            "or MenuItem ends the program; call install() before other QML is loaded"
        )


def _qml_folder() -> str:
    """Return the folder of Qt's QML modules."""
    info: Any = QtCore.QLibraryInfo
    if QT6:
        return str(info.path(info.LibraryPath.QmlImportsPath))
    return str(info.location(info.Qml2ImportsPath))


def _register_file(replaced: _Replaced, major: int, minor: int) -> bool:
    """Register our QML file in the place of a type of Qt's; return whether Qt accepts it."""
    file = Path(IMPORT_PATHS[1], f"Rosglass/Controls/{replaced.name}.qml")
    url = QtCore.QUrl.fromLocalFile(str(file))
    if QT6:
        register: Any = QtQml.qmlRegisterType
        return int(register(url, replaced.module, major, minor, replaced.name)) >= 0
    # PySide2 registers Python's classes only.
    call = ctypes.CDLL(_LIBRARY)[_REGISTER]
    call.restype, call.argtypes = ctypes.c_int, [ctypes.c_int, ctypes.c_void_p]
    pointer = ctypes.c_void_p.from_address(address(url)).value
    uri, name = replaced.module.encode(), replaced.name.encode()
    made = _CompositeType(pointer, uri, major, minor, name)
    return int(call(_COMPOSITE, ctypes.byref(made))) >= 0


@cache
def register() -> None:
    """Register the types with Qt; only the first call has an effect."""
    # Half of all that an interface loads, and rosglass view needs none of it.
    from rosglass.qml.elements import ros1, ros2  # noqa: PLC0415

    for uri, module in (("Ros", ros1), ("Ros2", ros2)):
        for name, native in module.NATIVE.items():
            register_class(native, f"{uri}.Native", name)
        for name, kind in module.TYPES.items():
            register_class(kind, uri, name)


def install(
    engine: QtQml.QQmlEngine, session: Session | None = None, *, own_window: bool = False
) -> Session:
    """Make ``import Ros 1.0`` and ``import Ros2 1.0`` work in an engine.

    Args:
        engine: The engine; it must not yet have loaded a file that imports the modules.
        session: The session to use; None for the application's own, which all such engines share.
        own_window: Whether it is for a window of rosglass, which does without these modules, and
            calls :func:`show_plain_labels` when it loads controls.

    Returns:
        The session.

    Raises:
        Error: The engine already has a session.
    """
    # Qt waits 5 ms before drawing, to collect further changes: a third of the time that an image
    # takes from the robot to the screen.
    os.environ.setdefault("QT_QPA_UPDATE_IDLE_TIME", "0")
    if not own_window:
        show_plain_labels()
        register()
    for path in IMPORT_PATHS:
        engine.addImportPath(str(path))
    if session is None:
        found = runtime_of(engine)
        assert found is not None
        return found.session
    if engine.findChild(Runtime) is not None:
        raise Error("this QML engine has a session already; install() it only once")
    Runtime(engine, session)
    return session
