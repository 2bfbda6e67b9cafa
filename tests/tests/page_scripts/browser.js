// Uses pages in a browser as a person does: `node browser.js CHROMIUM`, in a folder with the pages of the tests, prints what was found as JSON.
const files = require("fs");
const path = require("path");
const { Chromium } = require("./chromium.js");

const shown = (id) => `document.getElementById("${id}").textContent`;
const address = (name) => `file://${path.resolve(name)}`;
// After the next picture.
const PICTURE = "new Promise((done) => requestAnimationFrame(() => setTimeout(done, 0)))";

function expect(found, expected, what) {
    if (JSON.stringify(found) !== JSON.stringify(expected)) throw new Error(`${what}: expected ${JSON.stringify(expected)}, found ${JSON.stringify(found)}`);
}

// The names of the active steps, as the list of steps shows them.
const ACTIVE = `[...document.querySelectorAll("#outline .active bdi")].map((one) => one.textContent).join(" ")`;

// The truck loads and returns, with the keyboard only; the recording and its trace are compared with the simulator.
async function truck(tab) {
    await tab.open(address("truck.html"));
    await tab.until(`document.getElementById("reference").classList.contains("good")`);
    const reference = await tab.value(shown("reference"));
    // The keys 1 to 4 are the inputs m, b, p and a; each change is a reaction.
    for (const [keys, situation] of [["1", "p2"], ["12", "p3"], ["23", "p4"], ["34", "p1"], ["4", "p1"]]) {
        await tab.keys(keys);
        await tab.value(PICTURE);
        expect(await tab.value(ACTIVE), situation, `after the keys ${keys}`);
    }
    await tab.keys("mmrr");
    await tab.key("Home");
    await tab.value(PICTURE);
    expect(await tab.value(ACTIVE), "p1", "row 0");
    await tab.key("ArrowRight");
    await tab.value(PICTURE);
    expect(await tab.value(ACTIVE), "p2", "row 1");
    await tab.key("End");
    return { reference, ...await saved(tab) };
}

// The stimulus and the trace that would be saved as files.
async function saved(tab) {
    await tab.value(`{ const create = URL.createObjectURL; URL.createObjectURL = (blob) => { window.saved = blob; return create.call(URL, blob); }; }`);
    const text = async (id) => {
        await tab.value(`document.getElementById("${id}").click()`);
        return tab.value("saved.text()");
    };
    return { stimulus: await text("save-stimulus"), trace: await text("save-trace") };
}

// Moves the slider to a row.
async function scrub(tab, row) {
    await tab.value(`{ const scrub = document.getElementById("scrub"); scrub.value = ${row}; scrub.dispatchEvent(new Event("input")); scrub.dispatchEvent(new Event("change")); }`);
    await tab.value(PICTURE);
}

// The place of the truck in the picture of its plant.
const TRUCK_AT = `Number(document.querySelector("#plant rect.blue").getAttribute("x"))`;

// One press of a button, and the plant drives the truck through its cycle. Its picture follows, in the past too, and a sensor that fails stays as it is.
async function plant(tab) {
    await tab.open(address("plant.html"));
    await tab.value(PICTURE);
    expect(await tab.value(TRUCK_AT), 10, "the truck at first");
    // 1000 reactions per second.
    await tab.value(`document.getElementById("speed").value = 4`);
    await tab.keys("11");
    for (const situation of ["p3", "p4", "p1"]) await tab.until(`${ACTIVE} === "${situation}"`);
    await tab.key("p");
    const found = await saved(tab);
    const rows = found.trace.trim().split("\n").map((line) => line.split(","));
    const loading = rows.findIndex((row) => row[rows[0].indexOf("steps")] === "p3") - 1;
    await scrub(tab, loading);
    expect([await tab.value(ACTIVE), await tab.value(TRUCK_AT)], ["p3", 110], "at the hopper");
    await scrub(tab, 0);
    expect(await tab.value(TRUCK_AT), 10, "row 0");
    // The first threshold is where the truck leaves the left limit, the second the right limit: 100 units take 500 ticks of 10 ms.
    await tab.value(`document.getElementById("auto").click()`);
    await tab.keys("x1rtt");
    await tab.value(PICTURE);
    expect([await tab.value(ACTIVE), await tab.value(TRUCK_AT)], ["p3", 110], "at the next threshold");
    expect(await tab.value(`${shown("clock")}.includes("5.01 s")`), true, await text(tab, "clock"));
    // The right limit is forced.
    await tab.keys("x2rr");
    await tab.value(PICTURE);
    expect(await text(tab, "forced").then((one) => one.startsWith("⚑ Forced: b.")), true, await text(tab, "forced"));
    expect([await tab.value(ACTIVE), await tab.value(TRUCK_AT) < 15], ["p3", true], "a sensor that fails");
    return found;
}

