.pragma library
// Values made to hurt, and the driver that gives them to every member of an object.

// What `qml` is.
let item = null
const LONG = "x".repeat(100000)

function cyclic() { const made = { a: [] }; made.a.push(made); made.header = made; return made }
function nested() { let made = {}; for (let i = 0; i < 3000; i++) made = { a: made }; return made }
// A few values that would take for ever to walk: each is in the next one twice.
function web(twice) { let made = twice(1); for (let i = 0; i < 60; i++) made = twice(made); return made }
function fail() { throw new Error("thrown on purpose") }
function proxy() {
    return new Proxy({}, { get: fail, has: fail, ownKeys: fail, getOwnPropertyDescriptor: fail, getPrototypeOf: fail })
}
function getters() { return { get data() { throw new Error("no") }, get length() { throw new Error("no") } } }
function pretender() { return { "#kind": "time", "#index": 3, reliability: Symbol("s"), size: {}, toString: fail, valueOf: fail } }

// Each is made anew for each call: some are spoiled by being used.
const VALUES = {
    undefined: () => undefined, null: () => null, true: () => true, false: () => false,
    zero: () => 0, minus: () => -1, NaN: () => NaN, Infinity: () => Infinity, minusInfinity: () => -Infinity,
    wide: () => Math.pow(2, 53), int: () => 2147483648, huge: () => 1e308, fraction: () => 0.5,
    empty: () => "", name: () => "/fuzz", type: () => "std_msgs/msg/String", long: () => LONG,
    nul: () => "a\u0000b", surrogate: () => "\ud800 \udfff", html: () => "<img src='file:///etc/passwd'>",
    url: () => "file:///nowhere/%zz", object: () => ({}), list: () => [], holes: () => { const a = []; a.length = 9; return a },
    // Given bare, Qt itself ends in turning it into text, as it does for the text of a Text.
    web: () => { const a = web(v => [v, v]); return { data: a, ranges: a, header: a, order: a, sec: a, topic: a, x: [a] } },
    objects: () => { const a = web(v => ({ a: v, header: v, scalar: v })); return { data: a, ranges: [a], header: a, order: a, sec: a, topic: a } },
    endless: () => { const a = []; a.length = 4294967295; return { data: a, ranges: a } },
    cyclic: cyclic, nested: nested, fail: () => fail, symbol: () => Symbol("s"), date: () => new Date(NaN),
    regexp: () => /(a+)+$/, map: () => new Map([[1, 2]]), typed: () => new Float64Array([NaN, 1e308]),
    buffer: () => new ArrayBuffer(3), proxy: proxy, getters: getters, pretender: pretender,
    bare: () => Object.create(null), error: () => new Error("e"), qml: () => item, gui: () => Qt.rgba(NaN, 1, 2, 3),
}

// What no interface calls, or what ends the object that is driven.
const LEFT_OUT = ["objectName", "objectNameChanged", "deleteLater", "destroyed", "destroy", "parent", "parentChanged", "data", "resources", "children"]

// Items make points and rectangles of them, in Qt itself, which follows them for ever.
const WEBS = ["web", "objects"]

// Functions that wait for another thread, which takes long on a machine with much to do.
const WAITING = ["command", "getPath", "getPlugins", "readYaml", "writeYaml"]

function members(object) {
    const names = []
    for (const name in object) names.push(name)
    if (!("objectNameChanged" in object))
        for (let level = object; level && level !== Object.prototype && level !== Array.prototype; level = Object.getPrototypeOf(level))
            for (const name of Object.getOwnPropertyNames(level)) if (names.indexOf(name) < 0) names.push(name)
    return names.filter(name => LEFT_OUT.indexOf(name) < 0)
}

function calls(value) {
    const within = value()
    const fields = { data: within, ranges: within, header: within, order: within, sec: within, reliability: within }
    return [[value()], [fields], ["/fuzz", value()], ["/fuzz", "std_srvs/srv/SetBool", value()],
            ["std_msgs/String", "/fuzz", value(), value()], [value(), value(), value(), value(), value(), value()]]
}

// `how` is what the object is called, the members of one that does not list them itself, and whether
// to be quick.
function drive(host, object, other, how) {
    const [name, listed, few] = how
    item = other
    for (const member of listed || members(object)) {
        let kind = ""
        try { kind = typeof object[member] } catch (e) { }
        if (kind === "function") {
            host.note(name + "." + member + "()")
            try { object[member]() } catch (e) { }
        }
        for (const key in VALUES) {
            if (name.startsWith("Image") && WEBS.indexOf(key) >= 0) continue
            const value = VALUES[key]
            if (kind === "function") {
                for (const given of (few ? [[value()]] : WAITING.indexOf(member) >= 0 ? [[value()], [value(), value(), value()]] : calls(value))) {
                    host.note(name + "." + member + "(" + given.length + " x " + key + ")")
                    try { object[member].apply(object, given) } catch (e) { }
                }
                // A signal's handler that throws; a slot has none.
                if (key === "fail") try { object[member].connect(fail) } catch (e) { }
            } else {
                host.note(name + "." + member + " = " + key)
                try { object[member] = value() } catch (e) { }
                try { void object[member] } catch (e) { }
            }
        }
    }
}
