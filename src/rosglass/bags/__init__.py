"""Recordings: writing topics to a file, and playing files back."""

from rosglass.bags.bag import Bag, BagMessage, Channel, open_bag
from rosglass.bags.player import Player, PlayerState
from rosglass.bags.recorder import Recorder, RecordingStatus

__all__ = [
    "Bag",
    "BagMessage",
    "Channel",
    "Player",
    "PlayerState",
    "Recorder",
    "RecordingStatus",
    "open_bag",
]
