// Arrays in messages: JavaScript arrays with the methods of the plugins' Array type; long ones
// fetch elements on access. `host` packs types for which the engine has no typed array.
(function (prototype, host) {
    "use strict"

    const TYPED = {
        int8: Int8Array, uint8: Uint8Array, byte: Uint8Array, char: Uint8Array, bool: Uint8Array,
        int16: Int16Array, uint16: Uint16Array, int32: Int32Array, uint32: Uint32Array,
        float32: Float32Array, float64: Float64Array
    }
    // Maximum length in messages; filling a longer array would freeze the screen.
    const LONGEST = 1 << 24
    const WIDE = ["int64", "uint64"]

    function place(i) {
        if (!Number.isSafeInteger(i) || i < 0 || i >= LONGEST)
            throw new RangeError("an array index is an integer from 0 to " + (LONGEST - 1) + ", got " + String(i).slice(0, 100))
        return i
    }

    // Elements skipped when the length grew are defaults, as in the sent message.
    function filled(list) {
        if (list.length !== 0) place(list.length - 1)
        const made = Array.from(list)
        for (let i = 0; i < made.length; ++i)
            if (made[i] === undefined) made[i] = list["#default"]()
        return made
    }

    const list = prototype(Array.prototype, {
        at: function (i) {
            if (i < 0) i += this.length
            const found = this[i]
            return found === undefined && i >= 0 && i < this.length ? this["#default"]() : found
        },
        toArray: function () { return filled(this) },
        toVariantList: function () { return filled(this) },
        append: function (value) { this.push(value) },
        replace: function (i, value) {
            place(i)
            for (let last = this.length; last < i; ++last) this[last] = this["#default"]()
            this[i] = value
        },
        spliceList: function (start, count, items) {
            this.splice.apply(this, [start, count].concat(Array.from(items || [])))
        }
    })

    function listOf(kind, empty) {
        const typed = TYPED[kind]
        const wide = WIDE.includes(kind)
        return prototype(list, {
            "#default": kind === "bool" ? function () { return false }
                : typed || wide || kind === "duration" ? function () { return 0 }
                : kind === "text" ? function () { return "" }
                : empty,
            buffer: typed ? function () { return typed.from(filled(this)).buffer }
                : wide ? function () { return host.pack(kind, filled(this)) }
                : function () { return undefined }
        })
    }

    const lists = {}

    // The prototype of an array by its element type; message types have their own.
    function prototypeOf(kind, shape) {
        const holder = shape ? shape : lists
        const name = shape ? "list" : kind
        if (!(name in holder))
            holder[name] = listOf(kind, shape ? function () { return host.empty(shape.id) } : null)
        return holder[name]
    }

    const CHANGING = ["push", "pop", "shift", "unshift", "splice", "sort", "reverse", "fill",
                      "copyWithin", "append", "replace", "spliceList"]

    // A long array: behaves like an array and fetches elements from `source` on access. Methods
    // that read all elements, and changes, use a real array that is created once.
    function lazy(source, index, length, kind, shape) {
        const typed = kind === "bool" ? undefined : TYPED[kind]
        const list = prototypeOf(kind, shape)
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
                real = Object.setPrototypeOf(made, list)
                view = null
            }
            return real
        }
        function change() { changed = true; return whole() }
        function count() { return real ? real.length : length }
        function resize(length) {
            if (length !== 0) place(length - 1)
            const made = change()
            const before = made.length
            made.length = length
            for (let i = before; i < made.length; ++i) made[i] = list["#default"]()
        }
        const methods = {
            at: function (i) { return at(i < 0 ? count() + i : i) },
            toArray: function () { return Array.from(whole()) },
            toVariantList: function () { return Array.from(whole()) },
            toJSON: function () { return whole() },
            buffer: function () {
                if (changed) return real.buffer()
                return list.buffer.call([]) === undefined ? undefined : source.buffer(index)
            }
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
                // The engine's own methods bypass the Proxy and read its target.
                return found.bind(CHANGING.includes(key) ? change() : whole())
            },
            set: function (target, key, value) {
                if (key === "length") resize(value)
                else change()[key] = value
                return true
            },
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

    return { prototypeOf: prototypeOf, lazy: lazy }
})
