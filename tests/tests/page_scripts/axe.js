// Checks pages with axe-core: `node axe.js CHROMIUM AXE PAGE.html..`. Each page is checked as it opens, and again with everything open, inputs set and forced, and the
// chart running; light and dark, 1280 and 400 pixels wide. Prints one line for each serious finding: where, which rule, and the element; nothing if there are none.
const files = require("fs");
const path = require("path");
const { Chromium } = require("./chromium.js");

const SERIOUS = ["serious", "critical"];
const PICTURE = "new Promise((done) => requestAnimationFrame(() => setTimeout(done, 0)))";

// The states of a page in which it is checked: as it opens, and running, each light and dark, wide and narrow.
const LOOKS = [
    ["as it opens", "light", 1280], ["as it opens", "light", 400], ["as it opens", "dark", 1280], ["as it opens", "dark", 400],
    ["running", "light", 400], ["running", "light", 1280], ["running", "dark", 1280], ["running", "dark", 400],
];

// Opens what can be opened, sets, forces and marks what can be set, forced and marked, and starts the run.
const RUN = `{
    for (const one of document.querySelectorAll("details")) one.open = true;
    for (const id of ["react", "link"]) document.getElementById(id)?.click();
    for (const one of document.querySelectorAll(".switch, .force, .stopper")) one.click();
    // One reaction per second: the run takes no time from the check.
    if (document.getElementById("speed")) document.getElementById("speed").value = 0;
    if (document.getElementById("run")?.getAttribute("aria-pressed") === "false") document.getElementById("run").click();
}`;

// The rules that depend on colours; only they are applied again in the dark.
const COLOURS = ["color-contrast", "link-in-text-block"];

async function findings(tab, where, rules) {
    const options = { resultTypes: ["violations"], ...(rules ? { runOnly: { type: "rule", values: rules } } : {}) };
    const { violations, passes } = await tab.value(`axe.run(document, ${JSON.stringify(options)})`);
    // A script that was not run, or that looked at nothing, would find nothing either.
    const applied = passes.length + violations.length;
    if (applied < (rules ? 1 : 10)) throw new Error(`${where}: axe-core applied only ${applied} rules`);
    const serious = violations.filter(({ impact }) => SERIOUS.includes(impact));
    return serious.flatMap(({ id, help, nodes }) => nodes.map((node) => `${where}: ${id}: ${help}: ${node.html.slice(0, 200)}: ${node.any.map((one) => one.message).join("; ")}`));
}

(async () => {
    const [program, axe, ...pages] = process.argv.slice(2);
    const script = files.readFileSync(axe, "utf8");
    const browser = new Chromium(program, path.resolve("profile"));
    const found = [];
    for (const page of pages) {
        const tab = await browser.tab();
        await tab.open(`file://${path.resolve(page)}`);
        await tab.value(`${script}; 0`);
        let before = LOOKS[0][0];
        for (const [state, scheme, width] of LOOKS) {
            if (state !== before) await tab.value(RUN);
            before = state;
            // Without motion: colours that are on the way from one to another are none of the page.
            await tab.send("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: scheme }, { name: "prefers-reduced-motion", value: "reduce" }] });
            await tab.send("Emulation.setDeviceMetricsOverride", { width, height: 900, deviceScaleFactor: 1, mobile: false });
            await tab.value(PICTURE);
            found.push(...await findings(tab, `${page}, ${state}, ${scheme}, ${width}`, scheme === "dark" ? COLOURS : null));
        }
        await tab.close();
    }
    await browser.close();
    process.stdout.write(found.map((one) => `${one}\n`).join(""));
})().catch((error) => {
    process.stderr.write(`${error.stack}\n`);
    process.exit(1);
});
