// What is shown, running, and the keys.

// --- what is shown ----------------------------------------------------------------------------------------------------------------

// The values on the panel, which the next reaction reads.
const panel = data.inputs.map(Grafsynth.zero);
// The micro-step that is shown, of those of the reaction; null after the reaction.
let micro = null;
let frames = [];
// A timer of the browser while the chart runs.
let running = null;

// The ticks of a reaction.
let tickCount = 1;
const ticks = () => tickCount;

function readTicks() {
    const value = Math.floor(Number(byId("dt").value));
    tickCount = Number.isFinite(value) ? Math.min(Math.max(value, 0), data.maxDt) : 1;
    redraw();
}

// The state that is shown: that before a micro-step, or the current one.
const shownCells = () => (micro === null ? machine.cells : frames[micro].before);
const firedNow = () => (micro === null ? machine.fired : frames[micro].fired);

// The steps that are active in a state.
function activeSteps(cells) {
    const active = new Set();
    for (let step = 0; step < data.steps.length; step++) if (machine.isActive(step, cells)) active.add(step);
    return active;
}

// --- reactions --------------------------------------------------------------------------------------------------------------------

function react(dt = ticks()) {
    micro = null;
    drive(dt);
    session.react(panel, dt);
    noteCalls();
    for (const input of events) if (!forced.has(input.id)) panel[input.id] = 0;
    redraw();
}

function microStep() {
    if (micro === null) {
        react();
        frames = session.frames();
        micro = frames.length > 0 ? 0 : null;
    } else {
        micro = micro + 1 < frames.length ? micro + 1 : null;
    }
    redraw();
}

function toThreshold() {
    const left = session.toThreshold(panel);
    if (left === null) say(word("noTimer"));
    else react(Math.min(left, data.maxDt));
}

function reset() {
    stop();
    note(null);
    micro = null;
    session.clear();
    drive(0);
    byId("log").replaceChildren();
    calls = [];
    noteCalls();
    redraw();
}

function show(at) {
    stop();
    note(null);
    micro = null;
    session.show(at);
    // The panel shows the inputs of the row, so that the next reaction continues from there.
    if (session.at > 0) {
        session.inputsOf(session.at).forEach((value, id) => { if (!forced.has(id)) panel[id] = data.inputs[id].kind === "event" ? 0 : value; });
    } else drive(0);
    redraw();
}

// --- running ----------------------------------------------------------------------------------------------------------------------

// Reactions per second; Infinity: as many as fit into one frame of the browser.
const SPEEDS = [1, 5, 10, 100, 1000, Infinity];

// The time for the reactions between two pictures, in ms. If pictures take long, reactions may take twice that time, so that a large chart keeps its speed.
const LEAST = 12;
const MOST = 60;

// A reaction of a run; true if a breakpoint ends the run.
function reactInRun() {
    react();
    const found = brokenAt();
    if (found) stopAt(found);
    return found !== null;
}

function start() {
    let last = performance.now();
    let owed = 0;
    let used = 0;
    note(null);
    armBreaks();
    const turn = (now) => {
        const speed = SPEEDS[Number(byId("speed").value)];
        const passed = now - last;
        owed = Math.min(owed + passed / 1000 * speed, speed);
        last = now;
        const begin = performance.now();
        const end = begin + Math.min(Math.max(LEAST, 2 * (passed - used)), MOST);
        while ((owed >= 1 || speed === Infinity) && performance.now() < end) {
            if (reactInRun()) return;
            owed -= 1;
        }
        if (speed === Infinity) owed = 0;
        used = performance.now() - begin;
        if (isDue || (isSlowDue && performance.now() > nextSlow)) draw();
        running = requestAnimationFrame(turn);
    };
    running = requestAnimationFrame(turn);
    drawRunning();
}

function stop() {
    if (running === null) return;
    cancelAnimationFrame(running);
    running = null;
    machine.observed = false;
    drawRunning();
    isDue = false;
    redraw();
}

function drawRunning() {
    const button = byId("run");
    button.setAttribute("aria-pressed", running !== null);
    button.firstChild.textContent = word(running === null ? "run" : "pause");
}

// --- everything -------------------------------------------------------------------------------------------------------------------

const emergency = data.emergency ? machine.evaluator(data.emergency) : null;
const assumptions = data.assumptions.map((one) => ({ ...one, holds: machine.evaluator(one.value) }));

function drawBars() {
    const bars = [];
    const add = (text) => bars.push(make("p", { class: "bar bad" }, text));
    if (broken) add(word(...broken));
    if (machine.fault) add(word("fault"));
    if (emergency && emergency(machine.inputs, 0)) add(word("emergency"));
    for (const one of assumptions) if (one.holds(machine.inputs, 0)) add(word("violates", { condition: one.never }));
    if (isNew(byId("bars"), bars.map((bar) => bar.textContent).join("\n"))) byId("bars").replaceChildren(...bars);
}

