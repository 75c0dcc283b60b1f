"""Pages for all robots, made from the page of one."""

from __future__ import annotations

import re

import pytest

from rosglass.cockpit.panels import find
from rosglass.cockpit.qml_document import Document
from rosglass.cockpit.robot_pages import RobotPages, pages_for_robots
from rosglass.errors import Error

FLEET = ["/anna", "/bert"]


def has_ns(kind: str) -> bool:
    found = find(kind)
    return found is not None and found.property("ns") is not None


def pages(text: str, robots: list[str] = FLEET) -> RobotPages:
    return pages_for_robots(Document(text, "fleet.qml"), robots, has_ns)


LAYOUT = """Cockpit {
    Page {
        title: "Robots"
        Panel { RobotTiles {} }
    }
    // The page of Anna.
    Page {
        title: "anna"
        ns: "/anna"
        TwistCommand { id: command; ns: "/anna" }
        Panel { title: "Eyes"; CameraView { topic: "/anna/front" } }
        Panel { Plot { paths: ["/anna/odom:x", "/clock:sec", "odom:y"] } } // all
        Panel { DriveStick { command: command } }
    }
    Page { title: "Health"; Panel { DiagnosticsView {} } }
}
"""


def test_page_is_copied_for_each_robot() -> None:
    found = pages(LAYOUT, ["/anna", "/bert", "/c/d"])
    assert found.made == ("/bert", "/c/d")
    assert found.same == ("/clock:sec (line 12)",)
    whole = found.document
    titles = [one.get("title") for one in whole.root.children]
    assert [one.value for one in titles if one] == ["Robots", "anna", "bert", "c/d", "Health"]
    bert = whole.root.children[2]
    assert bert.text == (
        'Page {\n        title: "bert"\n        ns: "/bert"\n'
        '        TwistCommand { id: command_bert; ns: "/bert" }\n'
        '        Panel { title: "Eyes"; CameraView { topic: "/bert/front"; ns: "/bert" } }\n'
        '        Panel { Plot { paths: ["/bert/odom:x", "/clock:sec", "odom:y"]; ns: "/bert" } } '
        "// all\n"
        '        Panel { DriveStick { command: command_bert; ns: "/bert" } }\n    }'
    )
    assert whole.find("command_c_d") is not None
    # All else stays, but for the namespaces that the first page needs.
    assert "// The page of Anna." in whole.text
    assert 'CameraView { topic: "/anna/front"; ns: "/anna" }' in whole.text
    assert whole.text.count("/anna") == LAYOUT.count("/anna") + 3
    # Again, nothing changes.
    again = pages_for_robots(whole, ["/anna", "/bert", "/c/d"], has_ns)
    assert again.made == ()
    assert again.document.text == whole.text


def test_page_without_a_namespace_gets_that_of_the_first_robot() -> None:
    found = pages('Cockpit { Page { title: "Drive"; Panel { Battery {} } } }')
    anna, bert = (" ".join(one.text.split()) for one in found.document.root.children)
    assert re.sub("[;\\n]", "", anna) == (
        'Page { title: "Drive anna" ns: "/anna" Panel { Battery { ns: "/anna" } } }'
    )
    assert bert == anna.replace("anna", "bert")


def test_names_that_begin_alike_stay() -> None:
    text = 'Cockpit { Page { ns: "/anna"; Panel { Battery { topic: "/anna2/battery" } } } }'
    found = pages(text)
    assert found.document.text.count("/anna2/battery") == 2
    assert found.same == ("/anna2/battery (line 1)",)


STICK = 'Page { ns: "/anna"; Panel { DriveStick { command: drive } } }'


@pytest.mark.parametrize(
    ("layout", "part"),
    [
        # A stick on the page of bert that would steer anna.
        (
            f'TwistCommand {{ id: drive; ns: "/anna" }} {STICK}',
            "fleet.qml:1: drive (TwistCommand, line 1) would be the same for all robots",
        ),
        (
            f'TwistCommand {{ id: drive; topic: "/cmd_vel" }} {STICK}',
            "drive (TwistCommand, line 1) would be the same for all robots",
        ),
        (
            'Page { ns: "/anna"; Panel { id: a; visible: a.width > 3 } }',
            "visible is code that uses a",
        ),
        (
            'Page { ns: "/anna"; Panel { Lamp { path: "/anna" + "/x" } } }',
            "path is code that uses /anna",
        ),
        (
            "Page { ns: robots.selected; Panel {} } Page { Panel { RobotTiles { id: robots } } }",
            "this page follows robots.selected, and serves all robots already",
        ),
        ("Page { Panel { RobotTiles {} } }", "it has no page with panels of one robot"),
        (
            'Page { ns: "anna/"; Panel {} }',
            """fleet.qml:1: its ns is 'anna/'; write it as "/anna\"""",
        ),
        ('Page { ns: "/"; Panel {} }', "the robot without a namespace"),
    ],
)
def test_pages_that_cannot_be_copied_are_refused(layout: str, part: str) -> None:
    with pytest.raises(Error) as caught:
        pages(f"Cockpit {{ {layout} }}")
    assert part in str(caught.value)


def test_commands_that_follow_the_page_are_shared() -> None:
    found = pages(
        "Cockpit { id: top; TwistCommand { id: drive; ns: top.page.ns } "
        'Page { ns: "/anna"; Panel { DriveStick { command: drive } } } }'
    )
    assert found.document.text.count("command: drive\n") == 2


def test_no_and_too_many_robots_are_refused() -> None:
    with pytest.raises(Error, match="no robot is found"):
        pages(LAYOUT, [])
    with pytest.raises(Error, match="51 robots are too many"):
        pages(LAYOUT, [f"/r{at}" for at in range(51)])
