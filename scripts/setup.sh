#!/usr/bin/env bash
# Prepares a clean checkout: scripts/setup.sh demo | rviz-demo | dev | test
#   demo  what `make demo` needs: .venv with rosglass and its cockpit
#   rviz-demo  what `make rviz-demo` needs: RViz and ROS's master, .venv-system on Debian's own Python
#   dev   what `make lint`, `make types`, `make docs` and `make wheel` need: .venv with everything
#   test  what `make test` needs: .venv with everything, .venv-system on Debian's own Python,
#         .venv-rclpy with real ROS 2 nodes to talk to
# Repeatable: what is already there is left alone, so a second run needs no network and no root.
set -euo pipefail
cd "$(dirname "$0")/.."
purpose=${1:-demo}
mkdir -p .stamps

say()  { printf '==> %s\n' "$*"; }
fail() { printf '\nrosglass set-up stopped: %s\n' "$1" >&2; shift; printf '  %s\n' "$@" >&2; exit 1; }

case $purpose in demo|rviz-demo|dev|test) ;; *) fail "unknown purpose '$purpose'" "use: scripts/setup.sh demo|rviz-demo|dev|test" ;; esac

# What Qt's wheels expect from the system, a virtual screen, and a font.
apt_demo=(xvfb xauth libegl1 libgl1 libopengl0 libxkbcommon-x11-0 libdbus-1-3 libfontconfig1 libglib2.0-0
          libxcb-cursor0 libxcb-icccm4 libxcb-image0 libxcb-keysyms1 libxcb-randr0
          libxcb-render-util0 libxcb-shape0 libxcb-xinerama0 libxcb-xkb1 libpulse0
          libgl1-mesa-dri fonts-dejavu-core)
# Debian's own Python for the RViz environment, ROS 1's message generator to compare with, a private
# network for DDS, Fast DDS to talk to, and ROS 1 itself: master, tools, rospy, roscpp, actionlib,
# catkin; Vulkan on the processor for the 3D view; accessibility as a screen reader sees it.
apt_test=(python3 python3-venv python3-genpy python3-genmsg xdotool x11-apps
          iproute2 util-linux g++ python3-dev pkg-config libfastrtps-dev
          python3-rosmaster python3-roslaunch rosout python3-rospy python3-actionlib
          python3-rostopic python3-rosservice python3-rosparam python3-rosnode python3-rosbag
          python3-rosmsg python3-std-msgs python3-std-srvs python3-geometry-msgs
          python3-sensor-msgs python3-nav-msgs python3-diagnostic-msgs python3-visualization-msgs
          python3-actionlib-msgs python3-tf2-msgs python3-tf2-ros python3-trajectory-msgs
          python3-shape-msgs python3-stereo-msgs python3-map-msgs python3-pcl-msgs python3-bond
          python3-interactive-markers mesa-vulkan-drivers libvulkan1
          python3-pyatspi at-spi2-core dbus-daemon
          catkin ros-message-generation ros-message-runtime ros-std-msgs ros-geometry-msgs
          libroscpp-dev libactionlib-dev libstd-msgs-dev
          libstd-srvs-dev libgeometry-msgs-dev libsensor-msgs-dev)
# RViz, its renderer and Qt 5 in Debian's own Python.
apt_rviz=(python3 python3-venv python3-rosmaster rviz python3-rviz python3-ogre-1.12 python3-pyqt5.qtquick python3-pyqt5.qtopengl
          python3-pyside2.qtopengl python3-pyside2.qtmultimediawidgets python3-pyside2.qtquickwidgets
          python3-pyside2.qtcore python3-pyside2.qtgui python3-pyside2.qtqml python3-pyside2.qtquick
          python3-pyside2.qtmultimedia python3-pyside2.qtwidgets python3-pyside2.qttest
          qml-module-qtquick2 qml-module-qtquick-window2 qml-module-qtquick-layouts
          qml-module-qtquick-controls2 qml-module-qtmultimedia)

install_apt() {
  command -v dpkg-query >/dev/null && command -v apt-get >/dev/null || {
    say "no apt here: assuming that these Debian packages' equivalents are installed: $*"; return; }
  local missing=()
  for package in "$@"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return
  local root=()
  if [ "$(id -u)" -ne 0 ]; then
    if command -v sudo >/dev/null && { [ -t 0 ] || sudo -n true 2>/dev/null; }; then root=(sudo)
    else fail "system packages are missing and this user cannot install them" \
      "ask an administrator to run:" "  apt-get install --no-install-recommends ${missing[*]}" "then run this again."; fi
  fi
  say "installing Debian packages: ${missing[*]}"
  "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update -qq >.stamps/apt.log 2>&1 &&
  "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
    "${missing[@]}" >>.stamps/apt.log 2>&1 || {
      tail -5 .stamps/apt.log >&2
      fail "apt-get could not install: ${missing[*]}" "the whole output is in .stamps/apt.log;" \
        "without a network, connect this machine (or set http_proxy) and run this again."; }
}

