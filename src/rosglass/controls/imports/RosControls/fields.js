// Fields of messages as texts, and texts as fields; for controls that show or edit any type.
.pragma library

// A name within a namespace; absolute names stay as they are.
function resolve(ns, name) {
    return ns && name && name[0] !== "/" && name[0] !== "~" ? ns.replace(/\/+$/, "") + "/" + name : name
}

// That the robot is not connected, in words; empty if it is. For Ros2.connectionState and Ros2.connectionDetail.
function unconnected(state, detail) {
    return state === "connected" ? ""
        : state === "uninitialized" ? qsTr("the robot is not connected: Ros2.init() was not called")
        : detail ? qsTr("the robot is not connected: %1").arg(bounded(detail)) : qsTr("the robot is not connected")
}

// A text with %1, %2 ... replaced by these values. A chain of arg() would replace a "%2" in the first value as well.
function fill(text, values) {
    return text.replace(/%([1-9])/g, (mark, number) => number <= values.length ? String(values[number - 1]) : mark)
}

// A text of a robot, in a length that a control has room for.
function bounded(text, most) {
    const limit = most || 300, whole = String(text === undefined || text === null ? "" : text).slice(0, 4 * limit)
    return whole.length > limit ? whole.slice(0, limit) + " ..." : whole
}

function isList(value) {
    return Array.isArray(value) || (value !== null && typeof value === "object" && typeof value["#index"] === "number")
}

function isMessage(value) {
    return value !== null && typeof value === "object" && !isList(value)
}

// Calls visit(path, value) with each field that is not a message itself, up to `most`; returns the number of the others.
function walk(message, visit, most) {
    let count = 0
    function enter(value, path) {
        for (const name of Object.keys(value)) {
            const inner = value[name], here = path ? path + "." + name : name
            if (isMessage(inner))
                enter(inner, here)
            else if (++count <= most)
                visit(here, inner)
        }
    }
    if (isMessage(message))
        enter(message, "")
    return Math.max(0, count - most)
}

function shown(value) {
    if (typeof value === "number" && isFinite(value) && !Number.isInteger(value))
        return String(Number(value.toPrecision(6)))
    return isList(value) ? "[" + value.length + "]" : bounded(value, 60)
}

// A message in one line: "a.b 3.2 · c true".
function summary(message, most) {
    const parts = []
    const left = walk(message, (path, value) => parts.push(path + " " + shown(value)), most)
    return parts.join(" · ") + (left ? " · +" + left : "")
}

// Why a server refused, by its response; empty if it did not. Responses say so by `success` (std_srvs and most
// others) or `ok`, and give the reason as `message`, `status_message`, `error_message`, `reason` or `error`.
function refusal(response) {
    if (!isMessage(response))
        return ""
    const has = name => Object.prototype.hasOwnProperty.call(response, name)
    for (const name of ["success", "ok"]) {
        if (has(name) && response[name] === false) {
            for (const reason of ["message", "status_message", "error_message", "reason", "error"])
                if (has(reason) && typeof response[reason] === "string" && response[reason].trim() !== "")
                    return bounded(response[reason])
            return qsTr("it gave no reason")
        }
    }
    return ""
}

// What a response says for a reader: its message, or all its fields.
function answer(response) {
    if (!isMessage(response))
        return ""
    const names = Object.keys(response)
    if (names.indexOf("message") >= 0 && typeof response.message === "string" && names.indexOf("success") >= 0)
        return bounded(response.message)
    return summary(response, 8)
}
