// Roll, pitch and yaw of the orientation in a message.
.pragma library

const DEGREES = 180 / Math.PI

// Return {roll, pitch, yaw} in degrees as they are about the axes x, y and z, or {fault} with the
// reason in words; an empty fault without a message. The message is an Imu or an Odometry.
function read(message, type) {
    if (!message)
        return { fault: "" }
    const imu = type === "sensor_msgs/msg/Imu"
    const q = imu ? message.orientation : message.pose.pose.orientation
    if (imu && message.orientation_covariance[0] === -1)
        return { fault: qsTr("the IMU measures no orientation") }
    const length = Math.sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w)
    if (!isFinite(length))
        return { fault: qsTr("the orientation is not a number") }
    if (length < 1e-6)
        return { fault: qsTr("the orientation is zero") }
    if (Math.abs(length - 1) > 0.1)
        return { fault: qsTr("the orientation has the length %1, not 1").arg(length.toPrecision(2)) }
    const x = q.x / length, y = q.y / length, z = q.z / length, w = q.w / length
    return {
        fault: "",
        roll: DEGREES * Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        pitch: DEGREES * Math.asin(Math.max(-1, Math.min(1, 2 * (w * y - z * x)))),
        yaw: DEGREES * Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    }
}

// Return why a convention is not one of the two; empty if it is.
function unknown(convention) {
    return convention === "ENU" || convention === "NED" ? ""
        : qsTr("convention is \"ENU\" or \"NED\", not \"%1\"").arg(convention)
}

// Return a number of whole degrees, without a minus in front of zero.
function whole(degrees) {
    return Math.round(degrees) + 0
}

// Return a name without characters that control a text or its direction, and not too long.
function word(name) {
    return name.slice(0, 40).replace(/[\u0000-\u001f\u007f-\u009f\u2028-\u202e\u2066-\u2069]/g, "\ufffd") + (name.length > 40 ? "…" : "")
}
