// Converts what a plugin keeps in its `context` to the text of a QML value, and back.
(function () {
    const MOST = 100000, DEEPEST = 60, WIDTH = 80
    const WORD = /^[A-Za-z_$][A-Za-z0-9_$]*$/
    const RESERVED = ["default", "delete", "new", "function", "class", "in", "this", "null", "true", "false", "if", "for", "return"]

    function isObject(value) {
        return value !== null && typeof value === "object"
    }

    // An object of Qt: it ends with its item, and has no text.
    function isItem(value) {
        return /^[A-Za-z_][\w:]*\(0x[0-9a-f]+/.test(String(value))
    }

    function key(name) {
        return WORD.test(name) && RESERVED.indexOf(name) < 0 ? name : JSON.stringify(name)
    }

    // Returns a copy that has only numbers, texts, truth values, null, lists and objects.
    function plain(value, path, state, isField) {
        if (++state.count > MOST || path.length > DEEPEST)
            throw new Error("more than " + MOST + " values, or more than " + DEEPEST + " levels")
        if (value === undefined || typeof value === "function" || typeof value === "symbol") {
            if (value !== undefined)
                state.left.push(path.join("."))
            return undefined
        }
        if (!isObject(value))
            return value
        if (value instanceof Date)
            return isNaN(value) ? null : value.toISOString()
        if (isItem(value)) {
            state.left.push(path.join("."))
            return undefined
        }
        // Arrays of messages may be of a type of their own.
        const list = Array.isArray(value) ? value : typeof value.toArray === "function" ? value.toArray() : null
        if (list !== null || typeof value.length === "number") {
            const items = []
            for (let i = 0, n = (list || value).length; i < n; ++i) {
                const item = plain((list || value)[i], path.concat(i), state, isField)
                items.push(item === undefined ? null : item)
            }
            return items
        }
        const made = {}
        // Messages do not list their type, and those of fields follow from it.
        const isMessage = typeof value["#messageType"] === "string"
        if (isMessage && !isField)
            made["#messageType"] = value["#messageType"]
        for (const name of Object.keys(value)) {
            if (typeof value[name] === "function" || (isField && name === "#messageType"))
                continue // a method, such as those of times
            const item = plain(value[name], path.concat(name), state, isMessage)
            if (item !== undefined)
                made[name] = item
        }
        return made
    }

    function literal(value, indent) {
        if (!isObject(value))
            return typeof value === "string" ? JSON.stringify(value) : String(value)
        const isList = Array.isArray(value), inner = indent + "    "
        const parts = isList ? value.map(item => literal(item, inner))
            : Object.keys(value).map(name => key(name) + ": " + literal(value[name], inner))
        const ends = isList ? ["[", "]"] : ["{", "}"]
        const line = ends[0] + (isList || !parts.length ? parts.join(", ") : " " + parts.join(", ") + " ") + ends[1]
        if (line.length + indent.length <= WIDTH && line.indexOf("\n") < 0)
            return line
        return ends[0] + "\n" + parts.map(part => inner + part).join(",\n") + "\n" + indent + ends[1]
    }

    return {
        // Returns a copy of the values, their text, and the paths of values that have none.
        read: function (map, names) {
            const state = { count: 0, left: [] }, made = {}
            for (const name of names) {
                const value = plain(map[name], [name], state)
                if (value !== undefined)
                    made[name] = value
            }
            return { values: made, text: "(" + literal(made, "") + ")", left: state.left }
        },
        // Writes values to a map; returns the names that it does not take.
        write: function (map, values) {
            const made = plain(isObject(values) ? values : {}, [], { count: 0, left: [] })
            const refused = []
            for (const name of Object.keys(made)) {
                try {
                    map[name] = made[name]
                } catch (error) {
                    refused.push(name)
                }
            }
            return refused
        }
    }
})