# make_venv DIR PYTHON EXTRAS [venv options]
make_venv() {
  local dir=$1 python=$2 extras=$3 log=.stamps/pip$1.log; shift 3
  local wanted; wanted="$(cat pyproject.toml; echo "$python $extras $*"; "$python" -V)"
  [ "$(cat "$dir/.rosglass" 2>/dev/null)" = "$wanted" ] && return
  "$python" -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null ||
    fail "$python is not Python 3.10 or newer ($("$python" -V 2>&1))" \
      "install a newer one, or name it: make PYTHON=/usr/bin/python3.11 $purpose"
  say "making $dir with $("$python" -V)"
  [ -x "$dir/bin/python" ] && "$dir/bin/python" -m pip --version >/dev/null 2>&1 ||
    "$python" -m venv --clear "$@" "$dir" >".stamps/venv$dir.log" 2>&1 || {
      tail -3 ".stamps/venv$dir.log" >&2; fail "$python cannot make virtual environments" \
        "on Debian and Ubuntu: sudo apt-get install python3-venv, then run this again."; }
  say "installing Python packages into $dir (rosglass[$extras]; a few minutes the first time)"
  if ! "$dir/bin/python" -m pip install --disable-pip-version-check --progress-bar off -e ".[$extras]" \
    2>&1 | tee "$log" | sed -un 's/^ *Downloading \([^ ]*\)\(.*\)/    \1\2/p'; then
    grep -E '^ *(ERROR|error)' "$log" | tail -5 >&2
    if grep -q 'Python\.h' "$log"; then
      fail "a package had to be compiled and Python's headers are missing" \
        "sudo apt-get install build-essential python3-dev, then run this again."
    elif grep -qiE 'connection|resol|timed out|network' "$log"; then
      fail "PyPI could not be reached" "check the network (or set https_proxy / PIP_INDEX_URL) and run this again;" \
        "pip's whole output is in $log"
    else fail "pip could not install the Python packages" "pip's whole output is in $log"; fi
  fi
  printf '%s\n' "$wanted" >"$dir/.rosglass"
}

# Real ROS 2 Jazzy nodes (rclpy over Fast DDS), in an environment of their own: they bring ROS's message
# packages, which rosglass must do without. Wheels of PyPI, for Debian's Python.
rclpy_packages=("ros-jazzy-rclpy[fastrtps]==7.1.6" ros-jazzy-test-msgs==2.0.3 ros-jazzy-std-srvs==5.3.6
                ros-jazzy-sensor-msgs==5.3.6 ros-jazzy-nav-msgs==5.3.6 ros-jazzy-diagnostic-msgs==5.3.6)
make_rclpy_venv() {
  local dir=.venv-rclpy wanted="${rclpy_packages[*]}"
  [ "$(cat "$dir/.rosglass" 2>/dev/null)" = "$wanted" ] && return
  say "making $dir: real ROS 2 Jazzy nodes to test against"
  /usr/bin/python3 -m venv --clear "$dir" >.stamps/rclpy.log 2>&1 &&
    "$dir/bin/python" -m pip install --disable-pip-version-check --quiet "${rclpy_packages[@]}" >>.stamps/rclpy.log 2>&1 || {
      tail -5 .stamps/rclpy.log >&2
      fail "ROS 2's nodes (rclpy) could not be installed from PyPI" "the whole output is in .stamps/rclpy.log;" \
        "their wheels need x86_64 Linux and $(/usr/bin/python3 -V 2>&1) must be one they are built for (3.11)."; }
  "$dir/bin/python" -c 'import rclpy, test_msgs.srv, sensor_msgs.msg' ||
    fail "$dir was made, but rclpy cannot be imported" "remove $dir and run this again"
  printf '%s\n' "$wanted" >"$dir/.rosglass"
}

# A second parser of QML to compare the cockpit's with. It has to be compiled: where that is not possible,
# its tests are skipped.
oracle_packages=(tree-sitter==0.26.1 tree-sitter-qmljs==0.3.1)
add_oracle() {
  local dir=.venv wanted="${oracle_packages[*]}"
  [ "$(cat "$dir/.oracle" 2>/dev/null)" = "$wanted" ] && return
  if "$dir/bin/python" -m pip install --disable-pip-version-check --quiet "${oracle_packages[@]}" >.stamps/oracle.log 2>&1
  then printf '%s\n' "$wanted" >"$dir/.oracle"
  else say "tree-sitter-qmljs could not be installed (.stamps/oracle.log): its tests are skipped"; fi
}

python=${PYTHON:-python3}
system_extras=zenoh,dds,bags,completion,images,test,peers
case $purpose in
  demo) install_apt "${apt_demo[@]}" ;;
  test) install_apt "${apt_demo[@]}" "${apt_rviz[@]}" "${apt_test[@]}" ;;
  rviz-demo) install_apt "${apt_demo[@]}" "${apt_rviz[@]}" ;;
esac
[ "$purpose" = rviz-demo ] && python=/usr/bin/python3
command -v "$python" >/dev/null || install_apt python3 python3-venv
command -v "$python" >/dev/null || fail "there is no $python" "install Python 3.10 or newer, or name it: make PYTHON=... $purpose"
if ! "$python" -c 'import venv, ensurepip' 2>/dev/null; then install_apt python3-venv; fi
case $purpose in
  demo)
    # Once it was made for the tests, keep it complete.
    if [ -f .venv/.rosglass-dev ]; then make_venv .venv "$python" dev
    else make_venv .venv "$python" cockpit; fi ;;
  rviz-demo)
    # Once it was made for the tests, keep it complete.
    if [ -f .venv/.rosglass-dev ]; then make_venv .venv-system /usr/bin/python3 "$system_extras" --system-site-packages
    else make_venv .venv-system /usr/bin/python3 images --system-site-packages; fi ;;
  dev)
    make_venv .venv "$python" dev
    touch .venv/.rosglass-dev ;;
  test)
    [ -x /usr/bin/python3 ] || fail "/usr/bin/python3 is missing" "the RViz environment needs Debian's own Python 3"
    # Beside each other, as pip uses one core.
    set -m # a process group of its own, to end all of it
    { make_venv .venv-system /usr/bin/python3 "$system_extras" --system-site-packages; make_rclpy_venv; } </dev/null &
    beside=$!
    set +m
    trap 'kill -- "-$beside" 2>/dev/null || true' EXIT
    make_venv .venv "$python" dev
    touch .venv/.rosglass-dev
    add_oracle
    wait "$beside" ;;
esac
say "set-up complete"
