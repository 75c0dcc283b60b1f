"""Changes of a layout, by the texts they give."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

import pytest

from rosglass.cockpit.layout_edits import EDGES, LayoutEdits, element_of
from rosglass.cockpit.qml_document import Document
from rosglass.errors import ArgumentError, BoundError

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.cockpit.qml_document import Object

HEAD = "import QtQuick 2.15\nimport RosCockpit 1.0\n\n"
LAYOUT = """Cockpit {
    // The command of all.
    TwistCommand { id: command; topic: "cmd_vel" }
    Page {
        title: "Drive"
        Split {
            // The camera in front.
            Panel { id: front; share: 2; title: "Front"; CameraView {} }
            Split {
                orientation: Qt.Vertical
                Panel { id: stick; DriveStick { command: command } }
                Tabs {
                    Panel { id: map; MapView {} }
                    Panel { id: battery; Battery {} }
                }
            }
        }
    }
    Page {
        id: health
        title: "Health"
    }
}
"""


def edited(change: Callable[[LayoutEdits, Callable[[str], Object]], object], text: str = "") -> str:
    """Return the layout after a change, without its head."""
    edits = LayoutEdits(Document(HEAD + (text or LAYOUT)))
    first = edits.document

    def find(name: str) -> Object:
        found = first.find(name)
        assert found is not None
        return found

    change(edits, find)
    assert edits.document.text.startswith(HEAD)
    return edits.document.text[len(HEAD) :]


def moved(panel: str, target: str, edge: str, text: str = "") -> str:
    return edited(lambda edits, find: edits.move(find(panel), find(target), edge), text)


SMALL = """Cockpit {
    Page {
        id: page
        Panel { id: a; title: "A" }
        Panel { id: b; title: "B" }
        Panel { id: c; title: "C" }
    }
}
"""


@pytest.mark.parametrize(
    ("edge", "expected"),
    [
        (
            "left",
            """
        Panel { id: b; title: "B" }
        Panel { id: a; title: "A"; share: 0.5 }
        Panel { id: c; title: "C"; share: 0.5 }
""",
        ),
        (
            "right",
            """
        Panel { id: b; title: "B" }
        Panel { id: c; title: "C"; share: 0.5 }
        Panel { id: a; title: "A"; share: 0.5 }
""",
        ),
        (
            "top",
            """
        Panel { id: b; title: "B" }
        Split {
            orientation: Qt.Vertical
            Panel { id: a; title: "A" }
            Panel { id: c; title: "C" }
        }
""",
        ),
        (
            "center",
            """
        Panel { id: b; title: "B" }
        Tabs {
            Panel { id: c; title: "C" }
            Panel { id: a; title: "A" }
        }
""",
        ),
        (
            "before",
            """
        Panel { id: b; title: "B" }
        Panel { id: a; title: "A" }
        Panel { id: c; title: "C" }
""",
        ),
    ],
)
def test_moved_beside_another(edge: str, expected: str) -> None:
    made = moved("a", "c", edge, SMALL)
    assert made == f"Cockpit {{\n    Page {{\n        id: page{expected}    }}\n}}\n"


def test_a_split_that_is_left_with_one_child_is_replaced_by_it() -> None:
    assert (
        moved("stick", "health", "center")
        == """Cockpit {
    // The command of all.
    TwistCommand { id: command; topic: "cmd_vel" }
    Page {
        title: "Drive"
        Split {
            // The camera in front.
            Panel { id: front; share: 2; title: "Front"; CameraView {} }
            Tabs {
                Panel { id: map; MapView {} }
                Panel { id: battery; Battery {} }
            }
        }
    }
    Page {
        id: health
        title: "Health"
        Panel { id: stick; DriveStick { command: command } }
    }
}
"""
    )


def test_tabs_that_are_left_with_one_panel_are_replaced_by_it() -> None:
    made = moved("map", "stick", "left")
    assert (
        """            Split {
                orientation: Qt.Vertical
                Split {
                    Panel { id: map; MapView {} }
                    Panel { id: stick; DriveStick { command: command } }
                }
                Panel { id: battery; Battery {} }
            }