// The same cycle with the mouse, on the switches of the panel.
async function panel(tab, { truck }) {
    await tab.open(address("truck.html"));
    for (const input of [0, 0, 1, 1, 2, 2, 3, 3]) await tab.press(`#input-${input}`);
    for (const id of ["micro", "micro", "react", "react"]) await tab.press(`#${id}`);
    await tab.value(PICTURE);
    const recording = await tab.value("document.getElementById('recording').closest('details').open = true, new Promise((done) => setTimeout(() => done(document.getElementById('recording').value), 50))");
    expect(recording, truck.stimulus, "the recording of the mouse");
}

// A trace is loaded and played on the drawing, and one with another cell is reported; the slider shows each of its reactions.
async function playing(tab, { truck }) {
    await tab.open(address("truck.html"));
    const load = async (name, content) => {
        files.writeFileSync(name, content);
        const { root } = await tab.send("DOM.getDocument");
        const { nodeId } = await tab.send("DOM.querySelector", { nodeId: root.nodeId, selector: "#load" });
        await tab.send("DOM.setFileInputFiles", { nodeId, files: [path.resolve(name)] });
        await tab.until(`document.getElementById("loaded").textContent.startsWith("${name}: ")`);
        await tab.value(PICTURE);
        return tab.value(shown("loaded"));
    };
    const lines = truck.trace.trim().split("\n");
    const [header, rows] = [lines[0].split(","), lines.length - 2];
    const cells = rows * header.filter((name) => !["scan", "dt", "m", "b", "p", "a"].includes(name)).length;
    expect(await load("trace.csv", truck.trace), `trace.csv: ${rows} rows played. ${cells} expected cells are equal.`, "a loaded trace");
    for (const row of [2, 5, 1, rows]) {
        await scrub(tab, row);
        expect(await tab.value(ACTIVE), lines[row + 1].split(",")[header.indexOf("steps")], `the situation of row ${row}`);
    }
    const spoiled = lines.map((line, at) => (at === 4 ? line.replace("p3", "p4") : line)).join("\n");
    expect(spoiled === lines.join("\n"), false, "row 3 is spoiled");
    expect((await load("spoiled.csv", spoiled)).endsWith("Row 3, steps: expected p4, found p3"), true, await text(tab, "loaded"));
    expect(await load("other.csv", "dt,x\n1,1\n"), "other.csv: line 1: the chart has no input `x`", "a stimulus of another chart");
}

const click = (tab, selector) => tab.value(`document.querySelector(${JSON.stringify(selector)}).click()`);
const text = (tab, id) => tab.value(shown(id));

