"""Relay topics, services and actions between two ROS graphs, also between ROS 1 and ROS 2."""

from rosglass.bridge.bridge import Bridge, Direction, Rule, SurveyEntry, survey
from rosglass.bridge.relays import BridgeStatus, RelayStatus

__all__ = ["Bridge", "BridgeStatus", "Direction", "RelayStatus", "Rule", "SurveyEntry", "survey"]
