// Which cameras there are, by the topics of image transports.
.pragma library

const TYPES = ["sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage", "ffmpeg_image_transport_msgs/msg/FFMPEGPacket", "theora_image_transport/msg/Packet"]
const TRANSPORTS = ["compressed", "compressedDepth", "ffmpeg", "theora"]

// Base topics of the cameras to which these topics belong, in their order.
function bases(topics) {
    const found = []
    for (const topic of topics) {
        const at = topic.lastIndexOf("/")
        const base = at > 0 && TRANSPORTS.indexOf(topic.slice(at + 1)) >= 0 ? topic.slice(0, at) : topic
        if (found.indexOf(base) < 0)
            found.push(base)
    }
    return found
}
