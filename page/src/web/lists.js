// The lists beside the drawing: what each transition waits for, the steps, and the calls of extern actions.

// --- what waits for what ------------------------------------------------------------------------------------------------------------------

const factors = data.transitions.map((transition) => transition.waits.map((factor) => ({
    ...factor,
    holds: factor.value === null ? null : machine.evaluator(factor.value),
})));
const transitionsFrom = grouped(data.transitions.flatMap((one, at) => one.requires.map((step) => [at, step])));
const sources = data.transitions.flatMap((one, at) => (one.requires.length === 0 ? [at] : []));

// `3 s in p2 (1.2 s left)` for a time, otherwise the text of the condition; as texts and elements.
function reason(factor, cells) {
    if (!factor.time) return [named(factor.text)];
    const [step, sign, limit] = factor.time;
    const { name, time } = data.steps[step];
    if (sign !== ">=") return [named(name), ` ${sign} ${duration(limit)}`];
    const left = time === null ? 0 : limit - cells[machine.places[time]];
    return phrase(left > 0 ? "timeLeft" : "timeIn", { time: duration(limit), step: named(name), left: duration(left) });
}

// For each transition that fired, or of whose steps at least one is active: whether it fired, is fireable (`ready`), enabled or nearly enabled, and the steps
// and factors that it waits for.
function transitionStates(cells, active, fired) {
    const states = new Map();
    for (const at of fired) states.set(at, { state: "fired", steps: [], factors: [] });
    const dt = ticks();
    const look = (at) => {
        if (states.has(at)) return;
        const missing = data.transitions[at].requires.filter((step) => !active.has(step));
        const waits = [];
        let isKnown = true;
        for (const factor of factors[at]) {
            const holds = factor.holds ? factor.holds(panel, dt, cells) : null;
            if (holds === null) isKnown = false;
            // A step that is not active has no time yet.
            if (holds === 0 && !(factor.time && missing.includes(factor.time[0]))) waits.push(factor);
        }
        const isReady = missing.length === 0 && waits.length === 0 && isKnown && micro === null;
        states.set(at, { state: isReady ? "ready" : missing.length === 0 ? "enabled" : "near", steps: missing, factors: waits });
    };
    sources.forEach(look);
    for (const step of active) for (const at of transitionsFrom.get(step) || []) look(at);
    return states;
}

const WAITS_SHOWN = 60;

function drawWaits(states, cells) {
    const rows = [];
    for (const at of [...states.keys()].sort((a, b) => a - b).slice(0, WAITS_SHOWN)) {
        const { state, steps, factors } = states.get(at);
        const transition = data.transitions[at];
        const from = transition.requires.map((step) => data.steps[step].name).join(", ");
        const row = make("li", { class: state }, named(transition.name), " ");
        row.dataset.element = transition.key;
        if (from) row.append(make("small", {}, ...phrase("from", { steps: named(from) })), " ");
        const waits = [...steps.map((step) => phrase("stepOf", { step: named(data.steps[step].name) })), ...factors.map((factor) => reason(factor, cells))];
        row.append(make("br"), state === "near" ? "" : `${SIGNS[state]} `, word(waits.length > 0 ? "state-waits" : `state-${state}`));
        waits.forEach((one, n) => row.append(n === 0 ? " " : ` ${word("and")} `, ...one));
        rows.push(row);
    }
    if (rows.length === 0) rows.push(make("li", {}, word("noTransition")));
    if (isNew(byId("waits"), rows.map((row) => row.className + row.textContent).join("\n"))) byId("waits").replaceChildren(...rows);
}

// --- list of steps ------------------------------------------------------------------------------------------------------------------------

const childrenOf = grouped(data.steps.flatMap((step, at) => (step.hidden ? [] : [[at, step.parent]])));
const stepRows = new Map();

function outline(parent) {
    return (childrenOf.get(parent) || []).map((at) => {
        const step = data.steps[at];
        const text = make("span", { class: "state" }, named(step.name));
        const note = make("small");
        const stopName = word("breakAt", { name: step.name });
        const stop = make("button", { type: "button", class: "stopper", "aria-pressed": stepBreaks.has(at), "aria-label": stopName }, "⬣");
        stop.addEventListener("click", () => toggleStep(at));
        const row = make("li", { "data-element": step.key }, stop, text, " ", ...(step.label ? [make("small", { dir: "auto" }, step.label), " "] : []), note);
        stepRows.set(at, { text, note, stop });
        nameStep(at, false);
        const inner = outline(at);
        if (inner.length > 0) row.append(make("ul", {}, ...inner));
        return row;
    });
}

function nameStep(at, isActive) {
    const step = data.steps[at];
    stepRows.get(at).text.setAttribute("aria-label", `${clean(step.name)}, ${word(`kind-${step.kind}`)}, ${word(isActive ? "active" : "inactive")}`);
}

// The rows that show an active step.
let litRows = new Set();

function drawSteps(cells, active) {
    for (const at of litRows) {
        if (active.has(at)) continue;
        stepRows.get(at).text.classList.remove("active");
        nameStep(at, false);
        write(stepRows.get(at).note, "");
    }
    const now = new Set();
    for (const at of active) {
        const row = stepRows.get(at);
        if (!row) continue;
        now.add(at);
        write(row.note, timeOf(at, cells));
        if (litRows.has(at)) continue;
        row.text.classList.add("active");
        nameStep(at, true);
    }
    litRows = now;
}

// --- calls of extern actions --------------------------------------------------------------------------------------------------------------

const CALLS_SHOWN = 100;
// The latest calls, not yet in the list.
let calls = [];

function noteCalls() {
    for (const [what, values] of machine.effects) {
        calls.push([session.at, values ? `${data.outputs[what].name}(${values.join(", ")})` : word("codeNotRun", { language: what })]);
    }
    if (calls.length > 2 * CALLS_SHOWN) calls = calls.slice(-CALLS_SHOWN);
}

function drawCalls() {
    if (calls.length === 0) return;
    byId("log-section").hidden = false;
    const log = byId("log");
    const rows = calls.slice(-CALLS_SHOWN).reverse().map(([row, call]) => make("li", {}, make("small", {}, `${word("row", { row })} `), named(call)));
    calls = [];
    log.prepend(...rows);
    while (log.children.length > CALLS_SHOWN) log.lastChild.remove();
}
