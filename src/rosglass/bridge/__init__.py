"""Relaying topics, services and actions between two worlds, ROS 1 and ROS 2 among them."""

from rosglass.bridge.bridge import Bridge
from rosglass.bridge.rules import Direction, Rule
from rosglass.bridge.status import BridgeStatus, RelayStatus
from rosglass.bridge.survey import SurveyEntry, survey

__all__ = ["Bridge", "BridgeStatus", "Direction", "RelayStatus", "Rule", "SurveyEntry", "survey"]
