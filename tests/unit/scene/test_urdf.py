"""Robot descriptions: what is read, what is refused, and what is left out with a warning."""

from __future__ import annotations

import math
import re
import tracemalloc

import numpy as np
import pytest

from rosglass.errors import ArgumentError
from rosglass.scene.data.urdf import (
    Box,
    Capsule,
    Cylinder,
    JointLimits,
    Material,
    MeshFile,
    Mimic,
    Robot,
    Sphere,
    UrdfError,
    parse_urdf,
)

ARM = """<?xml version="1.0"?>
<robot name="arm" xmlns:xacro="http://ros.org/wiki/xacro">
  <material name="blue"><color rgba="0 0 1 0.5"/></material>
  <material name="wood"><texture filename="package://arm/wood.png"/></material>
  <link name="base">
    <inertial><mass value="1"/></inertial>
    <visual name="plate">
      <origin xyz="1 2 3" rpy="0.1 0.2 0.3"/>
      <geometry><box size="1 2 3"/></geometry>
      <material name="blue"/>
    </visual>
    <visual><geometry><sphere radius="0.5"/></geometry></visual>
    <collision><geometry><cylinder radius="0.1" length="2"/></geometry></collision>
  </link>
  <link name="upper">
    <visual>
      <geometry><mesh filename="package://arm/upper.dae" scale="1 -1 0.001"/></geometry>
      <material name="green"><color rgba="0 1 0 1"/></material>
    </visual>
    <collision><geometry><capsule radius="0.1" length="2"/></geometry></collision>
  </link>
  <link name="hand">
    <visual><geometry><mesh filename="hand.stl"/></geometry><material name="green"/></visual>
    <visual><geometry><box size="0 0 0"/></geometry><material name="wood"/></visual>
  </link>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/>
    <origin xyz="0 0 1" rpy="0 0 1.5707963267948966"/>
    <axis xyz="0 0 2"/>
    <limit lower="-1" upper="1.5" effort="30" velocity="2"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="upper"/><child link="hand"/>
    <axis xyz="0 1 0"/>
    <limit effort="1" velocity="1" upper="0.1"/>
    <mimic joint="shoulder" multiplier="-2" offset="0.5"/>
  </joint>
</robot>
"""


BLUE = '<material name="blue"><color rgba="0 0 1 1"/></material>'
NO_BLUE = '<material name="blu"/>'
NO_COLOR = '<material><color rgba="1 0"/></material>'
BALL = '<sphere radius="1"/>'


def robot(body: str, name: str = "r") -> Robot:
    return parse_urdf(f'<robot name="{name}">\n{body}\n</robot>', "test.urdf")


def joint(parent: str, child: str, more: str = "", name: str = "", type: str = "fixed") -> str:
    return (
        f'<joint name="{name or child}_joint" type="{type}"><parent link="{parent}"/>'
        f'<child link="{child}"/>{more}</joint>'
    )


def links(*names: str) -> str:
    return "".join(f'<link name="{name}"/>' for name in names)


def visual(geometry: str, more: str = "") -> str:
    return f"<visual><geometry>{geometry}</geometry>{more}</visual>"


def test_links_geometry_and_materials() -> None:
    arm = parse_urdf(ARM)
    assert (arm.name, arm.root, list(arm.links), arm.warnings) == (
        "arm",
        "base",
        ["base", "upper", "hand"],
        (),
    )
    blue = Material("blue", (0, 0, 1, 0.5))
    plate, ball = arm.links["base"].visuals
    assert (plate.name, plate.geometry, plate.material) == ("plate", Box((1, 2, 3)), blue)
    # As in RViz, what has no material gets the last one of the link.
    assert (ball.geometry, ball.material) == (Sphere(0.5), blue)
    (collision,) = arm.links["base"].collisions
    assert (collision.geometry, collision.material) == (Cylinder(0.1, 2), blue)
    (upper,) = arm.links["upper"].visuals
    assert upper.geometry == MeshFile("package://arm/upper.dae", (1, -1, 0.001))
    assert arm.links["upper"].collisions[0].geometry == Capsule(0.1, 2)
    hand, wood = arm.links["hand"].visuals
    # Materials that a visual defines have their names in the whole robot.
    assert hand.material == upper.material == Material("green", (0, 1, 0, 1))
    assert wood.material == Material("wood", texture="package://arm/wood.png")


