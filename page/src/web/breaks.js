// Breakpoints: running stops when one of the steps becomes active, or when one of the conditions becomes true.

// The steps, and the conditions with their text and value.
const stepBreaks = new Set();
const conditionBreaks = [];

// --- conditions ---------------------------------------------------------------------------------------------------------------------------

// The names that a condition may contain: the columns of a trace, steps (`p2` or `p2.active`, `p2.t` in ticks), and transitions (`t1.fired`).
const readers = new Map();
data.transitions.forEach((one, at) => readers.set(`${one.name}.fired`, () => (machine.fired.includes(at) ? 1 : 0)));
data.steps.forEach((step, at) => {
    const isActive = () => (machine.isActive(at) ? 1 : 0);
    for (const name of [step.name, `${step.name}.active`]) readers.set(name, isActive);
    if (step.time !== null) readers.set(`${step.name}.t`, () => machine.cells[machine.places[step.time]]);
});
for (const [name, kind, id, element] of data.columns) {
    if (kind === "input") readers.set(name, () => machine.inputs[id]);
    if (kind === "output") readers.set(name, () => Number(machine.outputs[id]));
    if (kind === "var") readers.set(name, () => (id === null ? 0 : machine.cells[machine.places[id] + element]));
    if (kind === "fault") readers.set(name, () => machine.fault);
}

const LEVELS = [["or", "|"], ["and", "&"], ["=", "<>", "<", "<=", ">", ">="], ["+", "-"], ["*"]];
const OPERATORS = {
    "or": (a, b) => a || b, "|": (a, b) => a || b, "and": (a, b) => a && b, "&": (a, b) => a && b,
    "=": (a, b) => a === b, "<>": (a, b) => a !== b, "<": (a, b) => a < b, "<=": (a, b) => a <= b, ">": (a, b) => a > b, ">=": (a, b) => a >= b,
    "+": (a, b) => a + b, "-": (a, b) => a - b, "*": (a, b) => a * b,
};
const TOKEN = /\s*(?:(\d+)|([\p{L}_][\p{L}\p{N}_]*(?:\.[\p{L}_][\p{L}\p{N}_]*|\[\d+\])*)|(<>|<=|>=|[-=<>+*()&|!]))/uy;

// Reads a condition; returns its value as a function, or throws an error with a key.
function readCondition(text) {
    const tokens = [];
    TOKEN.lastIndex = 0;
    while (text.slice(TOKEN.lastIndex).trim() !== "") {
        const [at, found] = [TOKEN.lastIndex, TOKEN.exec(text)];
        if (!found) throw Grafsynth.problem("badSign", { text: text.slice(at).trim().slice(0, 20) });
        tokens.push(found[1] || found[2] || found[3]);
    }
    let next = 0;
    const take = (token) => tokens[next] === token && ++next > 0;
    const unexpected = () => Grafsynth.problem(next < tokens.length ? "badSign" : "badEnd", { text: tokens[next] });
    const operand = (depth) => {
        if (depth > 50) throw unexpected();
        if (take("not") || take("!")) {
            const value = operand(depth + 1);
            return () => (value() ? 0 : 1);
        }
        if (take("-")) {
            const value = operand(depth + 1);
            return () => -value();
        }
        if (take("(")) {
            const value = level(0, depth + 1);
            if (!take(")")) throw unexpected();
            return value;
        }
        const token = tokens[next];
        if (token === undefined || !/^[\p{L}\p{N}_]/u.test(token) || ["and", "or", "not"].includes(token)) throw unexpected();
        next += 1;
        if (/^\d/.test(token)) return () => Number(token);
        const value = token === "true" ? () => 1 : token === "false" ? () => 0 : readers.get(token);
        if (!value) throw Grafsynth.problem("badName", { name: token });
        return value;
    };
    const level = (n, depth) => {
        if (n === LEVELS.length) return operand(depth);
        let value = level(n + 1, depth);
        while (LEVELS[n].includes(tokens[next])) {
            const [left, operator, right] = [value, OPERATORS[tokens[next++]], level(n + 1, depth)];
            value = () => Number(operator(left(), right()));
        }
        return value;
    };
    const value = level(0, 0);
    if (next < tokens.length) throw unexpected();
    return value;
}

// --- stopping -----------------------------------------------------------------------------------------------------------------------------

// Before a run: the machine keeps the states of each reaction only if a step needs them.
function armBreaks() {
    machine.observed = stepBreaks.size > 0;
    for (const one of conditionBreaks) one.was = one.value();
}

// After a reaction: the breakpoint that stops, with its micro-step if that is not the end of the reaction; null if there is none.
function brokenAt() {
    for (const step of stepBreaks) {
        const states = [machine.before, ...machine.frames.slice(1).map((frame) => frame.before), machine.cells];
        for (let n = 1; n < states.length; n++) {
            if (!machine.isActive(step, states[n]) || machine.isActive(step, states[n - 1])) continue;
            return { text: data.steps[step].name, micro: n < states.length - 1 ? n : null };
        }
    }
    let found = null;
    for (const one of conditionBreaks) {
        const now = one.value();
        if (now && !one.was) found ||= { text: one.text, micro: null };
        one.was = now;
    }
    return found;
}

function stopAt({ text, micro: at }) {
    stop();
    frames = at === null ? [] : session.frames();
    micro = at;
    note("stopped", text);
    redraw();
}

// --- the list -----------------------------------------------------------------------------------------------------------------------------

function toggleStep(step) {
    if (!stepBreaks.delete(step)) stepBreaks.add(step);
    for (const group of stepGroups[step]) {
        signsOf(group, stepSigns);
        group.classList.toggle("stops", stepBreaks.has(step));
    }
    stepRows.get(step)?.stop.setAttribute("aria-pressed", stepBreaks.has(step));
    drawBreaks();
}

function drawBreaks() {
    const row = (text, remove) => {
        const button = make("button", { type: "button", "aria-label": word("removeBreak", { name: text }) }, "✕");
        button.addEventListener("click", remove);
        return make("li", {}, make("span", { class: "who" }, "⬣ ", named(text)), button);
    };
    const rows = [...stepBreaks].map((step) => row(data.steps[step].name, () => toggleStep(step)));
    for (const one of conditionBreaks) {
        rows.push(row(one.text, () => {
            conditionBreaks.splice(conditionBreaks.indexOf(one), 1);
            drawBreaks();
        }));
    }
    byId("breaks").replaceChildren(...rows);
    if (running !== null) armBreaks();
}

byId("break-form").addEventListener("submit", (event) => {
    event.preventDefault();
    const field = byId("break-text");
    const text = field.value.trim();
    byId("break-error").textContent = "";
    if (text === "") return;
    try {
        conditionBreaks.push({ text, value: readCondition(text), was: 0 });
        field.value = "";
        drawBreaks();
    } catch (error) {
        byId("break-error").textContent = clean(told(error));
    }
});
