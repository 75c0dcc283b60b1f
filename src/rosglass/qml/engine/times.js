// Times and durations of both modules, exact to nanoseconds. `host` does arithmetic beyond doubles;
// the objects inherit from `base`.
(function (prototype, host, base) {
    "use strict"

    // Numbers that work as methods and as properties: `t.seconds()` and `t.seconds * 2`.
    const number = prototype(Function.prototype, {
        valueOf: function () { return this() },
        toString: function (radix) { return this().toString(radix) },
        toFixed: function (digits) { return this().toFixed(digits) },
        toPrecision: function (digits) { return this().toPrecision(digits) },
        toExponential: function (digits) { return this().toExponential(digits) },
        toLocaleString: function () { return this().toLocaleString.apply(this(), arguments) },
        toJSON: function () { return this() }
    })

    function both(value) {
        return Object.setPrototypeOf(function () { return value }, number)
    }

    // Clock types: one object each, returned by both `t.clockType` and `t.clockType()`, so that
    // both are === to a member of Ros2ClockTypes.
    function clock(value) {
        const made = function () { return made }
        return Object.setPrototypeOf(made, prototype(Function.prototype, {
            valueOf: function () { return value },
            toString: function () { return String(value) },
            toJSON: function () { return value }
        }))
    }
    const clocks = [clock(0), clock(1), clock(2), clock(3)]

    // Do not expand nested objects in errors: they may have cycles.
    function flat(key, inner) {
        return key !== "" && inner !== null && typeof inner === "object" ? "..." : inner
    }

    function fail(value, wanted) {
        // A time's own toString() would call this function again.
        const plain = value !== null && typeof value === "object" && !(value instanceof Date)
        const shown = Array.isArray(value) ? "an array" : plain ? JSON.stringify(value, flat) : String(value)
        throw new TypeError("expected " + wanted + ", got " + shown.slice(0, 200))
    }

    // Seconds and nanoseconds, the latter from 0 to 999,999,999.
    function normal(sec, nanosec) {
        const carry = Math.floor(nanosec / 1e9)
        return [sec + carry, nanosec - carry * 1e9]
    }

    function fromUnits(value, perSecond, wanted) {
        if (!isFinite(value) || Math.abs(value) > 9007199254740992) fail(value, wanted)
        const sec = Math.floor(value / perSecond)
        return normal(sec, Math.round((value - sec * perSecond) * (1e9 / perSecond)))
    }

    function kindOf(value) {
        if (value instanceof Date) return "time"
        if (typeof value === "number") return "duration"
        return (value && value["#kind"]) || ""
    }

    // Seconds and nanoseconds of a time or duration in any form; numbers are milliseconds.
    function parts(value, wanted) {
        if (typeof value === "number") return fromUnits(value, 1000, wanted)
        if (value instanceof Date) return fromUnits(value.getTime(), 1000, wanted)
        if (value === null || typeof value !== "object") fail(value, wanted)
        // Check first: reading a missing name would be reported as a mistake in the interface.
        const sec = "sec" in value ? value.sec : "secs" in value ? value.secs : undefined
        if (sec === undefined) {
            const total = "nanoseconds" in value ? value.nanoseconds : undefined
            if (total === undefined || typeof total === "function") fail(value, wanted)
            return host.parts(String(total), 9)
        }
        let rest = "nanosec" in value ? value.nanosec : "nsec" in value ? value.nsec
            : "nsecs" in value ? value.nsecs : 0
        if (rest === undefined) rest = 0
        if (!Number.isSafeInteger(sec) || !Number.isSafeInteger(rest)) fail(value, wanted)
        return normal(sec, rest)
    }

    const TIME = "a time (or a Date)"
    const DURATION = "a duration (or milliseconds)"

    function own(value) { return parts(value, "integers as sec and nanosec") }

    function other(kind, value) {
        const found = kindOf(value)
        const wanted = kind === "time" ? TIME : DURATION
        if (found && found !== kind && typeof value !== "number") fail(value, wanted)
        return parts(value, wanted)
    }

    function seconds(value) { const p = own(value); return p[0] + p[1] * 1e-9 }
    function nanoseconds(value) { const p = own(value); return p[0] * 1e9 + p[1] }
    function milliseconds(value) { const p = own(value); return p[0] * 1000 + p[1] / 1e6 }

    // Decimal text without loss: 12345678901 ns are "12345678901".
    function exact(value) {
        let [sec, rest] = own(value)
        const negative = sec < 0
        if (negative) { sec = -sec; if (rest > 0) { sec -= 1; rest = 1e9 - rest } }
        const text = sec ? sec + String(rest).padStart(9, "0") : String(rest)
        return (negative ? "-" : "") + text
    }

    function decimal(value) {
        const text = exact(value)
        const digits = text.replace("-", "").padStart(10, "0")
        return (text[0] === "-" ? "-" : "") + digits.slice(0, -9) + "." + digits.slice(-9)
    }

    const common = prototype(base, {
        isZero: function () { const p = own(this); return p[0] === 0 && p[1] === 0 },
        exactNanoseconds: function () { return exact(this) },
        // So that < and > compare numbers, not texts.
        valueOf: function () { return seconds(this) },
        toString: function () { return decimal(this) },
        add: function (value) {
            const [a, b] = [own(this), other("duration", value)]
            return this["#make"](this["#kind"], a[0] + b[0], a[1] + b[1])
        },
        subtract: function (value) {
            const found = kindOf(value)
            if (!found) fail(value, TIME + " or " + DURATION)
            const [a, b] = [own(this), other(found, value)]
            const kind = this["#kind"]
            if (kind === "duration" && found === "time") fail(value, DURATION)
            return this["#make"](kind === found ? "duration" : kind, a[0] - b[0], a[1] - b[1])
        },
        compare: function (value) {
            const [a, b] = [own(this), other(this["#kind"], value)]
            return Math.sign(a[0] - b[0]) || Math.sign(a[1] - b[1])
        },
        equals: function (value) { return this.compare(value) === 0 },
        lessThan: function (value) { return this.compare(value) < 0 },
        greaterThan: function (value) { return this.compare(value) > 0 }
    })

    function getters(made, found) {
        for (const name in found)
            Object.defineProperty(made, name, { get: found[name], configurable: true })
        return made
    }

    function toDate() {
        const p = own(this)
        return new Date(p[0] * 1000 + Math.floor(p[1] / 1e6))
    }

    function times(factor) {
        if (typeof factor !== "number" || !isFinite(factor)) fail(factor, "a finite number")
        const p = own(this)
        const made = host.multiply(p[0], p[1], factor)
        return this["#make"]("duration", made[0], made[1])
    }

    const ros2 = {
        seconds: function () { return both(seconds(this)) },
        nanoseconds: function () { return both(nanoseconds(this)) }
    }
    const ros1 = {
        toSec: function () { return seconds(this) },
        toNSec: function () { return nanoseconds(this) }
    }
    // Older versions of R1 returned times as Date, as its examples expect: `stamp.getHours()`.
    for (const name of ["getDate", "getDay", "getFullYear", "getHours", "getMilliseconds", "getMinutes",
                        "getMonth", "getSeconds", "getTime", "getYear"])
        ros1[name] = function () { return toDate.call(this)[name]() }
    const ROS_CLOCK = clocks[1]
    const kinds = {
        time2: getters(prototype(common, { "#kind": "time", "#make": make2, toJSDate: toDate }),
            Object.assign({ clockType: function () { return ROS_CLOCK } }, ros2)),
        duration2: getters(prototype(common, {
            "#kind": "duration", "#make": make2, multiply: times,
            toJSDuration: function () { return milliseconds(this) }
        }), ros2),
        time1: prototype(common, Object.assign(
            { "#kind": "time", "#make": make1, toJSDate: toDate }, ros1)),
        duration1: prototype(common, Object.assign({
            "#kind": "duration", "#make": make1, multiply: times,
            toJSDuration: function () { return milliseconds(this) },
            toSec: ros1.toSec, toNSec: ros1.toNSec
        }))
    }

    function make2(kind, sec, nanosec) {
        const p = normal(sec, nanosec)
        const made = Object.create(kinds[kind + "2"])
        made.sec = p[0]
        made.nanosec = p[1]
        return made
    }

    // A duration of Ros 1.0 is a number of milliseconds.
    function make1(kind, sec, nanosec) {
        const p = normal(sec, nanosec)
        if (kind === "duration") return p[0] * 1000 + p[1] / 1e6
        const made = Object.create(kinds.time1)
        made.sec = p[0]
        made.nsec = p[1]
        return made
    }

    function maker(dialect) { return dialect === 1 ? make1 : make2 }

    // Ros2.time(), Ros2.duration() and Time.create(): from seconds, seconds and nanoseconds,
    // decimal text, or a time in any form.
    function create(dialect, kind, first, second) {
        const wanted = kind === "time" ? TIME : DURATION
        let p
        if (second !== undefined) {
            if (!Number.isSafeInteger(first) || !Number.isSafeInteger(second))
                fail([first, second], "whole seconds and nanoseconds")
            p = [first, second]
        } else if (typeof first === "number") {
            p = fromUnits(first, 1, "seconds")
        } else if (typeof first === "string") {
            p = host.parts(first, 0)
        } else {
            p = other(kind, first)
        }
        if (!Array.isArray(p) && !(p && p.length === 2)) fail(first, wanted)
        return maker(dialect)(kind, p[0], p[1])
    }

    return { kinds: kinds, make: function (d, k, s, n) { return maker(d)(k, s, n) }, create: create,
             parts: parts, clock: function (type) { return clocks[type] } }
})
