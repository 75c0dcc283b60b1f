// The emergency stops of this program: a key stops by all of them, as Qt gives it to one Shortcut only.
.pragma library

var all = []

function add(stop) {
    all = all.concat([stop])
}

function remove(stop) {
    all = all.filter(function(one) { return one !== stop })
}

function press() {
    for (const one of all)
        one.press()
}
