// The drawing of the chart.

const svg = byId("drawing").querySelector("svg");
// All parts of the drawing in their order: groups of elements, and lines between them.
const parts = svg ? [...svg.children] : [];
// The groups of the drawing by the place of their element in the source. An element can have several.
const groups = grouped(parts.filter((part) => part.dataset.element).map((part) => [part, part.dataset.element]));
const groupsOf = (items) => items.map((item) => groups.get(item.key) || []);
const stepGroups = groupsOf(data.steps);
const macroGroups = groupsOf(data.macros);
const transitionGroups = groupsOf(data.transitions);
const macrosOfStep = grouped(data.macros.flatMap((one, at) => one.steps.map((step) => [at, step])));

// --- what is in sight ---------------------------------------------------------------------------------------------------------------------

// A drawing with more parts than this contains only those in sight and around it: a browser needs seconds for the layout of a thousand steps.
const MANY = 1500;
const isLarge = parts.length > MANY;
let boxes = null;
// The area that the drawing contains now.
let area = null;

const number = (element, name) => Number(element.getAttribute(name));

// Left, top, right and bottom of a part.
function boxOf(part) {
    switch (part.tagName) {
        case "g": {
            const all = [...part.children].map(boxOf);
            return [0, 1, 2, 3].map((side) => (side < 2 ? Math.min : Math.max)(...all.map((box) => box[side])));
        }
        case "rect": {
            const [x, y] = [number(part, "x"), number(part, "y")];
            return [x, y, x + number(part, "width"), y + number(part, "height")];
        }
        case "line": {
            const [x1, y1, x2, y2] = ["x1", "y1", "x2", "y2"].map((name) => number(part, name));
            return [Math.min(x1, x2), Math.min(y1, y2), Math.max(x1, x2), Math.max(y1, y2)];
        }
        case "text": {
            const [x, y] = [number(part, "x"), number(part, "y")];
            return [x, y - 14, x + number(part, "textLength"), y + 4];
        }
        case "circle": {
            const [x, y, r] = [number(part, "cx"), number(part, "cy"), number(part, "r")];
            return [x - r, y - r, x + r, y + r];
        }
        case "path": {
            const [, x, y] = /^M(-?[\d.]+)[ ,](-?[\d.]+)/.exec(part.getAttribute("d")) || [0, 0, 0];
            return [Number(x) - 10, Number(y) - 10, Number(x) + 10, Number(y) + 10];
        }
        default: return [-Infinity, -Infinity, Infinity, Infinity];
    }
}

// Puts the parts in sight into the drawing, with as much around them.
function showArea(isWhole = false) {
    if (!isLarge) return;
    boxes ||= parts.map(boxOf);
    if (isWhole) {
        area = null;
        svg.replaceChildren(...parts);
        return;
    }
    const [sheet, frame] = [svg.getBoundingClientRect(), byId("drawing").getBoundingClientRect()];
    const scale = sheet.width / number(svg, "width") || 1;
    const sight = [
        (Math.max(frame.left, 0) - sheet.left) / scale, (Math.max(frame.top, 0) - sheet.top) / scale,
        (Math.min(frame.right, innerWidth) - sheet.left) / scale, (Math.min(frame.bottom, innerHeight) - sheet.top) / scale,
    ];
    if (sight[2] <= sight[0] || sight[3] <= sight[1]) return;
    if (area && sight[0] >= area[0] && sight[1] >= area[1] && sight[2] <= area[2] && sight[3] <= area[3]) return;
    const [wide, high] = [sight[2] - sight[0], sight[3] - sight[1]];
    area = [sight[0] - wide, sight[1] - high, sight[2] + wide, sight[3] + high];
    svg.replaceChildren(...parts.filter((_, at) => {
        const box = boxes[at];
        return box[0] <= area[2] && box[2] >= area[0] && box[1] <= area[3] && box[3] >= area[1];
    }));
}

// Scrolls the drawing to a part that it does not contain now.
function revealArea(part) {
    const box = boxes[parts.indexOf(part)];
    const scale = svg.getBoundingClientRect().width / number(svg, "width") || 1;
    byId("drawing").scrollTo(box[0] * scale - 100, box[1] * scale - 100);
}

let isAreaDue = false;
function areaChanged() {
    if (!isLarge || isAreaDue) return;
    isAreaDue = true;
    requestAnimationFrame(() => {
        isAreaDue = false;
        showArea();
    });
}

