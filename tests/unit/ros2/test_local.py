"""What the graph inside one process has besides the contract of all wires."""

from __future__ import annotations

import pytest

import rosglass
from rosglass.wires import local


def test_a_graph_ends_with_its_last_node():
    with pytest.raises(rosglass.InvalidNameError):
        rosglass.connect("local://unit", "a b")
    with rosglass.connect("local://unit", "one"), rosglass.connect("local://unit", "two"):
        assert "unit" in local.networks
    assert "unit" not in local.networks


@pytest.mark.parametrize("url", ["local://a?x=1", "local://a b", "local://a/b"])
def test_more_than_a_name_is_refused(url):
    with pytest.raises(rosglass.ConversionError, match="expected local://NAME"):
        rosglass.connect(url, "one")
