"""Messages as bytes: the same as genpy's, for every type in Debian's packages."""

from __future__ import annotations

import base64
import json
import subprocess
from pathlib import Path

import pytest

import rosglass
from rosglass.errors import Error

from .conftest import INSTALL, PEERS, PYTHON


@pytest.fixture(scope="module")
def installed():
    if not Path("/usr/lib/python3/dist-packages/genpy").is_dir():
        pytest.skip(INSTALL)
    command = [PYTHON, str(PEERS / "genpy_types.py"), "2026"]
    env = {"PATH": "/usr/bin:/bin", "LANG": "C.UTF-8"}
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert lines.pop() == {"end": True}
    return lines


def test_every_installed_type_has_the_same_sum_and_the_same_bytes(installed):
    wrong = []
    for line in installed:
        name, text, md5 = (line["type"][key] for key in ("type", "text", "md5"))
        try:
            kind = rosglass.MessageType.from_text(name, text, ros=1)
            if kind.md5 != md5:
                wrong.append(f"{name}: md5 {kind.md5}, not {md5}")
            for sample in line["samples"]:
                data = base64.b64decode(sample["data"])
                if kind.encode(sample["value"], wire="ros1") != data:
                    wrong.append(f"{name}: other bytes for {str(sample['value'])[:300]}")
                decoded = kind.decode(data, wire="ros1").to_dict()
                if kind.encode(decoded, wire="ros1") != data:
                    wrong.append(f"{name}: other bytes after decoding")
        except Error as error:
            wrong.append(f"{name}: {error}")
    assert wrong == []
    names = {line["type"]["type"] for line in installed}
    assert len(names) > 150
    assert {"sensor_msgs/PointCloud2", "nav_msgs/GetMapResponse", "tf2_msgs/TFMessage"} <= names


def test_bundled_types_equal_installed_ones(installed):
    """The MD5 sum of each bundled type is that of Debian's package."""
    different, known = [], 0
    for line in installed:
        name = line["type"]["type"]
        try:
            kind = rosglass.load(name, ros=1)
        except Error:
            continue
        known += 1
        if kind.md5 != line["type"]["md5"]:
            different.append(name)
    assert different == []
    assert known > 120
