"""``rosglass cockpit``: an interface without a line of code.

A layout is one QML file, of the module ``RosCockpit 1.0`` (``imports/RosCockpit``): pages, splits,
tabs and panels. The editor changes the text of this file, and the screen follows it.
"""

__all__: list[str] = []
