// Numbers with their units, as texts.
.pragma library

// A number of bytes; "?" for a negative one.
function bytes(count) {
    return !(count >= 0) ? "?" : count < 1e3 ? qsTr("%1 B").arg(count.toFixed(0)) : count < 1e6 ? qsTr("%1 kB").arg((count / 1e3).toFixed(1))
        : count < 1e9 ? qsTr("%1 MB").arg((count / 1e6).toFixed(1)) : qsTr("%1 GB").arg((count / 1e9).toFixed(1))
}

// Seconds as "1:02:03", or "02:03" below an hour; with tenths, "02:03.4".
function clock(seconds, tenths) {
    const two = value => (value < 10 ? "0" : "") + value
    // Not 0.2999... for 0.3.
    const parts = Math.floor(seconds * 10 + 1e-6), whole = Math.floor(parts / 10), hours = Math.floor(whole / 3600)
    return (hours ? hours + ":" : "") + two(Math.floor(whole / 60) % 60) + ":" + two(whole % 60) + (tenths ? "." + parts % 10 : "")
}
