"""The robot's description: a valid tree of links, with the frames that the robot sends."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import pytest

from rosglass.comm import Time
from rosglass.demo import telemetry
from rosglass.demo.equipment import Equipment, urdf
from rosglass.demo.simulation import RobotState

ROBOT = ET.fromstring(urdf())


def test_its_joints_make_one_tree_of_its_links() -> None:
    links = [link.get("name") for link in ROBOT.findall("link")]
    assert len(set(links)) == len(links)
    children = [joint.find("child").get("link") for joint in ROBOT.findall("joint")]  # type: ignore[union-attr]
    assert sorted([*children, "base_link"]) == sorted(links)  # type: ignore[type-var]
    for joint in ROBOT.findall("joint"):
        assert joint.find("parent").get("link") in links  # type: ignore[union-attr]
        if joint.get("type") == "revolute":
            assert joint.find("limit") is not None
            assert joint.find("axis") is not None


def test_every_part_is_seen_in_a_colour_that_exists() -> None:
    known = {material.get("name") for material in ROBOT.findall("material")}
    for link in ROBOT.findall("link"):
        shapes = link.findall("visual")
        assert shapes, link.get("name")
        assert {s.find("material").get("name") for s in shapes} <= known  # type: ignore[union-attr]
    for size in ROBOT.iter("box"):
        assert all(float(edge) > 0 for edge in size.get("size", "").split())


def test_robot_sends_a_frame_forevery_link_where_the_description_has_it() -> None:
    """RViz draws a link where tf says that it is, and none that tf does not know."""
    now, still = Time.now(), RobotState()
    sent = telemetry.static_frames(now)["transforms"] + Equipment.frames(now)
    sent += telemetry.moving_frames(still, now)["transforms"]
    places = {
        t["child_frame_id"]: tuple(t["transform"]["translation"].values())
        for t in sent
        if t["header"]["frame_id"] == "base_link"
    }
    for joint in ROBOT.findall("joint"):
        name, origin = joint.find("child").get("link"), joint.find("origin")  # type: ignore[union-attr]
        described = [float(v) for v in origin.get("xyz").split()]  # type: ignore[union-attr]
        assert places[name] == pytest.approx(described, abs=1e-5), name  # type: ignore[index]