// Breakpoints on a step and on a condition, a forced input, and the link to a row.
async function debugging(tab) {
    await tab.open(address("truck.html"));
    await click(tab, "#auto");
    await click(tab, "[aria-label='breakpoint at p3']");
    await tab.value(`document.getElementById("speed").value = 5`);
    await tab.keys("12p");
    await tab.until(`document.getElementById("run").getAttribute("aria-pressed") === "false"`);
    await tab.value(PICTURE);
    expect(await tab.value(ACTIVE), "p3", "at the breakpoint");
    expect(await text(tab, "note"), "Stopped at the breakpoint p3.", "the note");
    expect(await tab.value(`document.querySelectorAll("#drawing .stops").length`), 1, "marks in the drawing");
    const condition = async (text) => {
        await tab.value(`document.getElementById("break-text").focus()`);
        await tab.keys(text);
        await tab.key("Enter");
        await tab.key("Escape");
        return tab.value(shown("break-error"));
    };
    expect(await condition("p9 > 1"), "the chart has no step, input, output or variable `p9`", "a wrong name");
    await tab.value(`document.getElementById("break-text").value = ""`);
    expect(await condition("(L or t9) and"), "the chart has no step, input, output or variable `t9`", "a wrong name");
    await tab.value(`document.getElementById("break-text").value = ""`);
    expect(await condition("L = 1 and not (Z | R)"), "", "a condition");
    // A forced input keeps its value in the past.
    await tab.keys("3");
    await click(tab, "[aria-label='force p']");
    await tab.key("Home");
    await tab.value(PICTURE);
    expect(await tab.value(`document.getElementById("input-2").getAttribute("aria-checked")`), "true", "the forced input");
    expect(/^⚑ Forced: p\./.test(await text(tab, "forced")), true, "the mark of forcing");
    await tab.key("End");
    await tab.keys("p");
    await tab.until(`document.getElementById("note").textContent !== ""`);
    await tab.value(PICTURE);
    expect(await text(tab, "note"), "Stopped at the breakpoint L = 1 and not (Z | R).", "the note");
    expect(await tab.value(ACTIVE), "p4", "at the condition");
    const row = await text(tab, "clock");
    await click(tab, "#link");
    await tab.until(`document.getElementById("link-text").value !== ""`);
    const link = await tab.value(`document.getElementById("link-text").value`);
    // The same page, as if the link were opened anew.
    await tab.open("about:blank");
    await tab.open(link);
    await tab.until(`document.getElementById("note").textContent !== ""`);
    await tab.value(PICTURE);
    expect((await text(tab, "note")).includes("is reproduced"), true, await text(tab, "note"));
    expect(await text(tab, "clock"), row, "the row of the link");
    expect(await tab.value(ACTIVE), "p4", "the situation of the link");
    const spoiled = link.split("#")[1].replace(/is=\w+/, "is=0");
    for (const [hash, note] of [["row=77", "carries no recording"], ["row=2&play=xyz", "cannot be read"], [spoiled, "other values"]]) {
        await tab.value(`location.hash = ${JSON.stringify(hash)}`);
        await tab.until(`document.getElementById("note").textContent.includes(${JSON.stringify(note)})`);
    }
}

// A breakpoint at a step that is active only within a reaction shows the micro-step.
async function transient(tab) {
    await tab.open(address("stable.html"));
    await click(tab, "#auto");
    await click(tab, "[aria-label='breakpoint at mid']");
    await tab.keys("1p");
    await tab.until(`document.getElementById("note").textContent !== ""`);
    await tab.value(PICTURE);
    expect(await tab.value(ACTIVE), "mid", "the transient situation");
    expect((await text(tab, "clock")).endsWith("before micro-step 2 of 2"), true, await text(tab, "clock"));
    await tab.keys("m");
    await tab.value(PICTURE);
    expect(await tab.value(ACTIVE), "end", "the end of the reaction");
}

