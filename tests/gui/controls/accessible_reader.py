"""Reads a program's accessible objects over AT-SPI, as a screen reader does, in Debian's Python.

Run by test_accessibility.py with the program's name: writes one line of JSON for each request on
its input. ``all`` lists the objects; ``press NAME`` does an object's first action.
"""

import json
import sys

import pyatspi


def main() -> None:
    for line in sys.stdin:
        request, _, name = line.strip().partition(" ")
        try:
            found = list(objects(program(sys.argv[1])))
            if request == "press":
                next(one for one in found if one.name == name).queryAction().doAction(0)
            answer = [described(one) for one in found]
        except Exception as error:  # something has just gone, or is not there yet
            print(repr(error), file=sys.stderr)
            answer = []
        print(json.dumps(answer), flush=True)


def program(name):
    """Return the program's root object; None before it is there."""
    return next((one for one in pyatspi.Registry.getDesktop(0) if one and one.name == name), None)


def objects(root):
    """Yield an object and all below it."""
    if root is not None:
        yield root
        for child in root:
            yield from objects(child)


def described(one):
    states = one.getState()
    return {
        "role": one.getRoleName(),
        "name": one.name,
        "description": one.description,
        "actions": actions(one),
        "focusable": states.contains(pyatspi.STATE_FOCUSABLE),
        "enabled": states.contains(pyatspi.STATE_ENABLED),
        "checked": states.contains(pyatspi.STATE_CHECKED),
        "value": value(one),
    }


def actions(one):
    try:
        action = one.queryAction()
    except NotImplementedError:
        return []
    return [action.getName(at) for at in range(action.nActions)]


def value(one):
    try:
        return one.queryValue().currentValue
    except NotImplementedError:
        return None


if __name__ == "__main__":
    main()
