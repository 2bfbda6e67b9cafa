// The source beside the drawing. Each element of the chart has its place in the source: pointing at one marks the other.

// The spans of the source by the element's key.
const spans = new Map();

// The place in a text for each of its bytes: spans count bytes of UTF-8, texts here have units of 16 bits. Null if both are the same.
function unitsOfBytes(text) {
    if (/^[\0-\x7F]*$/.test(text)) return null;
    const units = [];
    let unit = 0;
    for (const sign of text) {
        const code = sign.codePointAt(0);
        const bytes = code < 0x80 ? 1 : code < 0x800 ? 2 : code < 0x10000 ? 3 : 4;
        for (let n = 0; n < bytes; n++) units.push(unit);
        unit += sign.length;
    }
    units.push(unit);
    return units;
}

// The elements of a file in their order, outer ones before inner ones: key, start and end.
function placesOf(file, text) {
    const units = unitsOfBytes(text);
    const unit = (byte) => (units ? units[Math.min(byte, units.length - 1)] : Math.min(byte, text.length));
    const keys = new Set([...data.steps, ...data.transitions, ...data.macros].map((one) => one.key));
    for (const key of groups.keys()) keys.add(key);
    const places = [];
    for (const key of keys) {
        const [of, start, end] = key.split("-").map(Number);
        if (of === file && end > start) places.push({ key, start: unit(start), end: unit(end) });
    }
    return places.sort((a, b) => a.start - b.start || b.end - a.end);
}

// The text from..to with the elements in it, each in an element of its own. Of two that overlap without one containing the other, the first is kept.
function withElements(text, places, from, to) {
    const parts = [];
    let at = from;
    while (places.length > 0 && places[0].start < to) {
        const { key, start, end } = places.shift();
        if (start < at || end > to) continue;
        if (start > at) parts.push(text.slice(at, start));
        const span = make("span", { "data-element": key });
        span.append(...withElements(text, places, start, end));
        if (!spans.has(key)) spans.set(key, []);
        spans.get(key).push(span);
        parts.push(span);
        at = end;
    }
    if (at < to) parts.push(text.slice(at, to));
    return parts.map((part) => (typeof part === "string" ? cleanLines(part) : part));
}

// Line breaks and tabs stay.
const cleanLines = (text) => text.split(/\r\n?|\n/).map((line) => line.split("\t").map(clean).join("\t")).join("\n");

function makeSource() {
    const boxes = data.sources.map(({ file, name, text }) => {
        const code = make("pre");
        code.append(...withElements(text, placesOf(file, text), 0, text.length));
        return [make("h3", {}, named(name)), code];
    });
    byId("source").append(...boxes.flat());
    byId("source-box").hidden = boxes.length === 0;
    byId("source-box").open = boxes.length > 0 && innerWidth >= 1100;
}

// --- pointing -----------------------------------------------------------------------------------------------------------------------------

let pointed = null;

// Scrolls a box, and only that box, so that a part of it is in sight.
function reveal(box, part) {
    const [inner, outside] = [part.getBoundingClientRect(), box.getBoundingClientRect()];
    if (inner.top < outside.top || inner.bottom > outside.bottom) box.scrollTop += inner.top - outside.top - outside.height / 3;
    if (inner.left < outside.left || inner.right > outside.right) box.scrollLeft += inner.left - outside.left - outside.width / 3;
}

// Marks an element in the drawing and in the source; null for none.
function point(key, from = null) {
    if (key === pointed) return;
    const mark = (isOn) => {
        for (const part of [...(groups.get(pointed) || []), ...(spans.get(pointed) || [])]) part.classList.toggle("pointed", isOn);
    };
    mark(false);
    pointed = key;
    mark(true);
    if (key === null) return;
    const [span] = spans.get(key) || [];
    if (span && from !== "source" && byId("source-box").open) reveal(byId("source"), span);
    const [group] = groups.get(key) || [];
    if (!group || from === "drawing") return;
    if (isLarge && !group.isConnected) revealArea(group);
    else reveal(byId("drawing"), group);
}

for (const id of ["drawing", "source"]) {
    byId(id).addEventListener("pointerover", (event) => point(event.target.closest("[data-element]")?.dataset.element ?? null, id));
    byId(id).addEventListener("pointerleave", () => point(null));
}

// With the keyboard: the arrows move from one element of the source to the next.
byId("source").addEventListener("keydown", (event) => {
    const by = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (!by) return;
    event.preventDefault();
    const all = [...byId("source").querySelectorAll("[data-element]")];
    if (all.length === 0) return;
    const at = all.findIndex((one) => one.dataset.element === pointed);
    const next = all[Math.min(Math.max(at + by, 0), all.length - 1)];
    point(next.dataset.element);
    reveal(byId("source"), next);
    say(next.textContent.split("\n")[0]);
});
byId("source").addEventListener("blur", () => point(null));
