// The JavaScript side of message values; evaluated once per QML engine.
(function (makeTimes, makeArrays, host, qt5) {
    "use strict"

    // Converting longer arrays at once takes too long.
    const MOST_VALUES = 65536, MOST_MESSAGES = 1024

    function prototype(parent, members) {
        const made = Object.create(parent)
        for (const name in members)
            Object.defineProperty(made, name, { value: members[name], writable: true, configurable: true })
        return made
    }

    // Limits for reads of fields that a type does not have. Interfaces read such names to test for
    // their existence; similar names are searched only for the first reads.
    const MOST_READ = 100, MOST_NAMES = 1000
    const absent = new Map()

    function readAbsent(value, name) {
        // JavaScript reads the latter two from any object.
        if (name[0] === "#" || name === "toJSON" || name === "then") return undefined
        const type = value["#messageType"] || value["#kind"]
        const key = type + "." + name, count = absent.get(key) || 0
        if (type && count < MOST_READ && (count || absent.size < MOST_NAMES)) {
            absent.set(key, count + 1)
            host.missing(type, name, namesOf(value))
        }
        return undefined
    }

    // The base of all messages and times: handles reads of names that neither they nor Object have.
    const base = Object.create(new Proxy(Object.prototype, {
        get: function (target, name, receiver) {
            if (name === "__proto__") return Object.getPrototypeOf(receiver)
            return typeof name !== "string" || name in target ? target[name] : readAbsent(receiver, name)
        }
    }))
    // Qt's engine treats a Proxy as a function, and finds members of functions (`name`) first.
    for (const name of Object.getOwnPropertyNames(Function.prototype)) {
        if (name in Object.prototype) {
            Object.defineProperty(base, name, { value: Object.prototype[name], writable: true, configurable: true })
            continue
        }
        Object.defineProperty(base, name, {
            get: function () { return readAbsent(this, name) },
            set: function (value) {
                Object.defineProperty(this, name, { value: value, writable: true, enumerable: true, configurable: true })
            },
            configurable: true
        })
    }

    function namesOf(value) {
        let names = []
        for (let at = value; at && at !== base; at = Object.getPrototypeOf(at))
            names = names.concat(Object.getOwnPropertyNames(at).filter(name => name[0] !== "#"))
        return names
    }

    const times = makeTimes(prototype, host, base)
    const arrays = makeArrays(prototype, host)

    // A type's shape: its prototype, and the fields for which JSON.parse is not enough. Each field
    // is [name, type of array element or "", shape of the compound or null]. Times have their own
    // prototype; `id` is the type's number in `host`.
    function shape(name, time, fields, constants, id) {
        const parent = time ? times.kinds[time] : base
        const members = Object.assign({}, constants)
        members["#messageType"] = name
        return { proto: prototype(parent, members), fields: fields, id: id }
    }

    // A long array that is converted when it is read: in QML files on Qt 5, a Proxy's length is 0.
    function whenRead(value, name, source, index, length, kind, shape) {
        function keep(array) {
            Object.defineProperty(value, name, { value: array, writable: true, enumerable: true, configurable: true })
            return array
        }
        function make() {
            const array = arrays.lazy(source, index, length, kind, shape).toArray()
            return keep(Object.setPrototypeOf(array, arrays.prototypeOf(kind, shape)))
        }
        Object.defineProperty(value, name, { get: make, set: keep, enumerable: true, configurable: true })
    }

    function revive(value, shape, source) {
        Object.setPrototypeOf(value, shape.proto)
        for (const field of shape.fields) {
            const name = field[0]
            const inner = value[name]
            if (field[1] === "") {
                revive(inner, field[2], source)
            } else if (Array.isArray(inner)) {
                Object.setPrototypeOf(inner, arrays.prototypeOf(field[1], field[2]))
                if (field[2])
                    for (const element of inner) revive(element, field[2], source)
            } else if (qt5 && inner.length <= (field[2] ? MOST_MESSAGES : MOST_VALUES)) {
                whenRead(value, name, source, inner["#at"], inner.length, field[1], field[2])
            } else {
                value[name] = arrays.lazy(source, inner["#at"], inner.length, field[1], field[2])
            }
        }
        return value
    }

    // JSON has no NaN and no infinities; Python writes them as {"#": name}.
    function finish(value) {
        for (const key in value) {
            const inner = value[key]
            if (inner === null || typeof inner !== "object") continue
            if ("#" in inner) value[key] = Number(inner["#"])
            else finish(inner)
        }
        return value
    }

    function build(text, shape, source) { return revive(JSON.parse(text), shape, source) }
    function buildWithNan(text, shape, source) {
        return revive(finish(JSON.parse(text)), shape, source)
    }

    const BEST = "best_available"
    const qos = prototype(Object.prototype, {
        reliable: function () { this.reliability = "reliable"; return this },
        best_effort: function () { this.reliability = "best_effort"; return this },
        reliability_system_default: function () { this.reliability = "system_default"; return this },
        durability_volatile: function () { this.durability = "volatile"; return this },
        transient_local: function () { this.durability = "transient_local"; return this },
        durability_system_default: function () { this.durability = "system_default"; return this },
        keep_all: function () { this.history = "keep_all"; return this },
        keep_last: function (depth) { this.history = "keep_last"; this.size = depth; return this },
        deadline: function (milliseconds) { this.deadlineMs = milliseconds; return this },
        lifespan: function (milliseconds) { this.lifespanMs = milliseconds; return this },
        send_timeout: function (milliseconds) { this.sendTimeoutMs = milliseconds; return this },
        liveliness_automatic: function () { this.liveliness = "automatic"; return this },
        liveliness_manual_by_topic: function () { this.liveliness = "manual_by_topic"; return this },
        liveliness_lease_duration: function (milliseconds) { this.leaseMs = milliseconds; return this },
        best_available: function () {
            this.reliability = this.durability = this.liveliness = BEST
            this.deadlineMs = this.leaseMs = BEST
            return this
        },
        depth: function () { return this.size }
    })

    function makeQos(reliability, durability, history, size, liveliness, deadline, lifespan, lease,
                     sendTimeout) {
        return Object.assign(Object.create(qos), {
            reliability: reliability, durability: durability, history: history, size: size,
            liveliness: liveliness, deadlineMs: deadline, lifespanMs: lifespan, leaseMs: lease,
            sendTimeoutMs: sendTimeout
        })
    }

    const options = prototype(Object.prototype, {
        setNamespace: function (namespace) { this.namespace = namespace; return this },
        getNamespace: function () { return this.namespace },
        setDomainId: function (id) { this.domain = id; return this },
        getDomainId: function () { return this.domain },
        useDefaultDomainId: function () { this.domain = -1; return this }
    })

    function makeOptions() {
        return Object.assign(Object.create(options), { namespace: "", domain: -1 })
    }

    return {
        build: build, buildWithNan: buildWithNan, shape: shape,
        makeTime: times.make, clock: times.clock, createTime: times.create, timeParts: times.parts,
        makeQos: makeQos, makeOptions: makeOptions
    }
})
