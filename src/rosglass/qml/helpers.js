// What message values are made of on the JavaScript side; evaluated once per QML engine.
(function () {
    "use strict"

    const TYPED = {
        int8: Int8Array, uint8: Uint8Array, byte: Uint8Array, char: Uint8Array,
        int16: Int16Array, uint16: Uint16Array, int32: Int32Array, uint32: Uint32Array,
        float32: Float32Array, float64: Float64Array
    }

    function prototype(parent, members) {
        const made = Object.create(parent)
        for (const name in members)
            Object.defineProperty(made, name, { value: members[name], writable: true, configurable: true })
        return made
    }

    const time = prototype(Object.prototype, {
        seconds: function () { return this.sec + this.nanosec * 1e-9 },
        nanoseconds: function () { return this.sec * 1e9 + this.nanosec },
        isZero: function () { return this.sec === 0 && this.nanosec === 0 },
        clockType: function () { return "ros" },
        toJSDate: function () { return new Date(this.sec * 1000 + Math.floor(this.nanosec / 1e6)) }
    })

    const duration = prototype(Object.prototype, {
        seconds: time.seconds,
        nanoseconds: time.nanoseconds,
        isZero: time.isZero,
        toJSDuration: function () { return this.sec * 1000 + this.nanosec * 1e-6 }
    })

    const list = prototype(Array.prototype, {
        at: function (i) { return this[i < 0 ? this.length + i : i] },
        toArray: function () { return Array.from(this) }
    })

    const lists = {}

    // The prototype of short arrays: a real array that also answers as a long one does.
    function listOf(kind) {
        if (!(kind in lists))
            lists[kind] = kind in TYPED
                ? prototype(list, { buffer: function () { return TYPED[kind].from(this).buffer } })
                : prototype(list, { buffer: function () { return undefined } })
        return lists[kind]
    }

    const CHANGING = ["push", "pop", "shift", "unshift", "splice", "sort", "reverse", "fill", "copyWithin"]

    // A long array: looks like an array and fetches from `source` what is asked for. Methods that
    // look at all elements, and changes, work on a real array that is made once.
    function lazy(source, index, length, kind) {
        const typed = TYPED[kind]
        let view = null
        let real = null
        let changed = false

        function at(i) {
            if (real) return real[i]
            if (!(i >= 0 && i < length)) return undefined
            if (!typed) return source.at(index, i)
            if (!view) view = new typed(source.buffer(index))
            return view[i]
        }
        function whole() {
            if (!real) {
                const made = typed ? Array.from(new typed(source.buffer(index))) : new Array(length)
                if (!typed)
                    for (let i = 0; i < length; ++i) made[i] = source.at(index, i)
                real = Object.setPrototypeOf(made, listOf(kind))
                view = null
            }
            return real
        }
        function change() { changed = true; return whole() }
        function count() { return real ? real.length : length }
        const methods = {
            at: function (i) { return at(i < 0 ? count() + i : i) },
            toArray: function () { return Array.from(whole()) },
            toJSON: function () { return whole() },
            buffer: function () { return changed ? real.buffer() : source.buffer(index) }
        }
        function position(key) {
            const i = typeof key === "string" ? key >>> 0 : 0
            return String(i) === key ? i : -1
        }
        return new Proxy([], {
            get: function (target, key) {
                if (key === "length") return count()
                const i = position(key)
                if (i >= 0) return at(i)
                if (methods.hasOwnProperty(key)) return methods[key]
                if (key === "#source") return changed ? undefined : source
                if (key === "#index") return index
                const found = list[key]
                if (typeof found !== "function" || key === "constructor") return found
                // The engine's own methods do not ask a Proxy, they look into its target.
                return found.bind(CHANGING.includes(key) ? change() : whole())
            },
            set: function (target, key, value) { change()[key] = value; return true },
            deleteProperty: function (target, key) { return delete change()[key] },
            has: function (target, key) {
                const i = position(key)
                return i >= 0 ? i < count() : key in list
            },
            ownKeys: function () { return Reflect.ownKeys(whole()) },
            getOwnPropertyDescriptor: function (target, key) {
                return Object.getOwnPropertyDescriptor(whole(), key)
            }
        })
    }

    // A type's shape: its prototype, and which of its fields need more than JSON.parse gives.
    // Each field is [name, kind of array element or "", shape of the compound or null].
    function shape(name, fields, constants) {
        const parent = name.endsWith("/Time") && name.startsWith("builtin_interfaces/") ? time
            : name.endsWith("/Duration") && name.startsWith("builtin_interfaces/") ? duration
            : Object.prototype
        const members = Object.assign({}, constants)
        members["#messageType"] = name
        return { proto: prototype(parent, members), fields: fields }
    }

    function revive(value, shape, source) {
        Object.setPrototypeOf(value, shape.proto)
        for (const field of shape.fields) {
            const name = field[0]
            const inner = value[name]
            if (field[1] === "") {
                revive(inner, field[2], source)
            } else if (Array.isArray(inner)) {
                Object.setPrototypeOf(inner, listOf(field[1]))
                if (field[2])
                    for (const element of inner) revive(element, field[2], source)
            } else {
                value[name] = lazy(source, inner["#at"], inner.length, field[1])
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

    function makeTime(sec, nanosec) {
        return Object.assign(Object.create(time), { sec: sec, nanosec: nanosec })
    }

    const qos = prototype(Object.prototype, {
        reliable: function () { this.reliability = "reliable"; return this },
        best_effort: function () { this.reliability = "best_effort"; return this },
        durability_volatile: function () { this.durability = "volatile"; return this },
        transient_local: function () { this.durability = "transient_local"; return this },
        keep_all: function () { this.history = "keep_all"; return this },
        keep_last: function (depth) { this.history = "keep_last"; this.size = depth; return this },
        depth: function () { return this.size }
    })

    function makeQos(reliability, durability, history, size) {
        return Object.assign(Object.create(qos), {
            reliability: reliability, durability: durability, history: history, size: size
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
        makeTime: makeTime, makeQos: makeQos, makeOptions: makeOptions
    }
})()
