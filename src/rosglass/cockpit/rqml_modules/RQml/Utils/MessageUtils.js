.pragma library

// Copies of messages as plain lists and objects.

function list(value) {
    if (Array.isArray(value))
        return value
    return typeof value.toArray === "function" ? value.toArray() : null
}

// Returns a copy. Messages have their type in it, from which those of their fields follow.
function copy(value, element, isField) {
    if (value === null || typeof value !== "object")
        return value
    const elements = list(value)
    if (elements !== null)
        return Array.from(elements, item => element(copy(item, element, isField)))
    const isMessage = typeof value["#messageType"] === "string"
    let made = {}
    if (isMessage && !isField)
        made["#messageType"] = value["#messageType"]
    for (const name in value) {
        if (typeof value[name] !== "function" && !(isField && name === "#messageType"))
            made[name] = copy(value[name], element, isMessage)
    }
    return made
}

function toJavaScriptObject(message) {
    return copy(message, item => item, false)
}

// The same, for ListModel: numbers and texts in lists become { display: element }.
function toListElement(message) {
    return copy(message, item => item !== null && typeof item === "object" ? item : { display: item }, false)
}

// Returns what of a message is not empty: no zeros, empty texts and lists; undefined if nothing is left.
function stripEmptyFields(value) {
    if (value === null || value === undefined || value === 0 || value === false || value === "")
        return undefined
    if (typeof value !== "object")
        return value
    const elements = list(value)
    if (elements !== null) {
        const left = Array.from(elements, stripEmptyFields).filter(item => item !== undefined)
        return left.length ? left : undefined
    }
    let made = {}
    for (const name in value) {
        if (name[0] === "#" || name === "clockType" || typeof value[name] === "function")
            continue
        const left = stripEmptyFields(value[name])
        if (left !== undefined && !(typeof left === "object" && !Array.isArray(left) && Object.keys(left).length === 0))
            made[name] = left
    }
    return made
}
