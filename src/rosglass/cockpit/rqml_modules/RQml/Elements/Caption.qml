// A small text beside what it describes.
import QtQuick

TruncatedLabel {
    font.pixelSize: 12
    opacity: 0.8
}