def test_origins_turn_about_fixed_axes_roll_first() -> None:
    origin = parse_urdf(ARM).links["base"].visuals[0].origin
    assert origin[:3, 3].tolist() == [1, 2, 3]
    # Of tf's quaternion_from_euler(0.1, 0.2, 0.3), as a matrix.
    expected = [
        [0.93629336, -0.27509585, 0.21835066],
        [0.28962948, 0.95642509, -0.03695701],
        [-0.19866933, 0.09784340, 0.97517033],
    ]
    assert np.allclose(origin[:3, :3], expected)
    quaternion = '<origin quat_xyzw="0 0 2 2"/>'
    turned = robot(f'<link name="a">{visual(BALL, quaternion)}</link>')
    assert np.allclose(turned.links["a"].visuals[0].origin[:3, 0], [0, 1, 0])


def test_joints() -> None:
    arm = parse_urdf(ARM.encode("utf-16"))
    shoulder, slide = arm.joints.values()
    assert (shoulder.type, shoulder.parent, shoulder.child) == ("revolute", "base", "upper")
    assert shoulder.axis == (0, 0, 1)
    assert shoulder.limits == JointLimits(-1, 1.5, 30, 2)
    assert (shoulder.mimic, slide.mimic) == (None, Mimic("shoulder", -2, 0.5))
    assert slide.limits == JointLimits(0, 0.1, 1, 1)
    assert arm.tree == (shoulder, slide)


def test_poses_follow_joints_and_mimics() -> None:
    arm = parse_urdf(ARM)
    at_zero = arm.poses()
    assert np.allclose(at_zero["base"], np.eye(4))
    assert np.allclose(at_zero["upper"][:3, 3], [0, 0, 1])
    assert np.allclose(at_zero["upper"][:3, 0], [0, 1, 0])
    assert np.allclose(at_zero["hand"][:3, 3], [-0.5, 0, 1])
    turned = arm.poses({"shoulder": math.pi / 2, "slide": 99, "of another robot": 1})
    assert np.allclose(turned["upper"][:3, 0], [-1, 0, 0])
    # 0.5 - 2 * 90 degrees along the y axis of the upper arm, which points along -y by now.
    assert np.allclose(turned["hand"][:3, 3], [0, math.pi - 0.5, 1])
    assert np.allclose(arm.joints["slide"].motion(2)[:3, 3], [0, 2, 0])
    for value in (math.nan, math.inf, "x", None):
        with pytest.raises(ArgumentError, match="position of joint shoulder: expected a finite"):
            arm.poses({"shoulder": value})  # type: ignore[dict-item]


def test_joints_that_are_not_one_number_stay_at_their_origin() -> None:
    found = robot(links("a", "b") + joint("a", "b", '<origin xyz="1 0 0"/>', type="floating"))
    assert found.poses({"b_joint": 5})["b"][:3, 3].tolist() == [1, 0, 0]


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("", r"test.urdf:1: the robot has no <link>"),
        ("<link/>", r"test.urdf:2: a <link> has no name"),
        (links("a", "a"), r"test.urdf:2: there are two links named 'a', the first in line 2"),
        (links("a", "b"), r"test.urdf:2: the robot has 2 root links: a, b; every link but one"),
        (links("a", "b") + joint("a", "c"), r"joint 'c_joint': there is no child link 'c'"),
        (
            links("base_link", "b") + joint("baselink", "b"),
            r"there is no parent link 'baselink'; did you mean base_link\?",
        ),
        (links("a", "b") + joint("a", "b") * 2, r"there are two joints named 'b_joint'"),
        (
            links("a", "b", "c") + joint("a", "b") + joint("c", "b", name="other"),
            r"link 'b' is the child of two joints, 'b_joint' and 'other_joint'",
        ),
        (links("a", "b") + joint("a", "b") + joint("b", "a"), r"form a loop: a <- b <- a"),
        (links("a") + joint("a", "a"), r"form a loop: a <- a; remove one"),
        (
            links("a", "b", "c") + joint("b", "c") + joint("c", "b"),
            r"test.urdf:2: the joints form a loop: (b <- c <- b|c <- b <- c);",
        ),
        (links("a", "b") + joint("a", "b", type="hinge"), r"expected type .*, got 'hinge'"),
        (
            links("a", "b") + '\n<joint name="j" type="fixed"><parent link="a"/></joint>',
            r"test.urdf:3: joint 'j' has no <child link=...>",
        ),
        (
            links("a", "b") + joint("a", "b", '<origin xyz="0 nan 0"/>'),
            r"joint 'b_joint': xyz of <origin>: expected 3 finite numbers, got '0 nan 0'",
        ),
        (
            links("a", "b") + joint("a", "b", '<axis xyz="0 1"/>', type="continuous"),
            r"joint 'b_joint': xyz of <axis>: expected 3 finite numbers, got '0 1'",
        ),
        (
            links("a", "b") + "\n<xacro:joint/>",
            r"test.urdf:.: .*; <xacro:joint> in line 3 is xacro: expand the file first",
        ),
    ],
)
def test_invalid_robot_is_rejected(body: str, message: str) -> None:
    with pytest.raises(UrdfError, match=message):
        robot(body)