// Pointing at an element marks it in the drawing and in the source; words change with the language, names do not.
async function reading(tab) {
    await tab.open(address("truck.html"));
    const event = `new PointerEvent("pointerover", { bubbles: true })`;
    const over = (selector) => tab.value(`document.querySelector(${JSON.stringify(selector)}).dispatchEvent(${event})`);
    const pointed = (box) => tab.value(`[...document.querySelectorAll("#${box} .pointed")].map((one) => one.textContent.trim()).join("|")`);
    const key = await tab.value(`[...document.querySelectorAll("#source span")].find((one) => one.textContent.startsWith("t2:")).dataset.element`);
    await over(`#drawing [data-element="${key}"] text`);
    expect(await pointed("source"), "t2: p2 -> p3 when b", "the source of a transition");
    await tab.value(`document.querySelector("#drawing .pointed").classList.remove("pointed")`);
    await over("#source pre");
    await over(`#source [data-element="${key}"]`);
    expect((await pointed("drawing")).includes("(t2)"), true, "the drawing of a transition");
    const user = `[...document.querySelectorAll("bdi, .who small, #drawing text, #source")].map((one) => one.textContent).join("|")`;
    const before = await tab.value(user);
    const words = {};
    for (const tag of ["fr", "de", "es", "pt", "en"]) {
        await tab.value(`{ const list = document.getElementById("language"); list.value = "${tag}"; list.dispatchEvent(new Event("change")); }`);
        await tab.value(PICTURE);
        expect(await tab.value("document.documentElement.lang"), tag, "the language");
        words[tag] = await text(tab, "steps-title");
    }
    expect(words, { fr: "Étapes", de: "Schritte", es: "Etapas", pt: "Etapas", en: "Steps" }, "words");
    expect(await tab.value(user), before, "what the user wrote");
    // Each control can be touched.
    const small = `[...document.querySelectorAll("button, select, input:not([type=checkbox]):not(.spoken), summary, .check, .button")].filter((one) => {
        const { width, height } = one.getBoundingClientRect();
        return one.offsetParent && (width < 44 || height < 44);
    }).map((one) => one.outerHTML)`;
    expect(await tab.value(small), [], "controls smaller than 44 pixels");
    // Colours that the system enforces, no motion, and a narrow window: nothing breaks.
    const features = [{ name: "forced-colors", value: "active" }, { name: "prefers-reduced-motion", value: "reduce" }];
    await tab.send("Emulation.setEmulatedMedia", { features });
    await tab.send("Emulation.setDeviceMetricsOverride", { width: 360, height: 740, deviceScaleFactor: 1, mobile: true });
    await tab.value(PICTURE);
    expect(await tab.value("document.documentElement.scrollWidth <= 360"), true, "a narrow window is not scrolled sideways");
    expect(await tab.value(`getComputedStyle(document.querySelector(".lamp i")).transitionDuration`), "0s", "motion");
    await tab.send("Emulation.clearDeviceMetricsOverride");
    return { roles: await roles(tab) };
}

// Role and name of everything that assistive technology finds as a control, a heading, a region or a live region.
async function roles(tab) {
    await tab.send("Accessibility.enable");
    const { nodes } = await tab.send("Accessibility.getFullAXTree");
    const fields = ["button", "checkbox", "combobox", "slider", "spinbutton", "switch", "textbox"];
    const kinds = new Set([...fields, "alert", "group", "heading", "image", "meter", "region", "status", "toolbar"]);
    const value = (one) => (one ? String(one.value) : "");
    const lines = nodes.filter((node) => !node.ignored && kinds.has(value(node.role))).map((node) => `${value(node.role)} ${value(node.name)}`.replace(/\s+/g, " ").trim());
    return lines.join("\n") + "\n";
}

// Events wait in the queue until the next reaction; a forced event stays.
async function queue(tab) {
    await tab.open(address("queue.html"));
    await click(tab, "#auto");
    await tab.keys("1");
    await tab.value(PICTURE);
    const name = await tab.value(`document.querySelector("#inputs bdi").textContent`);
    expect(await text(tab, "queue"), `${name}, raised on the panel`, "the queue");
    await click(tab, ".force");
    await tab.keys("r");
    await tab.value(PICTURE);
    expect((await text(tab, "queue")).includes(`${name}, raised on the panel`), true, "the forced event");
    await click(tab, ".force");
    await tab.keys("r");
    await tab.value(PICTURE);
    expect((await text(tab, "queue")).includes("on the panel"), false, "the event that is no longer forced");
}

