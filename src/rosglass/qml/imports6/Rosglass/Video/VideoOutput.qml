import QtQuick
import QtMultimedia as Multimedia

// Qt 6's VideoOutput, plus Qt 5's property `source`.
Multimedia.VideoOutput {
    id: root

    property var source: null
    property var _bound: null

    onSourceChanged: {
        if (_bound && _bound.videoSink === videoSink)
            _bound.videoSink = null
        _bound = null
        if (!source)
            return
        if (typeof source !== "object") {
            console.error("VideoOutput: `source` is the id of a camera's element, without quotes; got", source)
        } else if (source.videoSink !== undefined) {
            source.videoSink = videoSink
            _bound = source
        } else if ("videoOutput" in source) {
            source.videoOutput = root
        }
    }
}