def test_xacro_elements_are_left_out_with_a_warning() -> None:
    found = robot(
        '<xacro:property name="r" value="1"/>\n<xacro:include/><xacro:include/>' + links("a")
    )
    assert list(found.links) == ["a"]
    (warning,) = found.warnings
    assert warning == (
        "test.urdf:2: <xacro:property>, <xacro:include> is xacro, not URDF, and is left out; "
        "expand the file first: xacro FILE.xacro > FILE.urdf"
    )


@pytest.mark.parametrize(
    "text",
    [
        "\n<?xml version='1.0'?><robot name='r'><link name='a'/></robot>",
        "<!-- a --><?xml version='1.0'?><robot name='r'><link name='a'/></robot>",
        b"\xef\xbb\xbf\n<?xml version='1.0'?><robot name='r'><link name='a'/></robot>",
        b"<robot name='r'><!-- M\xfcller -- and Co --><link name='a'/></robot>",
        "<robot name='r'><!-- a -- b --><link name='a'/></robot>",
        "<robot name='r'><link name='a'/></robot>\0\0",
    ],
)
def test_xml_that_urdfdom_reads_as_well(text: str | bytes) -> None:
    found = parse_urdf(text, "source")
    assert list(found.links) == ["a"]
    (warning,) = found.warnings
    assert "the text is not well-formed XML" in warning


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "source: the text is empty"),
        (" \n", "source: the text is empty"),
        ("<robot>", r"source:1: the text is not well-formed XML: no element found"),
        ("<robot>\n</link>", r"source:2: the text is not well-formed XML: mismatched tag"),
        ("<sdf version='1.6'/>", r"source:1: this is SDF"),
        ("<html/>", r"source:1: expected <robot name=...>, got <html>"),
        (
            "\n\n<robot xmlns:xacro='x'>\n<xacro:include/></robot>",
            r"source:3: .* line 4 is xacro: expand",
        ),
        ('<!DOCTYPE robot SYSTEM "file:///etc/passwd"><robot/>', r"source:1: a document type"),
        (b"<?xml version='1.0' encoding='klingon'?><robot/>", r"can't be decoded|unknown encoding"),
        (b"<robot name='\xff'><", r"source:1: the text is not well-formed XML"),
        ("<robot name='\ud800'/>", r"can't be decoded"),
        ("<robot>" + "<a>" * 5000, r"source:1: <a> is inside more than 200 other elements"),
        ("<robot name='r'>" + "x" * (21 << 20) + "</robot>", r"bytes of XML; the limit is"),
        ("<robot>" + "<a/>" * 1_000_001 + "</robot>", r"more than 1000000 elements"),
        ("<robot>" + "<link name='a'/>" * 10_001 + "</robot>", r"10001 links; the limit is 10000"),
    ],
    ids=range(15),
)
def test_malformed_urdf_is_rejected(text: str | bytes, message: str) -> None:
    with pytest.raises(UrdfError, match=message):
        parse_urdf(text, "source")


