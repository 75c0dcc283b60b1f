#!/usr/bin/env bash
# Builds the wheel and checks what users get: one pure-Python wheel with its QML and data files.
set -euo pipefail
cd "$(dirname "$0")/.."
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
.venv/bin/python -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir "$out" .
wheel=$(ls "$out"/rosglass-*-py3-none-any.whl)
listing=$(.venv/bin/python -m zipfile -l "$wheel")
for needed in rosglass/py.typed rosglass/qml/ rosglass/demo/cockpit/ rosglass/examples/remote_control.qml rosglass/examples/controls/ rosglass/controls/templates/teleop.qml rosglass/translations/rosglass_de.qm rosglass/cockpit/help/cockpit.md rosglass/cockpit/help/controls/Battery.md rosglass/cockpit/help/elements/ ros1/hector_rviz_plugins/package.xml rosglass-0; do
  grep -q "$needed" <<<"$listing" || { echo "the wheel lacks $needed" >&2; exit 1; }
done
echo "$(basename "$wheel"): $(grep -c . <<<"$listing") files"
