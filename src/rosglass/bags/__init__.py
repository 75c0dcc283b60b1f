"""Recordings: record topics to a file, and play files back."""

from rosglass.bags.bag import Bag, BagMessage, Channel
from rosglass.bags.player import (
    Playback,
    Player,
    PlayerState,
    TopicDensity,
    open_bag,
    read_density,
    read_marks,
)
from rosglass.bags.recorder import MARKS_TOPIC, Recorder, RecordingStatus
from rosglass.bags.replay_node import ReplayNode

__all__ = [
    "MARKS_TOPIC",
    "Bag",
    "BagMessage",
    "Channel",
    "Playback",
    "Player",
    "PlayerState",
    "Recorder",
    "RecordingStatus",
    "ReplayNode",
    "TopicDensity",
    "open_bag",
    "read_density",
    "read_marks",
]