if (isLarge) {
    svg.replaceChildren();
    document.addEventListener("scroll", areaChanged, { capture: true, passive: true });
    addEventListener("beforeprint", () => showArea(true));
    addEventListener("afterprint", areaChanged);
}
byId("drawing").classList.remove("large");

// --- states -------------------------------------------------------------------------------------------------------------------------------

// The signs that a group has beside its element. They are made when it needs them first.
const signs = new Map();

function signsOf(group, prepare) {
    if (!signs.has(group)) signs.set(group, prepare(group) || {});
    return signs.get(group);
}

// A step has its token below its name, a state before it: the rest of its box may contain other states.
function stepSigns(group) {
    const box = group.querySelector("rect.l, rect.u");
    if (!box) return null;
    box.classList.add("box");
    const [x, y, width, height] = ["x", "y", "width", "height"].map((name) => number(box, name));
    const isState = box.classList.contains("u");
    const token = isState ? { cx: x + 11, cy: y + 11 } : { cx: x + width / 2, cy: y + height - 9 };
    const at = isState ? { x: x + width - 6, y: y - 4 } : { x: x - 5, y: y + height - 4 };
    const time = shape("text", { class: "time", ...at }, "");
    const stop = shape("path", { class: "stop", d: `M${x - 3} ${y - 6}h6l4 4v6l-4 4h-6l-4 -4v-6z` });
    const isWithin = (at, from, length) => from < at && at < from + length;
    for (const text of isState ? [] : group.querySelectorAll("text")) {
        // An active step has its name higher, so that the token does not touch it.
        if (isWithin(number(text, "x"), x, width) && isWithin(number(text, "y"), y, height)) text.classList.add("name");
    }
    group.append(shape("circle", { class: "token", ...token, r: isState ? 3.5 : 3 }), time, stop);
    return { time };
}

function transitionSigns(group) {
    const bar = group.querySelector("line.b");
    const label = group.querySelector("text");
    const sign = shape("text", { class: "sign" }, "");
    const place = (x, y) => {
        sign.setAttribute("x", x);
        sign.setAttribute("y", y);
        group.append(sign);
        return { sign };
    };
    // Between states, the sign is before the label.
    if (!bar) return label && place(number(label, "x") - 9, number(label, "y"));
    const halo = bar.cloneNode();
    halo.setAttribute("class", "halo");
    group.prepend(halo);
    return place(Math.min(number(bar, "x1"), number(bar, "x2")) + 9, number(bar, "y1") - 9);
}

const outer = new Set(data.steps.map((step) => step.parent));
stepGroups.forEach((some, step) => { if (outer.has(step)) for (const group of some) group.classList.add("outer"); });

// The groups that are lit, with the text beside them, and the groups of transitions with their states.
let lit = new Map();
let marked = new Map();

const timeOf = (step, cells) => {
    const { time } = data.steps[step];
    return time === null ? "" : duration(cells[machine.places[time]]);
};

function drawChart(cells, active, states) {
    const now = new Map();
    for (const step of active) {
        for (const group of stepGroups[step]) now.set(group, now.get(group) || timeOf(step, cells));
        for (const one of macrosOfStep.get(step) || []) for (const group of macroGroups[one]) if (!now.has(group)) now.set(group, "");
    }
    for (const group of lit.keys()) if (!now.has(group)) group.classList.remove("active");
    for (const [group, text] of now) {
        const { time } = signsOf(group, stepSigns);
        if (!lit.has(group)) group.classList.add("active");
        if (time) write(time, text);
    }
    lit = now;
    drawTransitions(states);
}

// An element can be drawn for several transitions: the instances of a macro are drawn once. It shows the most important of their states.
const RANKS = { fired: 3, ready: 2, enabled: 1 };
const SIGNS = { fired: "✓", ready: "▶", enabled: "▷" };

function drawTransitions(states) {
    const now = new Map();
    for (const [at, { state }] of states) {
        if (!RANKS[state]) continue;
        for (const group of transitionGroups[at]) if (!(RANKS[now.get(group)] >= RANKS[state])) now.set(group, state);
    }
    for (const [group, state] of marked) {
        if (now.get(group) === state) continue;
        group.classList.remove(state);
        const { sign } = signsOf(group, transitionSigns);
        if (sign && !now.has(group)) sign.textContent = "";
    }
    for (const [group, state] of now) {
        if (marked.get(group) === state) continue;
        const { sign } = signsOf(group, transitionSigns);
        group.classList.add(state);
        if (sign) sign.textContent = SIGNS[state];
    }
    marked = now;
}
