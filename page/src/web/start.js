// The start: the panel is made, again for each language, and everything gets its action.

function fill(id, items) {
    byId(id).replaceChildren(...items);
    if (items.length === 0) byId(id).closest("section").hidden = true;
}

const COMMAND_OF = {
    react: "r", micro: "m", run: "p", threshold: "t", reset: "x", first: "Home", back: "ArrowLeft", forward: "ArrowRight", last: "End",
};
const stepList = svg ? byId("outline") : make("ul", { id: "outline" });

// Of a longer list of steps, only what is in sight has a layout.
const MANY_STEPS = 200;

// Everything that contains words.
function build() {
    fillWords();
    drawn.clear();
    litRows = new Set();
    const mode = data.stable === null ? word("single") : word("stable", { limit: data.stable });
    byId("facts").textContent = word("facts", { mode, policy: data.policy, tick: duration(1) });
    const speed = byId("speed").value || realTime;
    byId("speed").replaceChildren(...SPEEDS.map((one, at) => make("option", { value: at }, one === Infinity ? word("fastest") : `${one} / s`)));
    byId("speed").value = speed;
    fill("inputs", inputs.map(makeInput));
    fill("outputs", results.map(makeResult));
    buildScene();
    stepList.replaceChildren(...outline(null));
    stepList.classList.toggle("many", data.steps.length > MANY_STEPS);
    if (stepList.children.length === 0) byId("steps-section").hidden = true;
    const keys = COMMANDS.map(([key, , what]) => [KEY_SIGNS[key] || key, word(what)]);
    for (const input of inputs) {
        if (!keyOf.get(input)) continue;
        const { name } = input;
        const what = input.type ? word("keySet", { name }) : input.kind === "event" ? word("keyRaise", { name }) : word("keySwitch", { name });
        keys.push([keyOf.get(input), what]);
    }
    keys.push(["Esc", word("keyEscape")]);
    byId("keys").replaceChildren(...keys.map(([key, what]) => make("div", {}, make("dt", {}, make("kbd", {}, key)), make("dd", {}, what))));
    byId("legend").textContent = word(svg ? "legend" : "legendSteps");
    if (!svg) byId("drawing").setAttribute("aria-label", word("steps"));
    drawRunning();
    drawVerdict();
    drawForced();
    drawBreaks();
    note(...noted);
    redraw();
}

function fit() {
    byId("fit").setAttribute("aria-pressed", byId("drawing").classList.toggle("fit"));
    areaChanged();
}

byId("language").append(...Object.entries(LANGUAGES).map(([tag, name]) => make("option", { value: tag, lang: tag }, name)));
byId("language").value = language;
byId("language").addEventListener("change", () => {
    language = byId("language").value;
    build();
});
byId("dt").max = data.maxDt;
byId("queue-section").hidden = !hasQueue;
makeSource();
drive(0);
if (svg) {
    // A drawing that is a little too wide is made smaller; a very wide one would be illegible, and is scrolled.
    const [wide, room] = [number(svg, "width"), byId("drawing").clientWidth];
    if (wide > room && wide * 0.6 <= room) fit();
} else {
    // Without a drawing, the list of steps takes its place.
    byId("outline").replaceWith();
    byId("drawing").append(stepList);
    byId("steps-section").hidden = true;
    byId("fit").hidden = true;
}
const click = (id, action) => byId(id).addEventListener("click", action);
for (const [id, key] of Object.entries(COMMAND_OF)) {
    click(id, COMMANDS.find(([one]) => one === key)[1]);
    byId(id).setAttribute("aria-keyshortcuts", key);
    if (key.length === 1) byId(id).append(make("kbd", { "aria-hidden": "true" }, key));
}
byId("scrub").addEventListener("input", () => {
    isDragged = true;
    show(Number(byId("scrub").value));
});
byId("scrub").addEventListener("change", () => {
    isDragged = false;
    redraw();
});
byId("dt").addEventListener("input", readTicks);
click("fit", fit);
click("save-stimulus", () => save("stimulus.csv", session.stimulus()));
click("save-trace", () => save("trace.csv", session.trace()));
click("link", makeLink);
byId("load").addEventListener("change", async () => {
    const [file] = byId("load").files;
    if (file) load(file.name, await file.text());
    byId("load").value = "";
});
byId("recording").closest("details").addEventListener("toggle", redraw);
// A step of the drawing is a breakpoint after a click; the list of steps has a button for each.
byId("drawing").addEventListener("click", (event) => {
    const key = event.target.closest("[data-element]")?.dataset.element;
    const step = data.steps.findIndex((one) => one.key === key);
    if (svg && step >= 0 && stepGroups[step].length > 0) toggleStep(step);
});
for (const id of ["outline", "waits"]) {
    const list = id === "outline" ? stepList : byId(id);
    list.addEventListener("pointerover", (event) => point(event.target.closest("[data-element]")?.dataset.element ?? null));
    list.addEventListener("pointerleave", () => point(null));
}
addEventListener("hashchange", openLink);
new ResizeObserver(areaChanged).observe(byId("drawing"));
build();
showArea();
noteCalls();
draw();
compareWithReference();
reopen();
openLink();