// Lists and the waveform are drawn a few times per second while the chart runs or the slider is dragged: nobody can read faster.
const SLOW = 200;
let nextSlow = 0;
// Whether something has changed since the last picture, and since the lists were drawn.
let isDue = false;
let isSlowDue = false;
let isDragged = false;

// Draws once before the next picture of the browser, whatever happens until then. A run looks for itself.
function redraw() {
    if (isDue) return;
    isDue = true;
    isSlowDue = true;
    if (running === null) requestAnimationFrame(() => { if (isDue) draw(); });
}

function draw() {
    isDue = false;
    const cells = shownCells();
    const active = activeSteps(cells);
    const states = transitionStates(cells, active, firedNow());
    drawChart(cells, active, states);
    drawInputs();
    drawResults();
    drawScene(cells);
    drawBars();
    drawClock();
    drawQueue(cells);
    if ((running !== null || isDragged) && performance.now() < nextSlow) {
        if (running === null) setTimeout(redraw, SLOW);
        return;
    }
    nextSlow = performance.now() + SLOW;
    isSlowDue = false;
    drawWaits(states, cells);
    drawSteps(cells, active);
    drawCalls();
    drawWave();
    if (running !== null || isDragged) return;
    const left = session.toThreshold(panel);
    byId("threshold").title = left === null ? word("noTimer") : word("untilChange", { time: duration(left) });
    announce(active);
    if (byId("recording").closest("details").open) byId("recording").value = session.stimulus();
}

function drawClock() {
    const scrub = byId("scrub");
    const [at, end] = [session.at, session.length];
    const time = duration(session.time());
    const text = micro === null ? word("clock", { at, end, time }) : word("clockMicro", { at, end, time, micro: micro + 1, n: frames.length });
    if (!isNew(scrub, text)) return;
    scrub.max = end;
    scrub.value = at;
    byId("clock").textContent = text;
    scrub.setAttribute("aria-valuetext", text);
    for (const [id, isIdle] of [["first", at === 0], ["back", at === 0], ["forward", at === end], ["last", at === end]]) byId(id).disabled = isIdle;
}

// Tells a screen reader what is new: the situation, and the outputs that changed.
let announced = new Map();
function announce(active) {
    const now = new Map([["", [...active].map((at) => data.steps[at]).filter((step) => step.listed).map((step) => step.name).join(", ")]]);
    for (const result of [...results, ...quantities]) now.set(result.name, String(result.read()));
    const news = [];
    for (const [name, value] of now) {
        if (announced.get(name) === value) continue;
        news.push(name === "" ? word("activeAre", { steps: value || word("noStep") }) : `${name} ${value}`);
    }
    announced = now;
    if (news.length > 0) say(`${word("row", { row: session.at })}: ${news.slice(0, 12).join("; ")}.`);
}

function say(text) { byId("announce").textContent = clean(text); }

// What the page has to say about a row or a breakpoint: a key of a sentence and what it is about; null for nothing.
let noted = [null];
function note(key, what = "") {
    noted = [key, what];
    byId("note").replaceChildren(...(key === null ? [] : phrase(key, { what: typeof what === "number" ? String(what) : named(what) })));
}

// --- keys -------------------------------------------------------------------------------------------------------------------------

function slower(by) {
    const speed = byId("speed");
    speed.value = Math.min(Math.max(Number(speed.value) + by, 0), SPEEDS.length - 1);
}

// Key, what it does, and the key of its words in the list of keys.
const COMMANDS = [
    ["r", () => { stop(); react(); }, "keyReact"],
    ["m", () => { stop(); microStep(); }, "keyMicro"],
    ["p", () => (running === null ? start() : stop()), "keyRun"],
    ["t", () => { stop(); toThreshold(); }, "keyThreshold"],
    ["x", reset, "keyReset"],
    ["ArrowLeft", () => show(session.at - 1), "back"],
    ["ArrowRight", () => show(session.at + 1), "forward"],
    ["Home", () => show(0), "first"],
    ["End", () => show(session.length), "last"],
    ["+", () => slower(1), "faster"],
    ["-", () => slower(-1), "slower"],
];
const KEY_SIGNS = { ArrowLeft: "←", ArrowRight: "→" };

document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.defaultPrevented) return;
    const target = event.target;
    if (target.matches("textarea, select, input[type=number], input[type=range], input[type=text]")) {
        if (event.key === "Escape") target.blur();
        return;
    }
    // The arrows scroll what has the focus.
    if (["drawing", "wave", "source"].includes(target.id) && (event.key.startsWith("Arrow") || ["Home", "End"].includes(event.key))) return;
    const command = COMMANDS.find(([key]) => key === event.key);
    const input = inputs.find((one) => keyOf.get(one) === event.key);
    if (!command && !input) return;
    event.preventDefault();
    if (command) command[1]();
    else if (!event.repeat) pressed(input);
});
