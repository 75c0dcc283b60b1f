// Shared by the elements of a layout.
.pragma library

// The Cockpit around an item, or null; a binding follows it to another parent.
function cockpitOf(parent) {
    while (parent && parent.cockpit_ === undefined)
        parent = parent.parent
    return parent ? parent.cockpit_ : null
}

// The nearest element of a kind around an item, or null.
function around(item, kind) {
    while (item && item.element_ !== kind)
        item = item.parent
    return item || null
}

function contains(outer, inner) {
    while (inner && inner !== outer)
        inner = inner.parent
    return inner === outer && !!outer
}

// Whether `share` can be laid out; says so if not.
function checkShare(element, type) {
    if (!(element.share > 0 && isFinite(element.share)))
        console.error(type + ".share is a number above 0, such as 1 or 2.5; got " + element.share)
}

function share(item) {
    return item.share > 0 && isFinite(item.share) ? item.share : 1
}

// Sizes of elements side by side: by their shares, but none below its least size while there is room for
// all of these. With less room, all shrink alike. The sum is `room`, in whole pixels.
function sizes(room, shares, least) {
    const count = shares.length
    let exact = [], needed = 0
    for (const size of least)
        needed += size
    room = Math.max(0, room)
    if (needed >= room) {
        for (const size of least)
            exact.push(needed > 0 ? room * size / needed : room / count)
    } else {
        let fixed = shares.map(() => false), left = room, sum = 0, found = true
        for (const one of shares)
            sum += one
        while (found) {
            found = false
            for (let at = 0; at < count; at++) {
                if (!fixed[at] && left * shares[at] < least[at] * sum) {
                    fixed[at] = found = true
                    left -= least[at]
                    sum -= shares[at]
                    break
                }
            }
        }
        for (let at = 0; at < count; at++)
            exact.push(fixed[at] ? least[at] : left * shares[at] / sum)
    }
    let made = [], place = 0, edge = 0
    for (const size of exact) {
        place += size
        made.push(Math.round(place) - edge)
        edge = Math.round(place)
    }
    return made
}

// The items in a list of QML, which Qt 5 cannot iterate over.
function list(items) {
    let made = []
    for (let at = 0; at < items.length; at++)
        made.push(items[at])
    return made
}
