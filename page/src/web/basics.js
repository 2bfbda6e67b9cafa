// Small things that the other parts use. The parts of the page are one function: what a part declares, the others see.

const data = JSON.parse(document.getElementById("data").textContent);
const session = new Grafsynth.Session(data);
const machine = session.machine;
const { plant } = machine;
const inputs = Grafsynth.given(data);
const events = inputs.filter((input) => input.kind === "event");

const SVG = "http://www.w3.org/2000/svg";
const byId = (id) => document.getElementById(id);

// What the user wrote, without signs that change the direction of text.
const clean = (text) => String(text).replace(/[\u0000-\u001F\u007F-\u009F\u200E\u200F\u202A-\u202E\u2066-\u2069]/g, "\uFFFD");

// An element with attributes and content; texts are never read as HTML.
function make(name, attributes = {}, ...content) {
    const element = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.append(...content.map((one) => (typeof one === "string" ? clean(one) : one)));
    return element;
}

function shape(name, attributes, text) {
    const element = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    if (text !== undefined) element.textContent = clean(text);
    return element;
}

// A name of the user, kept apart from the direction of the text around it.
const named = (name) => make("bdi", { translate: "no" }, name);

const who = (one) => make("span", { class: "who" }, named(one.name), ...(one.label ? [make("small", { dir: "auto" }, one.label)] : []));

// A number of ticks as a duration.
function duration(ticks) {
    const seconds = ticks * data.tick / 1e9;
    if (seconds >= 60) return `${Math.floor(seconds / 60)} min ${Number((seconds % 60).toFixed(1))} s`;
    return seconds >= 1 || seconds === 0 ? `${Number(seconds.toFixed(3))} s` : `${Number((seconds * 1000).toFixed(3))} ms`;
}

// What each element shows: only a change is written, because most elements do not change from one picture to the next.
const drawn = new Map();

function isNew(element, state) {
    if (drawn.get(element) === state) return false;
    drawn.set(element, state);
    return true;
}

function write(element, text) {
    if (isNew(element, text)) element.textContent = text;
}

// Lists of numbers by another number: `[[0, 5], [2, 5]]` gives `{5: [0, 2]}`.
function grouped(pairs) {
    const all = new Map();
    for (const [item, key] of pairs) {
        if (!all.has(key)) all.set(key, []);
        all.get(key).push(item);
    }
    return all;
}
