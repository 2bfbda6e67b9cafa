// The panel: inputs, and the values of outputs and variables.

function set(input, value, reacts = true) {
    if (panel[input.id] === value) return;
    // What the plant drives is forced by hand.
    if (driven.has(input.id) && !forced.has(input.id)) toggleForce(input);
    // A statechart may allow one event per reaction.
    if (data.exclusive && input.kind === "event" && value === 1) for (const one of inputs) if (one.kind === "event") panel[one.id] = 0;
    panel[input.id] = value;
    if (!reacts || !byId("auto").checked) redraw();
    // A run does not wait for its next reaction, which a short press could miss.
    else if (running !== null) reactInRun();
    else {
        react();
        // With a plant, time goes on.
        if (plant) start();
    }
}

// Keys for the inputs: digits, then the letters that no command uses.
const INPUT_KEYS = [..."1234567890abcdefghijklnoqsuvwyz"];
const keyOf = new Map(inputs.map((input, at) => [input, INPUT_KEYS[at]]));
// The element that shows and sets each input.
const controls = new Map();
const pressed = (input) => (input.type ? controls.get(input).focus() : set(input, 1 - panel[input.id]));

function makeInput(input) {
    const key = keyOf.get(input);
    const notes = [input.label, driven.has(input.id) ? word("drivenBy") : null].filter((one) => one);
    const row = make("li", {}, who({ ...input, label: notes.join(" · ") }));
    const isForced = forced.has(input.id);
    const forceName = word("forceOf", { name: input.name });
    const force = make("button", { type: "button", class: "force", "aria-pressed": isForced, "aria-label": forceName, title: word("forceHelp") }, "⚑");
    force.addEventListener("click", () => toggleForce(input));
    row.append(force);
    forceButtons.set(input.id, force);
    row.classList.toggle("is-forced", isForced);
    if (key) row.firstChild.firstChild.after(make("kbd", { "aria-hidden": "true" }, key));
    const attributes = { id: `input-${input.id}`, "aria-label": clean(input.name), ...(key ? { "aria-keyshortcuts": key } : {}) };
    if (input.type) {
        const [min, max] = input.type;
        const field = make("input", { ...attributes, type: "number", min, max, step: 1, title: `${min} … ${max}` });
        field.addEventListener("change", () => {
            const value = Math.round(Number(field.value));
            if (Number.isFinite(value)) set(input, Math.min(Math.max(value, min), max));
            field.value = panel[input.id];
        });
        controls.set(input, field);
        row.append(field);
        return row;
    }
    if (input.kind === "event") {
        const name = word("keyRaise", { name: input.name });
        const raise = make("button", { ...attributes, type: "button", class: "switch", "aria-label": name, "aria-pressed": "false" }, "");
        raise.addEventListener("click", () => pressed(input));
        controls.set(input, raise);
        row.append(raise);
        return row;
    }
    const hold = make("button", { type: "button", "aria-label": word("holdOf", { name: input.name }), title: word("holdHelp") }, word("hold"));
    let isHeld = false;
    const press = () => {
        isHeld = true;
        set(input, 1);
    };
    const release = () => {
        if (isHeld) set(input, 0);
        isHeld = false;
    };
    hold.addEventListener("pointerdown", press);
    for (const end of ["pointerup", "pointercancel", "pointerleave", "blur"]) hold.addEventListener(end, release);
    hold.addEventListener("keydown", (event) => { if ([" ", "Enter"].includes(event.key) && !event.repeat) press(); });
    hold.addEventListener("keyup", (event) => { if ([" ", "Enter"].includes(event.key)) release(); });
    const toggle = make("button", { ...attributes, type: "button", class: "switch", role: "switch", "aria-checked": "false" }, "0");
    toggle.addEventListener("click", () => pressed(input));
    controls.set(input, toggle);
    row.append(hold, toggle);
    return row;
}

// --- forcing ------------------------------------------------------------------------------------------------------------------------------

// The inputs that keep the value of the panel: a recording that is played, a row of the past or the end of a reaction does not change them.
const forced = new Set();
const forceButtons = new Map();

function toggleForce(input) {
    if (!forced.delete(input.id)) forced.add(input.id);
    forceButtons.get(input.id).setAttribute("aria-pressed", forced.has(input.id));
    forceButtons.get(input.id).closest("li").classList.toggle("is-forced", forced.has(input.id));
    drive(0);
    drawForced();
    redraw();
}