async function hostile(tab) {
    await tab.open(address("hostile.html"));
    await tab.until(`document.getElementById("reference").classList.contains("good")`);
    expect(await tab.value("document.title"), "h", "the title");
    expect(await tab.value("document.scripts.length"), 3, "scripts");
    expect(await tab.value("document.images.length"), 0, "images");
    // The source is shown as it is, but for signs that would change the order of its text.
    const source = await tab.value(`document.querySelector("#source pre").textContent`);
    for (const part of ["</script><script>document.title='bad'</script>", "<!-- <img src=x onerror=alert(1)> 😀", "& &lt; '", "مرحبا", "\uFFFDevil"]) {
        expect(source.includes(part), true, `${part} in the source`);
    }
    const spans = await tab.value(`[...document.querySelectorAll("#source pre > span")].map((one) => one.textContent.slice(0, 6))`);
    expect(spans, ["initia", "step r", "s -> r", "r -> s"], "elements of the source after signs of several bytes");
}

// A page that is loaded again has its session, unless it has become the page of a chart with other inputs.
async function again(tab) {
    files.copyFileSync("truck.html", "kept.html");
    const reload = async () => {
        const loaded = new Promise((resolve) => { tab.loaded = resolve; });
        await tab.send("Page.reload");
        await loaded;
        await tab.value(PICTURE);
    };
    await tab.open(address("kept.html"));
    await reload();
    expect(await text(tab, "note"), "", "the note of a page without a past");
    for (const keys of ["1", "12", "23"]) await tab.keys(keys);
    await tab.key("ArrowLeft");
    await tab.value(PICTURE);
    const [clock, active] = [await text(tab, "clock"), await tab.value(ACTIVE)];
    await reload();
    expect(await text(tab, "note"), "Reactions restored: 5.", "the note after F5");
    expect([await text(tab, "clock"), await tab.value(ACTIVE)], [clock, active], "the row after F5");
    // Opened anew, not loaded again.
    await tab.open("about:blank");
    await tab.open(address("kept.html"));
    expect(await tab.value(`document.getElementById("scrub").max`), "0", "reactions of a page that is opened anew");
    await tab.keys("1");
    files.copyFileSync("queue.html", "kept.html");
    await reload();
    expect(await text(tab, "note"), "The chart has changed and no longer accepts the earlier inputs; the session was reset.", "the note of another chart");
    expect(await tab.value(`document.getElementById("scrub").max`), "0", "reactions of another chart");
}

// Each scenario with its page; it gets the results of those before it.
const SCENARIOS = [[truck, "truck"], [panel, "truck"], [playing, "truck"], [plant, "plant"], [debugging, "truck"], [transient, "stable"], [reading, "truck"], [queue, "queue"], [hostile, "hostile"], [again, "kept"]];

(async () => {
    const browser = new Chromium(process.argv[2], path.resolve("profile"));
    await browser.send("Browser.setDownloadBehavior", { behavior: "deny" });
    const results = {};
    for (const [scenario, page] of SCENARIOS) {
        const { name } = scenario;
        const tab = await browser.tab();
        results[name] = await scenario(tab, results);
        expect(tab.problems, [], `${name}: problems in the console`);
        const own = [address(`${page}.html`), "about:blank"];
        expect(tab.requests.filter((one) => !one.startsWith("blob:") && !own.includes(one.split("#")[0])), [], `${name}: requests`);
        await tab.close();
    }
    await browser.close();
    process.stdout.write(JSON.stringify(results));
})().catch((error) => {
    process.stderr.write(`${error.stack}\n`);
    process.exit(1);
});
