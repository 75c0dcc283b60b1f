.pragma library

// Finds texts by some of their letters, in their order: "cmv" finds "/cmd_vel".

function normalizeQuery(query) {
    return String(query || "").trim().toLowerCase()
}

// Returns the words of a query; each has to be found.
function splitTerms(query) {
    return normalizeQuery(query).split(/\s+/).filter(Boolean)
}

function startsWord(text, at) {
    return at === 0 || " /_-.:".indexOf(text[at - 1]) >= 0
}

// Returns how well a text has the letters of a word: the more at once and at beginnings of words, the better.
// -1 if it lacks one.
function singleTermScore(candidate, pattern) {
    const text = String(candidate || "").toLowerCase(), word = String(pattern || "").toLowerCase()
    if (!word)
        return 0
    const whole = text.indexOf(word)
    if (whole >= 0)
        return word.length * word.length + word.length + (startsWord(text, whole) ? 10 : 0) + (text === word ? 10 : 0)
    let points = 0, run = 0, at = 0
    for (const letter of word) {
        const next = text.indexOf(letter, at)
        if (next < 0)
            return -1
        run = next === at && at > 0 ? run + 1 : 1
        points += run + (startsWord(text, next) ? 3 : 0)
        at = next + 1
    }
    return points
}

// Returns how well one or several texts match a query, by the best text for each word; -1 if a word is missing.
function scoreFields(fields, query) {
    const texts = Array.isArray(fields) ? fields : [fields]
    let sum = 0
    for (const term of splitTerms(query)) {
        const best = texts.reduce((most, text) => Math.max(most, singleTermScore(text, term)), -1)
        if (best < 0)
            return -1
        sum += best
    }
    return sum
}

function score(candidate, query) {
    return scoreFields(candidate, query)
}
