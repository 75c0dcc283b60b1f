"""The command line's outer manners; what each command does is tested where it lives."""

from __future__ import annotations

import json
import shlex
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import rosglass
from rosglass.cli import main
from rosglass.cli.arguments import COMMANDS
from rosglass.cli.messages import split_type
from rosglass.cli.network import interfaces, is_loopback, router_problem
from rosglass.cli.parser import EXAMPLES
from rosglass.cli.program import _split, build_parser, parse
from rosglass.extras import install_command

if TYPE_CHECKING:
    import argparse


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["--version"])
    assert capsys.readouterr().out == f"rosglass {rosglass.__version__}\n"


def test_help_lists_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["--help"])
    out = capsys.readouterr().out
    assert all(name in out and summary in out for name, (_, summary) in COMMANDS.items())


@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_has_help(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main([command, "--help"])
    assert f"usage: rosglass {command}" in capsys.readouterr().out


def actions_of(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    """Return the arguments of a parser; argparse has no public way to them."""
    return parser._actions


def subparsers_of(parser: argparse.ArgumentParser) -> dict[str, Any]:
    """Return the parsers of a parser's subcommands by name; none without any."""
    found = [one.choices for one in actions_of(parser) if isinstance(one.choices, dict)]
    return found[0] if found else {}


def test_each_subcommand_has_a_function_in_the_module_of_its_command() -> None:
    modules = {command: f"rosglass.cli.{command.replace('-', '_')}" for command in COMMANDS}
    done = run_python(
        "import importlib, json, os\nfrom importlib.util import find_spec\n"
        "if find_spec('PySide6') is None: os.environ['ROSGLASS_QT'] = 'pyside2'\n"
        f"print(json.dumps({{command: importlib.import_module(name).__all__"
        f" for command, name in {modules!r}.items()}}))",
        stdout=subprocess.PIPE,
    )
    functions = json.loads(done.stdout)
    for command in COMMANDS:
        parser = subparsers_of(build_parser(command))[command]
        parsers = list(subparsers_of(parser).values()) or [parser]
        handlers = {parser.get_default("handler") for parser in parsers}
        assert handlers <= set(functions[command]), command


def test_help_and_options_load_no_more_than_the_parser(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROS_MASTER_URI", raising=False)
    code = (
        "import sys\n"
        "from rosglass.cli.program import build_parser\n"
        "build_parser('*')\n"
        "print(sorted(name for name in sys.modules if name.startswith('rosglass.')), end='')"
    )
    done = run_python(code, stdout=subprocess.PIPE)
    loaded = ["arguments", "output", "parser", "program"]
    assert done.stdout == str(
        [
            "rosglass.cli",
            *(f"rosglass.cli.{name}" for name in loaded),
            "rosglass.errors",
            "rosglass.interrupts",
        ]
    )


def leaves() -> dict[str, argparse.ArgumentParser]:
    """Return the parsers of all commands that have no subcommands."""
    found = {}
    for name, parser in subparsers_of(build_parser("*")).items():
        inner = subparsers_of(parser)
        found |= {f"{name} {what}": sub for what, sub in inner.items()} or {name: parser}
    return found


#: Commands whose arguments need no explanation: their values are listed.
PLAIN = {"completion"}


@pytest.mark.parametrize("command", sorted(leaves()))
def test_every_argument_is_described_and_every_command_has_an_example(command: str) -> None:
    parser = leaves()[command]
    for action in actions_of(parser):
        assert action.help, f"rosglass {command}: {action.dest}"
    if command in PLAIN:
        return
    examples = EXAMPLES[parser.prog.removeprefix("rosglass ")]
    shown = parser.format_help().partition("\nexample")[2]
    for example in examples:
        line = f"{parser.prog} {example}".rstrip()
        assert f"  {line}\n" in shown
        parse(shlex.split(line)[1:])


def test_no_example_is_left_over() -> None:
    assert EXAMPLES.keys() <= {
        parser.prog.removeprefix("rosglass ") for parser in leaves().values()
    }


@pytest.mark.parametrize("arguments", [[], ["fly"], ["robot", "--no-such-option"]])
def test_wrong_usage_exits_with_2(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(arguments)
    assert "usage: rosglass" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("line", "usage", "unrecognized"),
    [
        ("rviz --overly x", "rosglass rviz", "--overly; did you mean --overlay?"),
        ("run a.qml --wach=yes", "rosglass run", "--wach=yes; did you mean --watch?"),
        ("topic echo /x --fields y", "rosglass topic echo", "--fields y; did you mean --field?"),
        ("topic --zzz list", "rosglass topic", "--zzz\n"),
        ("--zzz topic list", "rosglass", "--zzz\n"),
        ("robot red", "rosglass robot", "red\n"),
    ],
)
def test_misspelt_options_are_explained_by_their_command(
    line: str, usage: str, unrecognized: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(line.split())
    said = capsys.readouterr().err
    assert said.startswith(f"usage: {usage} ")
    assert f"{usage}: error: unrecognized arguments: {unrecognized}" in said


def test_missing_extra_names_the_fix(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_module(name: str) -> object:
        raise ModuleNotFoundError(f"No module named {name!r}", name="zenoh")

    monkeypatch.setattr("rosglass.cli.program.import_module", no_module)
    assert main(["router"]) == 1
    assert install_command("zenoh") in capsys.readouterr().err


@pytest.mark.parametrize(
    ("line", "ours", "ros_args", "rest"),
    [
        ("run a.qml", "run a.qml", "", ""),
        ("run a.qml -- -x --ros-args", "run a.qml", "", "-x --ros-args"),
        ("run a.qml --ros-args -r a:=b", "run a.qml", "--ros-args -r a:=b", ""),
        ("run --ros-args -r a:=b -- a.qml -- x", "run a.qml", "--ros-args -r a:=b --", "x"),
        ("x --ros-args -- --ros-args -p b:=1", "x", "--ros-args -- --ros-args -p b:=1", ""),
    ],
)
def test_ros_args_and_the_arguments_of_others_are_set_apart(
    line: str, ours: str, ros_args: str, rest: str
) -> None:
    assert _split(line.split()) == (ours.split(), ros_args.split(), rest.split())


def test_bad_ros_args_are_reported(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["robot", "--url", "zenoh://127.0.0.1:9", "--ros-args", "-r", "a"]) == 1
    assert "rosglass: --ros-args, argument 3: 'a' has no ':='" in capsys.readouterr().err


def test_commands_without_a_node_take_no_ros_args(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as exit_info:
        main(["router", "--ros-args", "-r", "a:=b"])
    assert exit_info.value.code == 2
    assert "router takes no --ros-args" in capsys.readouterr().err


@pytest.mark.parametrize(
    "line",
    [
        "topic pub --once -r 5 /x std_msgs/msg/Bool yes",
        "topic pub /x --once std_msgs/msg/Bool -r 5 yes",
        "topic pub /x std_msgs/msg/Bool yes -1 --rate 5",
    ],
)
def test_options_stand_anywhere(line: str) -> None:
    args = build_parser("topic").parse_args(line.split())
    assert (args.topic, args.rest) == ("/x", ["std_msgs/msg/Bool", "yes"])
    assert (args.count, args.rate) == (1, 5.0)


@pytest.mark.parametrize("line", ["-v topic -v list", "topic list -vv", "-vv topic list"])
def test_verbose_stands_anywhere(line: str) -> None:
    assert build_parser("topic").parse_args(line.split()).verbose >= 1


def test_negative_values_are_values() -> None:
    args = build_parser("param").parse_args(["param", "set", "/arm", "x", "-5"])
    assert args.value == "-5"


def test_graph_in_this_process(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["topic", "list", "--url", "local://cli"]) == 0
    assert "there are no topics" in capsys.readouterr().err
    assert main(["node", "info", "/arm", "--url", "local://cli"]) == 1
    assert "there is no node /arm" in capsys.readouterr().err


def test_bags_as_in_ros2(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["bag", "info", str(tmp_path / "none.mcap")]) == 1
    assert "none.mcap does not exist" in capsys.readouterr().err


def test_unquoted_values_are_not_taken_for_types() -> None:
    with pytest.raises(rosglass.Error, match="one pair of quotes: 'a: 1'"):
        split_type(["a:", "1"])


def run_python(code: str, **options: int) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code],
        stderr=subprocess.PIPE, text=True, timeout=60, check=False, **options,
    )  # fmt: skip


def test_output_that_cannot_be_written_is_said() -> None:
    code = "import sys; from rosglass.cli import main; sys.exit(main(['interface', 'list']))"
    with Path("/dev/full").open("wb") as full:
        done = run_python(code, stdout=full.fileno())
    assert done.returncode == 1
    assert done.stderr == "rosglass: No space left on device\n"
    python = sys.executable
    done = run_python(f"import os; os.close(1); os.execv({python!r}, [{python!r}, '-c', {code!r}])")
    assert (done.returncode, done.stderr) == (0, "")


def test_ctrl_c_while_modules_are_loaded_leaves_no_traceback() -> None:
    done = run_python(
        "import sys, signal\n"
        # The test run may ignore it, if it was started in the background.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "class Finder:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'rosglass.cli.program': signal.raise_signal(signal.SIGINT)\n"
        "sys.meta_path.insert(0, Finder())\n"
        "from rosglass.cli import main\n"
        "sys.exit(main(['--help']))",
        stdout=subprocess.DEVNULL,
    )
    assert (done.returncode, done.stderr) == (130, "")


def test_ctrl_c_again_cuts_short_what_ends() -> None:
    done = run_python(
        "import signal, sys\n"
        "from rosglass.cli.connecting import End\n"
        "end = End()\n"
        "signal.raise_signal(signal.SIGTERM)\n"
        "assert end.is_set() and end.code == 143\n"
        "try: signal.raise_signal(signal.SIGINT)\n"
        "except KeyboardInterrupt: sys.exit(7)\n",
        stdout=subprocess.DEVNULL,
    )
    assert (done.returncode, done.stderr) == (7, "")


def test_knocking_at_a_router(monkeypatch: pytest.MonkeyPatch) -> None:
    assert router_problem("zenoh://127.0.0.1:1", 1.0)[0] == (
        "127.0.0.1 is there, but nothing listens on its port 1"
    )

    def fails(error: OSError) -> tuple[str, str]:
        def connect(*_: object) -> object:
            raise error

        monkeypatch.setattr("rosglass.cli.network.socket.create_connection", connect)
        return router_problem("zenoh://robot", 1.0)

    assert "rosglass router --open" in fails(ConnectionRefusedError())[1]
    assert "firewall pass TCP port 7447" in fails(TimeoutError())[1]
    assert "Network is unreachable" in fails(OSError(101, "Network is unreachable"))[0]
    assert is_loopback("zenoh://?domain=1")
    assert not is_loopback("zenoh://10.0.0.1")


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux lists them")
def test_interfaces() -> None:
    found = interfaces()
    assert found is not None
    assert [one.name for one in found if one.is_loopback] in ([], ["lo"])


def test_ctrl_c_during_an_import_that_converts_it() -> None:
    done = run_python(
        "import sys\n"
        "from rosglass.cli import main, program\n"
        "def imports(_):\n"
        "    try: raise KeyboardInterrupt\n"
        "    except KeyboardInterrupt as error: raise ImportError('numpy failed') from error\n"
        "program._run = imports\n"
        "sys.exit(main(['topic']))\n",
        stdout=subprocess.DEVNULL,
    )
    assert (done.returncode, done.stderr) == (130, "")


def test_definitions_from_a_folder(tmp_path: Path) -> None:
    package = tmp_path / "my_msgs"
    (package / "msg").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>my_msgs</name></package>")
    (package / "msg" / "State.msg").write_text("uint8 state\n")
    command = "import sys; from rosglass.cli import main; sys.exit(main(sys.argv[1:]))"

    def show(*options: str) -> subprocess.CompletedProcess[str]:
        arguments = [sys.executable, "-c", command, "interface", *options]
        return subprocess.run(arguments, capture_output=True, text=True, check=False)

    listed = show("list", "my_msgs", "--definitions", str(tmp_path))
    assert (listed.returncode, listed.stdout) == (0, "my_msgs/msg/State\n")
    assert show("list", "my_msgs").returncode == 1
    wrong = show("list", "--definitions", str(tmp_path / "none"))
    assert (wrong.returncode, "is not a folder" in wrong.stderr) == (1, True)


@pytest.mark.parametrize(
    ("said", "url"),
    [
        ({}, "zenoh://127.0.0.1:7447"),
        ({"ROS_MASTER_URI": "http://robot:5"}, "ros1://robot:5"),
        ({"ROS_MASTER_URI": "http://robot:5", "ROS_DISTRO": "humble"}, "zenoh://127.0.0.1:7447"),
        ({"ROS_MASTER_URI": "http://robot:5", "ROSGLASS_URL": "dds://"}, "dds://"),
        ({"ROS_MASTER_URI": "robot"}, "ros1://"),
    ],
)
def test_url_of_the_simulated_robot_follows_the_environment(
    said: dict[str, str], url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("ROSGLASS_URL", "ROS_DISTRO", "ROS_DOMAIN_ID", "ROS_MASTER_URI"):
        monkeypatch.delenv(name, raising=False)
    for name in ("RMW_IMPLEMENTATION", "ZENOH_SESSION_CONFIG_URI", "CYCLONEDDS_URI"):
        monkeypatch.delenv(name, raising=False)
    for name, value in said.items():
        monkeypatch.setenv(name, value)
    assert build_parser("robot").parse_args(["robot"]).url == url


@pytest.mark.parametrize(
    ("size", "seconds", "level"),
    [(4 * 2**20, 30, "note"), (4 * 2**20, 3, "ok"), (128 * 2**20, 30, "ok")],
)
def test_doctor_looks_at_the_memory_for_ip_fragments(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    size: int,
    seconds: int,
    level: str,
) -> None:
    """Lost packets fill it, and large messages over DDS stay away until it is empty."""
    kernel = {"ipfrag_high_thresh": size, "ipfrag_time": seconds}
    read = Path.read_text

    def read_text(path: Path, *args: Any, **options: Any) -> str:
        return f"{kernel[path.name]}\n" if path.name in kernel else read(path, *args, **options)

    monkeypatch.setattr(Path, "read_text", read_text)
    main(["doctor", "--json", "--url", "local://doctor"])
    found = json.loads(capsys.readouterr().out)
    (finding,) = [one for one in found if "IP fragments" in one["text"]]
    assert finding["level"] == level
    assert ("sysctl" in finding["fix"]) == (level == "note")
