"use strict";
// Shows a chart: the drawing, the panel, the past and the waveform. Everything that the chart does is in engine.js; this file only displays and asks.
(() => {
    const data = JSON.parse(document.getElementById("data").textContent);
    const session = new Grafsynth.Session(data);
    const machine = session.machine;
    const inputs = Grafsynth.given(data);

    // --- small things -----------------------------------------------------------------------------------------------------------------

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
    const named = (name) => make("bdi", {}, name);

    const who = (one) => make("span", { class: "who" }, named(one.name), ...(one.label ? [make("small", { dir: "auto" }, one.label)] : []));

    // A number of ticks as a duration.
    function duration(ticks) {
        const seconds = ticks * data.tick / 1e9;
        if (seconds >= 60) return `${Math.floor(seconds / 60)} min ${Number((seconds % 60).toFixed(1))} s`;
        return seconds >= 1 || seconds === 0 ? `${Number(seconds.toFixed(3))} s` : `${Number((seconds * 1000).toFixed(3))} ms`;
    }

    // --- what is shown ----------------------------------------------------------------------------------------------------------------

    // The values on the panel, which the next reaction reads.
    const panel = data.inputs.map(Grafsynth.zero);
    // The micro-step that is shown, of those of the last reaction; null after the reaction.
    let micro = null;
    // A timer of the browser while the chart runs.
    let running = null;

    const ticks = () => {
        const value = Math.floor(Number(byId("dt").value));
        return Number.isFinite(value) ? Math.min(Math.max(value, 0), data.maxDt) : 1;
    };

    // The state that is shown: that before a micro-step, or the current one.
    const shownCells = () => (micro === null ? machine.cells : machine.frames[micro].before);
    const firedNow = () => (micro === null ? machine.frames.flatMap((frame) => frame.fired) : machine.frames[micro].fired);

    // --- reactions --------------------------------------------------------------------------------------------------------------------

    function react(dt = ticks(), quiet = false) {
        micro = null;
        session.react(panel, dt);
        logCalls();
        for (const input of inputs) if (input.kind === "event") panel[input.id] = 0;
        if (!quiet) draw();
    }

    function microStep() {
        if (micro === null) {
            react(ticks(), true);
            micro = machine.frames.length > 0 ? 0 : null;
        } else {
            micro = micro + 1 < machine.frames.length ? micro + 1 : null;
        }
        draw();
    }

    function toThreshold() {
        const left = session.toThreshold(panel);
        if (left === null) say("No timer runs towards a threshold.");
        else react(Math.min(left, data.maxDt));
    }

    function reset() {
        stop();
        micro = null;
        session.clear();
        byId("log").replaceChildren();
        logCalls();
        draw();
    }

    function show(at) {
        stop();
        micro = null;
        session.show(at);
        // The panel shows the inputs of the row, so that the next reaction continues from there.
        if (session.at > 0) session.rows[session.at - 1].values.forEach((value, id) => { panel[id] = data.inputs[id].kind === "event" ? 0 : value; });
        draw();
    }

    // --- running ----------------------------------------------------------------------------------------------------------------------

    // Reactions per second; Infinity: as many as fit between two pictures.
    const SPEEDS = [1, 5, 20, 100, 1000, Infinity];

    function start() {
        let last = performance.now();
        let owed = 0;
        const turn = (now) => {
            const speed = SPEEDS[Number(byId("speed").value)];
            owed = Math.min(owed + (now - last) / 1000 * speed, 100_000);
            last = now;
            const end = performance.now() + 12;
            let done = 0;
            while ((owed >= 1 || speed === Infinity) && performance.now() < end) {
                react(ticks(), true);
                owed -= 1;
                done += 1;
            }
            if (speed === Infinity) owed = 0;
            if (done > 0) draw();
            running = requestAnimationFrame(turn);
        };
        running = requestAnimationFrame(turn);
        drawRunning();
    }

    function stop() {
        if (running === null) return;
        cancelAnimationFrame(running);
        running = null;
        drawRunning();
        draw();
    }

    function drawRunning() {
        const button = byId("run");
        button.setAttribute("aria-pressed", running !== null);
        button.firstChild.textContent = running === null ? "Run" : "Pause";
    }

    // --- drawing of the chart ---------------------------------------------------------------------------------------------------------

    const svg = byId("drawing").querySelector("svg");
    // The groups of the drawing by the place of their element in the source. An element can have several.
    const groups = new Map();
    if (svg) {
        for (const group of svg.querySelectorAll("g[data-element]")) {
            const key = group.dataset.element;
            if (!groups.has(key)) groups.set(key, []);
            groups.get(key).push(group);
        }
    }

    // A step has its token below its name, a state before it: the rest of its box may contain other states.
    function prepareStep(group) {
        const box = group.querySelector("rect.l, rect.u");
        if (!box || group.querySelector(".token")) return;
        box.classList.add("box");
        const [x, y, width, height] = ["x", "y", "width", "height"].map((name) => Number(box.getAttribute(name)));
        const isState = box.classList.contains("u");
        const token = isState ? { cx: x + 11, cy: y + 11 } : { cx: x + width / 2, cy: y + height - 6 };
        const time = isState ? { x: x + width - 6, y: y - 4 } : { x: x - 5, y: y + height - 4 };
        group.append(shape("circle", { class: "token", ...token, r: 3.5 }), shape("text", { class: "time", ...time }, ""));
    }

    function prepareTransition(group) {
        const bar = group.querySelector("line.b");
        const label = group.querySelector("text");
        if (group.querySelector(".sign")) return;
        if (!bar) {
            // Between states, the sign is before the label.
            if (label) group.append(shape("text", { class: "sign", x: Number(label.getAttribute("x")) - 9, y: label.getAttribute("y") }, ""));
            return;
        }
        const halo = bar.cloneNode();
        halo.setAttribute("class", "halo");
        group.prepend(halo);
        const [x, y] = [Math.min(Number(bar.getAttribute("x1")), Number(bar.getAttribute("x2"))), Number(bar.getAttribute("y1"))];
        group.append(shape("text", { class: "sign", x: x + 9, y: y - 9 }, ""));
    }

    // The numbers of the items that one element of the drawing stands for: the instances of a macro are drawn once.
    function byGroup(items) {
        const all = new Map();
        items.forEach((item, at) => {
            for (const group of groups.get(item.key) || []) {
                if (!all.has(group)) all.set(group, []);
                all.get(group).push(at);
            }
        });
        return all;
    }

    const stepGroups = byGroup(data.steps);
    const macroGroups = byGroup(data.macros);
    const transitionGroups = byGroup(data.transitions);
    const outer = new Set(data.steps.map((step) => step.parent));
    stepGroups.forEach((steps, group) => {
        prepareStep(group);
        group.classList.toggle("outer", steps.some((step) => outer.has(step)));
    });
    macroGroups.forEach((_, group) => prepareStep(group));
    transitionGroups.forEach((_, group) => prepareTransition(group));

    // What each group of the drawing shows: only a change is written, because most groups of a large chart do not change.
    const drawn = new Map();

    function isNew(group, state) {
        if (drawn.get(group) === state) return false;
        drawn.set(group, state);
        return true;
    }

    function drawChart(cells, states) {
        for (const [group, steps] of stepGroups) {
            const active = steps.filter((step) => machine.isActive(step, cells));
            const timed = active.find((step) => data.steps[step].time !== null);
            const text = timed === undefined ? "" : duration(cells[machine.places[data.steps[timed].time]]);
            if (!isNew(group, `${active.length > 0} ${text}`)) continue;
            group.classList.toggle("active", active.length > 0);
            const time = group.querySelector(".time");
            if (time) time.textContent = text;
        }
        for (const [group, macros] of macroGroups) {
            const isActive = macros.some((one) => data.macros[one].steps.some((step) => machine.isActive(step, cells)));
            if (isNew(group, isActive)) group.classList.toggle("active", isActive);
        }
        for (const [group, transitions] of transitionGroups) {
            const state = ["fired", "ready", "enabled"].find((name) => transitions.some((one) => states[one].state === name)) || "";
            if (!isNew(group, state)) continue;
            for (const name of ["fired", "ready", "enabled"]) group.classList.toggle(name, name === state);
            const sign = group.querySelector(".sign");
            if (sign) sign.textContent = { fired: "✓", ready: "▶", enabled: "▷" }[state] || "";
        }
    }

    // --- what waits for what ----------------------------------------------------------------------------------------------------------

    const factors = data.transitions.map((transition) => transition.waits.map((factor) => ({
        ...factor,
        holds: factor.value === null ? null : machine.evaluator(factor.value),
    })));

    // `waits for 3 s in p2 (1.2 s left)` for a time, otherwise the text of the condition.
    function reason(factor, cells) {
        if (!factor.time) return factor.text;
        const [step, sign, limit] = factor.time;
        const { name, time } = data.steps[step];
        if (sign !== ">=") return `${name} for ${sign} ${duration(limit)}`;
        const left = time === null ? null : limit - cells[machine.places[time]];
        return `${duration(limit)} in ${name}${left > 0 ? ` (${duration(left)} left)` : ""}`;
    }

    // For each transition: whether it fired, is fireable (`ready`) or enabled, and what it waits for.
    function transitionStates(cells) {
        const fired = new Set(firedNow());
        const dt = ticks();
        return data.transitions.map((transition, at) => {
            const missing = transition.requires.filter((step) => !machine.isActive(step, cells));
            const isNear = missing.length < transition.requires.length || transition.requires.length === 0;
            if (fired.has(at)) return { state: "fired", waits: [] };
            if (!isNear) return { state: "", waits: [] };
            const waits = missing.map((step) => `step ${data.steps[step].name}`);
            let isKnown = true;
            for (const factor of factors[at]) {
                const holds = factor.holds ? factor.holds(panel, dt, cells) : null;
                if (holds === null) isKnown = false;
                // A step that is not active has no time yet.
                if (holds === 0 && !(factor.time && missing.includes(factor.time[0]))) waits.push(reason(factor, cells));
            }
            const isReady = waits.length === 0 && isKnown && micro === null;
            return { state: isReady ? "ready" : missing.length === 0 ? "enabled" : "near", waits };
        });
    }

    const WORDS = { fired: "fired", ready: "fires next", enabled: "waits for", near: "waits for" };

    function drawWaits(states) {
        const rows = [];
        states.forEach(({ state, waits }, at) => {
            if (state === "") return;
            const transition = data.transitions[at];
            const from = transition.requires.map((step) => data.steps[step].name).join(", ");
            const row = make("li", { class: state }, named(transition.name), " ");
            if (from) row.append(make("small", {}, "from ", named(from)), " ");
            row.append(make("br"), { fired: "✓ ", ready: "▶ ", enabled: "▷ ", near: "" }[state], waits.length === 0 && state === "enabled" ? "enabled" : WORDS[state]);
            waits.forEach((one, n) => row.append(n === 0 ? " " : " and ", named(one)));
            rows.push(row);
        });
        if (rows.length === 0) rows.push(make("li", {}, "No transition is enabled."));
        byId("waits").replaceChildren(...rows.slice(0, 60));
    }

    // --- panel ------------------------------------------------------------------------------------------------------------------------

    function set(input, value, reacts = true) {
        if (panel[input.id] === value) return;
        // A statechart may allow one event per reaction.
        if (data.exclusive && input.kind === "event" && value === 1) for (const one of inputs) if (one.kind === "event") panel[one.id] = 0;
        panel[input.id] = value;
        if (reacts && byId("auto").checked && running === null) react();
        else draw();
    }

    // Keys for the inputs: digits, then the letters that no command uses.
    const INPUT_KEYS = [..."1234567890abcdefghijklnoqsuvwyz"];
    const keyOf = new Map(inputs.map((input, at) => [input, INPUT_KEYS[at]]));
    const pressed = (input) => (input.type ? byId(`input-${input.id}`).focus() : set(input, 1 - panel[input.id]));

    function makeInput(input) {
        const key = keyOf.get(input);
        const row = make("li", {}, who(input));
        if (key) row.firstChild.firstChild.after(make("kbd", { "aria-hidden": "true" }, key));
        const attributes = { id: `input-${input.id}`, "aria-label": clean(input.name), ...(key ? { "aria-keyshortcuts": key } : {}) };
        if (input.type) {
            const [min, max] = input.type;
            const field = make("input", { ...attributes, type: "number", min, max, step: 1, title: `${min} to ${max}` });
            field.addEventListener("change", () => {
                const value = Math.round(Number(field.value));
                if (Number.isFinite(value)) set(input, Math.min(Math.max(value, min), max));
                field.value = panel[input.id];
            });
            row.append(field);
            return row;
        }
        if (input.kind === "event") {
            const raise = make("button", { ...attributes, type: "button", class: "switch", "aria-pressed": "false" }, "raise");
            raise.addEventListener("click", () => pressed(input));
            row.append(raise);
            return row;
        }
        const hold = make("button", { type: "button", "aria-label": clean(`hold ${input.name}`), title: "1 while it is held" }, "hold");
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
        row.append(hold, toggle);
        return row;
    }

    function drawInputs() {
        for (const input of inputs) {
            const control = byId(`input-${input.id}`);
            const value = panel[input.id];
            if (input.type) {
                if (document.activeElement !== control) control.value = value;
            } else if (input.kind === "event") {
                control.setAttribute("aria-pressed", value === 1);
                control.classList.toggle("raised", value === 1);
                control.textContent = value === 1 ? "raised" : "raise";
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
            return { name, label: "variable", type, read: () => (id === null ? 0 : machine.cells[machine.places[id] + element]) };
        }
        return null;
    }).filter((one) => one !== null);

    function makeResult(result) {
        if (result.type) {
            const [min, max] = result.type;
            result.gauge = make("meter", { min, max, "aria-label": clean(result.name) });
            result.text = make("b");
            return make("li", {}, who(result), result.gauge, result.text);
        }
        result.text = make("span", {}, "off");
        result.lamp = make("span", { class: "lamp" }, make("i", { "aria-hidden": "true" }), result.text);
        return make("li", {}, who(result), result.lamp);
    }

    function drawResults() {
        for (const result of results) {
            const value = result.read();
            if (result.gauge) {
                result.gauge.value = value;
                result.text.textContent = value;
            } else {
                result.lamp.classList.toggle("on", value === 1);
                result.text.textContent = value === 1 ? "on" : "off";
            }
        }
    }

    // --- list of steps ----------------------------------------------------------------------------------------------------------------

    const stepRows = [];

    function outline(parent) {
        const list = [];
        data.steps.forEach((step, at) => {
            if (step.hidden || step.parent !== parent) return;
            const text = make("span", { class: "state" }, named(step.name));
            const note = make("small");
            const row = make("li", {}, text, " ", ...(step.label ? [make("small", { dir: "auto" }, step.label), " "] : []), note);
            stepRows.push({ at, text, note });
            const inner = outline(at);
            if (inner.length > 0) row.append(make("ul", {}, ...inner));
            list.push(row);
        });
        return list;
    }

    function drawSteps(cells) {
        for (const { at, text, note } of stepRows) {
            const step = data.steps[at];
            const isActive = machine.isActive(at, cells);
            const time = isActive && step.time !== null ? duration(cells[machine.places[step.time]]) : "";
            if (!isNew(text, `${isActive} ${time}`)) continue;
            text.classList.toggle("active", isActive);
            text.setAttribute("aria-label", clean(`${step.name}, ${step.kind}, ${isActive ? "active" : "not active"}`));
            note.textContent = time;
        }
    }

    // --- calls of extern actions ------------------------------------------------------------------------------------------------------

    function logCalls() {
        if (machine.effects.length === 0) return;
        byId("log-section").hidden = false;
        const log = byId("log");
        for (const [what, values] of machine.effects) {
            const call = values ? `${data.outputs[what].name}(${values.join(", ")})` : `text in ${what}, not run`;
            log.prepend(make("li", {}, make("small", {}, `row ${session.at} `), named(call)));
        }
        while (log.children.length > 100) log.lastChild.remove();
    }

    // --- waveform ---------------------------------------------------------------------------------------------------------------------

    const LANE = 26;
    const HEAD = 22;
    const lanes = data.columns.map(([name, kind, id], at) => {
        if (["scan", "dt"].includes(kind)) return null;
        const type = kind === "input" ? data.inputs[id].type : kind === "output" ? data.outputs[id].type : null;
        const isBit = kind === "fault" || (["input", "output"].includes(kind) && type === null);
        return { name, at: at - 1, isBit };
    }).filter((lane) => lane !== null).slice(0, 80);

    // The rows that the waveform shows: as many as fit, with the current one in sight.
    function drawWave() {
        const room = Math.max(byId("wave").clientWidth, 240);
        const left = Math.min(160, Math.max(70, room / 4));
        const n = Math.max(Math.floor((room - left - 8) / 34), 4);
        const to = Math.min(session.rows.length, Math.max(session.at + 2, n - 1));
        const from = Math.max(0, to - n + 1);
        const cells = session.cells(from, to);
        const step = (room - left - 8) / n;
        const x = (row) => left + (row - from) * step;
        const picture = shape("svg", { width: room, height: HEAD + lanes.length * LANE + 4, role: "img", "aria-label": `rows ${from} to ${to}` });
        for (let row = from; row <= to; row++) {
            picture.append(shape("path", { class: "grid", d: `M${x(row)} ${HEAD}V${HEAD + lanes.length * LANE}` }));
            if ((row - from) % Math.ceil(40 / step) === 0) picture.append(shape("text", { class: "soft", x: x(row) + 2, y: HEAD - 7 }, row));
        }
        lanes.forEach((lane, n) => {
            const top = HEAD + n * LANE + 5;
            const name = lane.name.length > left / 7 ? `${lane.name.slice(0, Math.floor(left / 7) - 1)}…` : lane.name;
            picture.append(shape("text", { x: 4, y: top + 13 }, name));
            const values = cells.map((row) => String(row[lane.at]));
            if (lane.isBit) drawBit(picture, values, (k) => x(from + k), top);
            else drawValues(picture, values, (k) => x(from + k), top);
        });
        picture.append(shape("path", { class: "now", d: `M${x(session.at)} ${HEAD - 4}V${HEAD + lanes.length * LANE}` }));
        picture.append(shape("text", { x: x(session.at) - 4, y: 9, class: "soft" }, "▼"));
        picture.addEventListener("click", (event) => {
            const at = from + Math.floor((event.clientX - picture.getBoundingClientRect().left - left) / step);
            if (at >= from && at <= to) show(at);
        });
        byId("wave").replaceChildren(picture);
    }

    function drawBit(picture, values, x, top) {
        let line = "";
        let area = "";
        values.forEach((value, k) => {
            const y = value === "1" ? top : top + 16;
            line += `${k === 0 ? "M" : "L"}${x(k)} ${y}H${x(k + 1)}`;
            if (value === "1") area += `M${x(k)} ${top}H${x(k + 1)}V${top + 16}H${x(k)}Z`;
        });
        if (area) picture.append(shape("path", { class: "high", d: area }));
        picture.append(shape("path", { d: line }));
    }

    function drawValues(picture, values, x, top) {
        for (let k = 0; k < values.length;) {
            let end = k + 1;
            while (end < values.length && values[end] === values[k]) end += 1;
            const [a, b] = [x(k), x(end)];
            picture.append(shape("path", { d: `M${a} ${top + 8}L${a + 3} ${top}H${b - 3}L${b} ${top + 8}L${b - 3} ${top + 16}H${a + 3}Z` }));
            const most = Math.floor((b - a - 8) / 6.5);
            const text = values[k].length > most ? (most > 2 ? `${values[k].slice(0, most - 1)}…` : "") : values[k];
            if (text) {
                const written = shape("text", { x: a + 5, y: top + 12 }, text);
                written.append(shape("title", {}, values[k]));
                picture.append(written);
            }
            k = end;
        }
    }

    // --- everything -------------------------------------------------------------------------------------------------------------------

    const emergency = data.emergency ? machine.evaluator(data.emergency) : null;
    const assumptions = data.assumptions.map((one) => ({ ...one, holds: machine.evaluator(one.value) }));

    function drawBars() {
        const bars = [];
        const add = (text) => bars.push(make("p", { class: "bar bad" }, text));
        if (broken) add(broken);
        if (machine.fault) add("fault: the reaction did not become stable, or a queue was full");
        if (emergency && emergency(machine.inputs, 0)) add("emergency: the outputs have their safe values");
        for (const one of assumptions) if (one.holds(machine.inputs, 0)) add(`the inputs violate an assumption of the chart: never ${one.never}`);
        const box = byId("bars");
        const text = bars.map((bar) => bar.textContent).join("\n");
        if (box.dataset.text !== text) {
            box.dataset.text = text;
            box.replaceChildren(...bars);
        }
    }

    let nextWave = 0;

    function draw() {
        const cells = shownCells();
        const states = transitionStates(cells);
        drawChart(cells, states);
        drawWaits(states);
        drawInputs();
        drawResults();
        drawSteps(cells);
        drawBars();
        // A waveform that changes at each picture could not be read.
        if (running === null || performance.now() > nextWave) {
            drawWave();
            nextWave = performance.now() + 250;
        }
        const scrub = byId("scrub");
        scrub.max = session.rows.length;
        scrub.value = session.at;
        const part = micro === null ? "" : `, before micro-step ${micro + 1} of ${machine.frames.length}`;
        const text = `row ${session.at} of ${session.rows.length}, ${duration(session.time())}${part}`;
        byId("clock").textContent = text;
        scrub.setAttribute("aria-valuetext", text);
        for (const [id, isIdle] of [["first", session.at === 0], ["back", session.at === 0], ["forward", session.at === session.rows.length], ["last", session.at === session.rows.length]]) byId(id).disabled = isIdle;
        const left = session.toThreshold(panel);
        byId("threshold").title = left === null ? "no timer runs" : `${duration(left)} until something changes`;
        if (running === null) announce(cells);
        if (byId("recording").offsetParent !== null) byId("recording").value = session.stimulus();
    }

    // Tells a screen reader what is new: the situation, and the outputs that changed.
    let told = new Map();
    function announce(cells) {
        const now = new Map([["", data.steps.filter((step, at) => step.listed && machine.isActive(at, cells)).map((step) => step.name).join(", ")]]);
        for (const result of results) now.set(result.name, String(result.read()));
        const news = [];
        for (const [name, value] of now) if (told.get(name) !== value) news.push(name === "" ? `active: ${value || "no step"}` : `${name} ${value}`);
        told = now;
        if (news.length > 0) say(`Row ${session.at}: ${news.slice(0, 12).join("; ")}.`);
    }

    function say(text) { byId("announce").textContent = clean(text); }

    // --- files ------------------------------------------------------------------------------------------------------------------------

    function save(name, text) {
        const link = make("a", { download: name, href: URL.createObjectURL(new Blob([text], { type: "text/csv" })) });
        link.click();
        setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    }

    // Plays a stimulus from the reset on; reports the first cell that differs from the expected values of a trace.
    function load(name, text) {
        const note = byId("loaded");
        note.className = "";
        try {
            const rows = Grafsynth.readStimulus(data, text);
            reset();
            let different = null;
            let compared = 0;
            for (const row of rows) {
                session.react(row.values, row.dt);
                if (row.expected.size === 0 || different) continue;
                const cells = machine.row();
                data.columns.slice(1).forEach(([column], at) => {
                    const expected = row.expected.get(column);
                    if (expected === undefined || different) return;
                    compared += 1;
                    if (String(cells[at]) !== expected) different = `row ${session.at}, ${column}: expected ${expected}, found ${cells[at]}`;
                });
            }
            note.textContent = clean(`${name}: ${rows.length} rows played` + (different ? `; different: ${different}` : compared > 0 ? `; ${compared} expected cells are equal` : ""));
            if (different) note.className = "bad";
            show(session.rows.length);
        } catch (error) {
            note.className = "bad";
            note.textContent = clean(`${name}: ${error.message}`);
        }
    }

    // --- the reference ----------------------------------------------------------------------------------------------------------------

    // What makes the page not trustworthy.
    let broken = "";

    function compareWithReference() {
        const steps = Grafsynth.repeat(data);
        const note = byId("reference");
        const turn = () => {
            const end = performance.now() + 10;
            try {
                while (performance.now() < end) {
                    const { done, value } = steps.next();
                    if (!done) continue;
                    if (value.different !== null) throw new Error(`reaction ${value.different} of the reference run gives ${value.row}`);
                    note.textContent = value.compared > 0 ? `equal to the reference in ${value.compared} reactions` : "not compared with the reference: it has no reactions";
                    note.classList.toggle("good", value.compared > 0);
                    return;
                }
            } catch (error) {
                broken = `not equal to the reference: ${error.message}`;
                note.textContent = "not equal to the reference";
                drawBars();
                return;
            }
            setTimeout(turn, 0);
        };
        turn();
    }

    // --- keys -------------------------------------------------------------------------------------------------------------------------

    function slower(by) {
        const speed = byId("speed");
        speed.value = Math.min(Math.max(Number(speed.value) + by, 0), SPEEDS.length - 1);
    }

    // Key, what it does, and the words for the list of keys.
    const COMMANDS = [
        ["r", () => { stop(); react(); }, "one reaction"],
        ["m", () => { stop(); microStep(); }, "one micro-step"],
        ["p", () => (running === null ? start() : stop()), "run or pause"],
        ["t", () => { stop(); toThreshold(); }, "let time pass to the next timer threshold"],
        ["x", reset, "reset"],
        ["ArrowLeft", () => show(session.at - 1), "previous row"],
        ["ArrowRight", () => show(session.at + 1), "next row"],
        ["Home", () => show(0), "first row"],
        ["End", () => show(session.rows.length), "last row"],
        ["+", () => slower(1), "faster"],
        ["-", () => slower(-1), "slower"],
    ];
    const KEY_SIGNS = { ArrowLeft: "←", ArrowRight: "→" };

    document.addEventListener("keydown", (event) => {
        if (event.ctrlKey || event.altKey || event.metaKey || event.defaultPrevented) return;
        const target = event.target;
        if (target.matches("textarea, select, input[type=number], input[type=range]")) {
            if (event.key === "Escape") target.blur();
            return;
        }
        // The arrows scroll what has the focus.
        if (["drawing", "wave"].includes(target.id) && (event.key.startsWith("Arrow") || ["Home", "End"].includes(event.key))) return;
        const command = COMMANDS.find(([key]) => key === event.key);
        const input = inputs.find((one) => keyOf.get(one) === event.key);
        if (!command && !input) return;
        event.preventDefault();
        if (command) command[1]();
        else if (!event.repeat) pressed(input);
    });

    // --- start ------------------------------------------------------------------------------------------------------------------------

    function fill(id, items, section) {
        byId(id).replaceChildren(...items);
        if (items.length === 0) byId(section || id).closest("section").hidden = true;
    }

    byId("facts").textContent = `${data.evolution === "single" ? "one micro-step per reaction" : data.evolution}; conflicts: ${data.policy}; tick ${duration(1)}`;
    byId("speed").append(...SPEEDS.map((speed, at) => make("option", { value: at }, speed === Infinity ? "fastest" : `${speed} / s`)));
    byId("speed").value = 1;
    byId("dt").max = data.maxDt;
    fill("inputs", inputs.map(makeInput));
    fill("outputs", results.map(makeResult));
    fill("outline", outline(null));
    if (svg) {
        // A drawing that is a little too wide is made smaller; a very wide one would be illegible, and is scrolled.
        const [wide, room] = [Number(svg.getAttribute("width")), byId("drawing").clientWidth];
        if (wide > room && wide * 0.6 <= room) byId("fit").setAttribute("aria-pressed", byId("drawing").classList.toggle("fit"));
        byId("legend").textContent = "● active · ▷ enabled, waits · ▶ fires in the next reaction · ✓ fired in this one";
    } else {
        // Without a drawing, the list of steps takes its place.
        byId("drawing").append(byId("outline"));
        byId("steps-section").hidden = true;
        byId("fit").hidden = true;
        byId("drawing").setAttribute("aria-label", "Steps of the chart");
        byId("legend").textContent = "● active · ○ not active";
    }
    const click = (id, action) => byId(id).addEventListener("click", action);
    for (const [id, key] of [["react", "r"], ["micro", "m"], ["run", "p"], ["threshold", "t"], ["reset", "x"], ["first", "Home"], ["back", "ArrowLeft"], ["forward", "ArrowRight"], ["last", "End"]]) {
        click(id, COMMANDS.find(([one]) => one === key)[1]);
        byId(id).setAttribute("aria-keyshortcuts", key);
        if (key.length === 1) byId(id).append(make("kbd", { "aria-hidden": "true" }, key));
    }
    byId("scrub").addEventListener("input", () => show(Number(byId("scrub").value)));
    byId("dt").addEventListener("change", () => draw());
    click("fit", () => byId("fit").setAttribute("aria-pressed", byId("drawing").classList.toggle("fit")));
    click("save-stimulus", () => save("stimulus.csv", session.stimulus()));
    click("save-trace", () => save("trace.csv", Grafsynth.trace(data, session.rows)));
    byId("load").addEventListener("change", async () => {
        const [file] = byId("load").files;
        if (file) load(file.name, await file.text());
        byId("load").value = "";
    });
    byId("recording").closest("details").addEventListener("toggle", () => draw());
    const keys = COMMANDS.map(([key, , what]) => [KEY_SIGNS[key] || key, what]);
    for (const input of inputs) if (keyOf.get(input)) keys.push([keyOf.get(input), input.type ? `set ${input.name}` : input.kind === "event" ? `raise ${input.name}` : `switch ${input.name}`]);
    keys.push(["Esc", "leave a field"]);
    byId("keys").append(...keys.map(([key, what]) => make("div", {}, make("dt", {}, make("kbd", {}, key)), make("dd", {}, what))));
    new ResizeObserver(() => drawWave()).observe(byId("wave"));
    logCalls();
    draw();
    compareWithReference();
})();
