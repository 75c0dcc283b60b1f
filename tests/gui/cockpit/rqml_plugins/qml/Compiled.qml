import QtQuick
import Robot.CompiledPanels

Item {}