"""
        in made
    )


def test_the_comment_of_a_panel_goes_with_it() -> None:
    made = moved("front", "battery", "before")
    assert (
        """            Tabs {
                Panel { id: map; MapView {} }
                // The camera in front.
                Panel { id: front; title: "Front"; CameraView {} }
                Panel { id: battery; Battery {} }
            }
"""
        in made
    )
    # The Split around it had two children.
    assert made.count("Split {") == 1


def test_a_panel_leaves_its_tabs_to_their_side() -> None:
    text = "Cockpit {\n    Page {\n        Tabs {\n            id: tabs\n"
    text += (
        "            Panel { id: a }\n            Panel { id: b }\n            Panel { id: c }\n"
    )
    text += "        }\n    }\n}\n"
    assert (
        moved("b", "tabs", "top", text)
        == """Cockpit {
    Page {
        orientation: Qt.Vertical
        Panel { id: b }
        Tabs {
            id: tabs
            Panel { id: a }
            Panel { id: c }
        }
    }
}
"""
    )


def test_along_the_side_of_a_page() -> None:
    assert (
        moved("a", "page", "bottom", SMALL)
        == """Cockpit {
    Page {
        id: page
        orientation: Qt.Vertical
        Split {
            Panel { id: b; title: "B" }
            Panel { id: c; title: "C" }
        }
        Panel { id: a; title: "A" }
    }
}
"""
    )


def test_shares_are_kept_and_halved() -> None:
    text = SMALL.replace('id: c; title: "C"', "id: c; share: 3")
    made = moved("a", "c", "left", text)
    assert 'Panel { id: a; title: "A"; share: 1.5 }\n        Panel { id: c; share: 1.5 }' in made
    # A new Split takes the share of what it stands for.
    made = moved("a", "c", "top", text)
    assert (
        """        Split {
            orientation: Qt.Vertical
            share: 3
            Panel { id: a; title: "A" }
            Panel { id: c }
        }
