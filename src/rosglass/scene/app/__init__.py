"""The program ``rosglass view``: window, panels, recorder, and the QML module ``RosScene``."""