// The bar that names the forced inputs, and ends their forcing.
function drawForced() {
    const names = inputs.filter((input) => forced.has(input.id));
    const bar = byId("forced");
    if (names.length === 0) {
        bar.replaceChildren();
        return;
    }
    const release = make("button", { type: "button" }, word("release"));
    release.addEventListener("click", () => names.forEach(toggleForce));
    bar.replaceChildren("⚑ ", ...phrase("forced", { names: named(names.map((input) => input.name).join(", ")) }), " ", release);
}

// Values for the inputs, with those that are forced in place of the given ones.
const withForced = (values) => (forced.size === 0 ? values : values.map((value, id) => (forced.has(id) ? panel[id] : value)));

function drawInputs() {
    for (const input of inputs) {
        const control = controls.get(input);
        const value = panel[input.id];
        if (input.type) {
            // What is being typed stays.
            if (document.activeElement !== control && control.value !== String(value)) control.value = value;
            continue;
        }
        if (!isNew(control, value)) continue;
        if (input.kind === "event") {
            control.setAttribute("aria-pressed", value === 1);
            control.classList.toggle("raised", value === 1);
            control.textContent = `${value === 1 ? "●" : "○"} ${word("raise")}`;
        } else {
            control.setAttribute("aria-checked", value === 1);
            control.textContent = value === 1 ? "● 1" : "○ 0";
        }
    }
}

// The values that the panel shows beside the inputs: outputs and variables, by their columns.
const results = data.columns.map(([name, kind, id, element]) => {
    if (kind === "output") return { name, ...data.outputs[id], read: () => Number(machine.outputs[id]) };
    if (kind === "var") {
        const [lo, hi] = id === null ? [0, 1] : machine.program.cells[id];
        const type = lo === 0 && hi === 1 ? null : [lo, hi];
        return { name, isVariable: true, type, read: () => (id === null ? 0 : machine.cells[machine.places[id] + element]) };
    }
    return null;
}).filter((one) => one !== null);

function makeResult(result) {
    if (result.isVariable) result.label = word("variable");
    if (result.type) {
        const [min, max] = result.type;
        result.gauge = make("meter", { min, max, "aria-label": clean(result.name) });
        result.text = make("b");
        return make("li", {}, who(result), result.gauge, result.text);
    }
    result.text = make("span");
    result.lamp = make("span", { class: "lamp" }, make("i", { "aria-hidden": "true" }), result.text);
    return make("li", {}, who(result), result.lamp);
}

function drawResults() {
    for (const result of [...results, ...quantities]) {
        const value = result.read();
        if (!isNew(result, value)) continue;
        if (result.gauge) {
            result.gauge.value = value;
            result.text.textContent = value;
        } else {
            result.lamp.classList.toggle("on", value === 1);
            result.text.textContent = word(value === 1 ? "on" : "off");
        }
    }
}

// --- event queue --------------------------------------------------------------------------------------------------------------------------

const hasQueue = events.length > 0 || data.queues.pending.length + data.queues.sends.length > 0 || data.queues.queues.some((queue) => queue !== null);

// The events that wait, in the order in which they are taken: raised ones, those of the queues, those of the panel, and delayed ones.
function drawQueue(cells) {
    if (!hasQueue) return;
    const value = (cell, at = 0) => cells[machine.places[cell] + at];
    const { names, queues, pending, sends } = data.queues;
    const rows = [];
    const add = (key, name, values = {}) => rows.push([key, name, values]);
    for (const [name, cell] of pending) if (value(cell) === 1) add("queueRaised", name);
    queues.forEach((queue, n) => {
        if (!queue) return;
        for (let at = 0; at < value(queue[1]); at++) add(n === 0 ? "queueInternal" : "queueExternal", names[value(queue[0], at) - 1]);
    });
    for (const input of events) if (panel[input.id] === 1) add("queuePanel", input.name);
    for (const [name, cell] of sends) if (value(cell) > 0) add("queueDelayed", name, { time: duration(value(cell)) });
    if (!isNew(byId("queue"), JSON.stringify(rows))) return;
    const items = rows.map(([key, name, values]) => make("li", {}, ...phrase(key, { ...values, event: named(name) })));
    byId("queue").replaceChildren(...(items.length > 0 ? items : [make("li", {}, word("queueEmpty"))]));
}
