"""YAML whose aliases, merges, depth or numbers stand for more than a text of its size should."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from pathlib import Path

import pytest
import yaml

import rosglass
from rosglass.comm.text_files import load_yaml


def aliases(template):
    """Return 24 levels, each of nine times the one below."""
    levels = [template.format(0, "x: 1", "x")]
    for level in range(1, 24):
        below = ", ".join([f"*a{level - 1}"] * 9)
        levels.append(template.format(level, f"<<: [{below}]", below))
    return "\n".join(levels)


BOMBS = {
    "aliases": aliases("a{0}: &a{0} [{2}]"),
    "merges": aliases("a{0}: &a{0} {{{1}}}"),
    "quadratic": f"a: &a [{'1, ' * 20_000}]\nb: [{'*a, ' * 2_000}]",
    "deep flow": "[" * 200_000,
    "deep block": "- " * 200_000,
    "deep keys": "? " * 200_000,
    "itself": "a: &a [*a]",
    "a long number": "a: " + "9" * 1_000_000,
    "base 60": "a: " + "1:" * 20_000 + "1",
    "no date": "a: 2001-99-99",
    "an empty number": "a: !!int ''",
    "no flag": "a: !!bool maybe",
    "no time": "a: !!timestamp soon",
    "the time of a mapping": "a: !!timestamp {=: 1}",
    "too large a float": "a: !!float " + "1:" * 400 + "1.0",
    "unhashable": "{[1]: 1, {a: 1}: 2}",
    "an unknown tag": "!!python/object/apply:os.system ['true']",
}


def readers(folder):
    """Return what reads YAML that others have written: parameter files, values, recordings."""
    from rosglass.bags.bag import read_profiles
    from rosglass.cli.messages import parse_fields
    from rosglass.ros1 import rosparam_files as ros1
    from rosglass.ros2 import parameter_files as ros2

    file = Path(folder, "bomb.yaml")
    string = rosglass.load("std_msgs/msg/String")

    def bag(text):
        Path(folder, "metadata.yaml").write_text(text)
        rosglass.bags.open_bag(folder)

    def profiles_of_a_bag(text):
        known = {"name": "/a", "offered_qos_profiles": text}
        bag(yaml.safe_dump({"rosbag2_bagfile_information": {"topics": [known]}}))

    def from_file(read):
        def run(text):
            file.write_text(text)
            read(file)

        return run

    return {
        "ROS 1 file": from_file(ros1.read),
        "ROS 1 value": lambda text: ros1.parse_value(text, "_a:=..."),
        "ROS 2 file": from_file(ros2.read),
        "ROS 2 value": lambda text: ros2.parse_value(text, "-p a:=..."),
        "command line": lambda text: string.create(parse_fields(text, "std_msgs/msg/String")),
        "profiles": read_profiles,
        "bag": bag,
        "profiles of a bag": profiles_of_a_bag,
    }


def test_no_yaml_takes_time_or_memory_out_of_proportion(tmp_path):
    done = subprocess.run(
        [sys.executable, __file__, str(tmp_path)], capture_output=True, text=True, timeout=300,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    found = json.loads(done.stdout)
    assert len(found) == 8 * len(BOMBS)
    assert [one for one in found if one[2] not in ("read", "refused")] == []
    assert [one for one in found if one[3] > 10.0] == [], "seconds of CPU"


def test_ordinary_yaml_is_read():
    text = "base: &base {x: 1, y: 2}\narm: {<<: *base, y: 3}\nlist: [*base, *base]\n---\n- 1"
    arm = {"x": 1, "y": 3}
    base = {"x": 1, "y": 2}
    assert load_yaml(text) == [{"base": base, "arm": arm, "list": [base, base]}, [1]]
    assert load_yaml("") == []
    assert len(load_yaml(f"[{'1, ' * 100_000}]")[0]) == 100_000
    assert len(load_yaml(f"a: &a [{'1, ' * 1000}]\nb: [{'*a, ' * 900}]")[0]["b"]) == 900
    with pytest.raises(yaml.YAMLError, match="more than 1000000 values"):
        load_yaml(f"a: &a [{'1, ' * 1000}]\nb: [{'*a, ' * 1001}]")


def main(folder):
    resource.setrlimit(resource.RLIMIT_AS, (2 * 2**30, 2 * 2**30))
    found = []
    for reader, read in readers(folder).items():
        for bomb, text in BOMBS.items():
            began = time.process_time()
            try:
                read(text)
                result = "read"
            except rosglass.Error:
                result = "refused"
            except BaseException as error:  # what the test is about
                result = repr(error)[:200]
            found.append((reader, bomb, result, time.process_time() - began))
    print(json.dumps(found))


if __name__ == "__main__":
    main(sys.argv[1])