def test_entities_are_never_expanded() -> None:
    levels = "".join(f'<!ENTITY e{level} "{f"&e{level - 1};" * 10}">\n' for level in range(1, 10))
    bomb = f'<!DOCTYPE r [<!ENTITY e0 "{"x" * 100}">\n{levels}]>\n<robot name="&e9;"/>'
    tracemalloc.start()
    with pytest.raises(UrdfError, match="document type"):
        parse_urdf(bomb)
    assert tracemalloc.get_traced_memory()[1] < 5_000_000
    tracemalloc.stop()
    with pytest.raises(ArgumentError, match="robot_description: expected the text of a URDF"):
        parse_urdf(None)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("broken", "message"),
    [
        ("<visual/>", r"test.urdf:2: visual of link 'a': it has no <geometry>; it is not drawn"),
        (visual(""), "<geometry> is empty"),
        (visual("<torus/>"), r"unknown geometry <torus>; expected <box>"),
        (visual('<box size="1 2"/>'), r"size of <box>: expected 3 finite numbers, got '1 2'"),
        (visual('<box size="1 -2 1"/>'), r"size of <box> is negative"),
        (visual('<sphere radius="-1"/>'), r"radius of <sphere> is negative: -1"),
        (visual('<sphere radius="inf"/>'), r"expected a finite number, got 'inf'"),
        (visual('<cylinder radius="1"/>'), r"<cylinder> has no length"),
        (visual("<mesh/>"), r"<mesh> has no filename"),
        (visual('<mesh filename="a" scale="2"/>'), r"scale of <mesh>: expected 3"),
        (visual('<sphere radius="${r}"/>'), r"an expression of xacro: expand the file first"),
        (visual('<sphere radius="1"/>', '<origin rpy="a b c"/>'), r"rpy of <origin>: expected"),
        (visual('<sphere radius="1"/>', '<origin quat_xyzw="0 0 0 0"/>'), "quat_xyzw .* zero"),
    ],
)
def test_broken_visual_is_left_out(broken: str, message: str) -> None:
    good = visual('<sphere radius="2"/>')
    found = robot(f'<link name="a">{good}{broken}{good}</link>')
    assert len(found.links["a"].visuals) == 2
    (warning,) = found.warnings
    assert re.search(message, warning), warning


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (
            links("a") + '<material name="m"/>',
            r"test.urdf:2: material 'm' has no colour or texture",
        ),
        (
            links("a")
            + "".join(f'<material name="m"><color rgba="{i} 0 0 1"/></material>' for i in (0, 1)),
            r"material 'm' is defined twice; the first one is used",
        ),
        (
            f'<link name="a">{visual(BALL, NO_BLUE)}</link>' + BLUE,
            r"visual of link 'a': material 'blu' is not defined; did you mean blue\?",
        ),
        (
            f'<link name="a">{visual(BALL, NO_COLOR)}</link>',
            r"rgba of <color>: expected 4 finite numbers, got '1 0'; the default colour is used",
        ),
        (
            links("a") + '<material name="m"><color rgba="255 0 0 1"/></material>',
            r"rgba is not from 0 to 1 and is cut off: 255 0 0 1",
        ),
        (
            links("a", "b") + joint("a", "b", type="revolute"),
            r"joint 'b_joint' is revolute and has no <limit>",
        ),
        (
            links("a", "b") + joint("a", "b", '<limit effort="x"/>', type="prismatic"),
            r"joint 'b_joint': effort of <limit>.*; its limits are ignored",
        ),
        (
            links("a", "b") + joint("a", "b", '<axis xyz="0 0 0"/>', type="continuous"),
            r"<axis> is zero; the joint does not move",
        ),
        (
            links("a", "b") + joint("a", "b", '<mimic joint="c_joint"/>', type="continuous"),
            r"joint 'b_joint' mimics 'c_joint', which does not exist",
        ),
        (
            links("a", "b") + joint("a", "b", '<mimic joint="b_joint"/>', type="continuous"),
            r"joint 'b_joint' mimics itself",
        ),
    ],
)
def test_warnings(body: str, message: str) -> None:
    found = robot(body)
    (warning,) = found.warnings
    assert re.search(message, warning), warning
    assert set(found.poses({"b_joint": 1.0})) == set(found.links)


def test_fixed_joint_needs_no_axis() -> None:
    found = robot(links("a", "b") + joint("a", "b", '<axis xyz="0 0 0"/>'))
    assert not found.warnings


def test_mimics_over_several_joints_and_in_loops() -> None:
    body = links("a", "b", "c", "d", "e")
    body += joint("a", "b", '<mimic joint="c_joint" multiplier="2"/>', type="continuous")
    body += joint("b", "c", '<mimic joint="d_joint" offset="1"/>', type="continuous")
    body += joint("c", "d", type="continuous") + joint("d", "e", type="continuous")
    found = robot(body)
    assert found.positions({"d_joint": 0.5}) == {
        "b_joint": 3.0,
        "c_joint": 1.5,
        "d_joint": 0.5,
        "e_joint": 0,
    }
    loop = robot(body.replace('"d_joint" off', '"b_joint" off'))  # b -> c -> b
    assert len(loop.warnings) == 1
    assert set(loop.poses({})) == set("abcde")


def test_large_robots_are_read_in_time() -> None:
    # A chain of 10,000 links, and a mimic chain of the same length, which a quadratic step or
    # recursion would not survive.
    count = 10_000
    body = links(*map(str, range(count)))
    body += "".join(
        joint(str(i), str(i + 1), f'<mimic joint="{i}_joint"/>' if i else "", type="continuous")
        for i in range(count - 1)
    )
    found = robot(body)
    assert len(found.poses({"1_joint": 0.1})) == count


def test_many_warnings_are_cut_off() -> None:
    found = robot(f'<link name="a">{"<visual/>" * 1000}</link>')
    assert len(found.warnings) == 101
    assert found.warnings[-1] == "test.urdf: 900 more warnings"


def test_robot_without_a_name() -> None:
    found = parse_urdf("<robot><link name='a'/></robot>")
    assert found.warnings == (
        "robot_description:1: <robot> has no name; give it one: <robot name=...>",
    )