"""
        in made
    )


def test_into_a_window_and_back() -> None:
    edits = LayoutEdits(Document(HEAD + LAYOUT))
    front = edits.document.find("front")
    assert front is not None
    edits.to_window(front, "HDMI-1", 10, 20.4, 640, 480)
    made = edits.document.text
    assert made.endswith(
        """    PanelWindow {
        x: 10
        y: 20
        width: 640
        height: 480
        screenName: "HDMI-1"
        title: "Front"
        // The camera in front.
        Panel { id: front; title: "Front"; CameraView {} }
    }
}
"""
    )
    assert made.count("Split {") == 1
    edits = LayoutEdits(edits.document)
    window = edits.document.root.children[-1]
    edits.place_window(window, "", 1, 2, 300, 200)
    assert (
        'x: 1\n        y: 2\n        width: 300\n        height: 200\n        screenName: ""'
        in (edits.document.text)
    )
    edits.close_window(edits.document.root.children[-1])
    assert "PanelWindow" not in edits.document.text
    assert edits.document.text.endswith(
        """        title: "Health"
        // The camera in front.
        Panel { id: front; title: "Front"; CameraView {} }
    }
}
"""
    )


def test_the_last_panel_of_a_window_takes_it_away() -> None:
    text = "Cockpit {\n    Page {\n        id: page\n    }\n"
    text += "    PanelWindow {\n        Panel { id: a }\n    }\n}\n"
    made = moved("a", "page", "center", text)
    assert made == "Cockpit {\n    Page {\n        id: page\n        Panel { id: a }\n    }\n}\n"


def test_resized() -> None:
    made = edited(lambda edits, find: edits.resize(find("page"), [1.256, 1, 0.744]), SMALL)
    assert 'title: "A"; share: 1.26' in made
    assert 'Panel { id: b; title: "B" }' in made
    assert 'title: "C"; share: 0.74' in made
    # All alike again: as if there had been none.
    again = edited(lambda edits, find: edits.resize(find("page"), [2, 2, 2]), made)
    assert again == SMALL


def test_resizing_does_not_overwrite_an_expression() -> None:
    text = SMALL.replace('title: "A"', "share: wide ? 2 : 1")
    with pytest.raises(BoundError):
        edited(lambda edits, find: edits.resize(find("page"), [3, 1, 1]), text)


def test_renamed_and_removed() -> None:
    made = edited(lambda edits, find: edits.rename(find("health"), "State"))
    assert made == LAYOUT.replace('"Health"', '"State"')
    made = edited(lambda edits, find: edits.remove(find("stick")))
    assert made == moved("stick", "health", "center").replace(
        "\n        Panel { id: stick; DriveStick { command: command } }", ""
    )
    made = edited(lambda edits, find: edits.remove(find("health")))
    assert "Health" not in made


def test_pages() -> None:
    made = edited(lambda edits, find: edits.add_page("Extra", 1))
    assert (
        made.index("Drive")
        < made.index('Page {\n        title: "Extra"\n    }')
        < made.index("Health")
    )
    made = edited(lambda edits, find: edits.add_page("Extra"))
    assert made.endswith('    Page {\n        title: "Extra"\n    }\n}\n')
    made = edited(lambda edits, find: edits.move_page(find("health"), 0))
    assert made.index("id: command") < made.index("Health") < made.index("Drive")


def test_added() -> None:
    made = edited(lambda edits, find: edits.add("Panel { Compass {} }", find("stick"), "bottom"))
    assert (
        """                Panel { id: stick; share: 0.5; DriveStick { command: command } }
                Panel { share: 0.5; Compass {} }
                Tabs {
"""
        in made
    )
    made = edited(lambda edits, find: edits.add("Panel { Compass {} }"))
    assert 'title: "Health"\n        Panel { Compass {} }' in made
    made = edited(lambda edits, find: edits.add("Panel {}"), "Cockpit {\n}\n")
    assert made == 'Cockpit {\n    Page {\n        title: "Page 1"\n        Panel {}\n    }\n}\n'


def test_elements_with_members_written_by_hand_stay() -> None:
    text = SMALL.replace(
        "id: page",
        'id: page\n        Split {\n            objectName: "mine"\n'
        "            Panel { id: d }\n        }",
    )
    made = moved("d", "a", "left", text)
    # A Split with a name of its own is not removed.
    assert 'objectName: "mine"' in made


def test_wrong_arguments() -> None:
    with pytest.raises(ArgumentError, match="edge"):
        moved("a", "c", "up", SMALL)
    with pytest.raises(ArgumentError, match="outside of the one that moves"):
        moved("a", "a", "left", SMALL)
    with pytest.raises(ArgumentError, match="numbers above 0"):
        edited(lambda edits, find: edits.resize(find("page"), [1, 1]), SMALL)
    with pytest.raises(ArgumentError, match="a layout, whose root is a Cockpit"):
        LayoutEdits(Document("import QtQuick 2.15\nItem {}"))
    with pytest.raises(ArgumentError, match="an object of this layout"):
        edited(lambda edits, find: edits.remove(Document(SMALL).root.children[0]), SMALL)


def test_any_move_keeps_all_panels_and_their_content() -> None:
    rng = random.Random(30)
    document = Document(HEAD + LAYOUT)

    def panels(document: Document) -> list[str]:
        found = [one for one in document.objects() if element_of(one) == "Panel"]
        return sorted(one.children[0].text for one in found)

    before, refusals = panels(document), []
    for _ in range(400):
        edits = LayoutEdits(document)
        found = [one for one in document.objects() if element_of(one) not in {"", "Cockpit"}]
        movable = [one for one in found if element_of(one) in {"Panel", "Split", "Tabs"}]
        choice = rng.random()
        try:
            if choice < 0.1:
                edits.to_window(rng.choice(movable), "HDMI-1", 1, 2, 300, 200)
            elif choice < 0.15 and any(element_of(one) == "PanelWindow" for one in found):
                windows = [one for one in found if element_of(one) == "PanelWindow"]
                edits.close_window(rng.choice(windows))
            else:
                edits.move(rng.choice(movable), rng.choice(found), rng.choice(EDGES))
        except ArgumentError as error:
            refusals.append(str(error))
            continue
        document = edits.document
        assert panels(document) == before
        for one in document.objects():
            if element_of(one) in {"Split", "Tabs"}:
                assert len(one.children) > 1, document.text
        assert document.text.count("// The camera in front.") == 1
    assert document.text.count("Page {") == 2
    assert all("an element outside of the one that moves" in one for one in refusals)
    assert len(refusals) < 150
