// Measures a page in a browser: `node speed.js CHROMIUM PAGE.html`. Prints how long it takes until a key acts, how many reactions per second it makes with the
// picture live (at the speed 1000 / s, all Boolean inputs 1), how long a jump into the past takes, and the memory after 100 000 reactions. Seconds of the
// processor are those of all processes of the browser.
const files = require("fs");
const os = require("os");
const path = require("path");
const { Chromium } = require("./chromium.js");

const PICTURE = "new Promise((done) => requestAnimationFrame(() => setTimeout(done, 0)))";
const sleep = (ms) => new Promise((done) => setTimeout(done, ms));

// The seconds that the processor spent in a process and in those that it started; only where /proc exists.
function seconds(root) {
    const all = files.readdirSync("/proc").filter((name) => /^\d+$/.test(name)).flatMap((name) => {
        try {
            const fields = files.readFileSync(`/proc/${name}/stat`, "utf8").split(") ")[1].split(" ");
            return [{ id: Number(name), parent: Number(fields[1]), time: (Number(fields[11]) + Number(fields[12])) / 100 }];
        } catch {
            return [];
        }
    });
    const sum = (id) => all.filter((one) => one.parent === id).reduce((total, one) => total + sum(one.id), all.find((one) => one.id === id)?.time || 0);
    return sum(root);
}

async function measure(browser, page) {
    const tab = await browser.tab();
    const spent = async (what, action) => {
        const [wall, processor] = [Date.now(), seconds(browser.process.pid)];
        const result = await action();
        const times = `${((Date.now() - wall) / 1000).toFixed(2)} s, ${(seconds(browser.process.pid) - processor).toFixed(2)} s of the processor`;
        console.log(`${what}: ${times}${result === undefined ? "" : `: ${result}`}`);
    };
    const rows = async () => Number(await tab.value(`document.getElementById("scrub").max`));
    const speed = (at) => tab.value(`document.getElementById("speed").value = ${at}`);
    await spent("until a key acts", async () => {
        await tab.open(`file://${path.resolve(page)}`);
        await tab.key("r");
        await tab.value(PICTURE);
    });
    await tab.until(`document.getElementById("reference").classList.contains("good")`, 60);
    await tab.value(`document.getElementById("auto").click(); document.querySelectorAll("[role=switch]").forEach((one) => one.click())`);
    await speed(4);
    await tab.key("p");
    await sleep(500);
    await spent("1000 / s", async () => {
        const [first, start] = [await rows(), performance.now()];
        await sleep(4000);
        return `${Math.round((await rows() - first) / (performance.now() - start) * 1000)} reactions per second`;
    });
    await speed(5);
    await spent("100 000 reactions", async () => {
        while (await rows() < 100_000) await sleep(200);
    });
    await tab.key("p");
    await tab.send("HeapProfiler.collectGarbage");
    console.log(`memory of the page's scripts: ${((await tab.send("Runtime.getHeapUsage")).usedSize / 1e6).toFixed(1)} MB`);
    const jump = (at) => tab.value(`(async () => {
        const start = performance.now();
        const scrub = document.getElementById("scrub");
        scrub.value = ${at};
        scrub.dispatchEvent(new Event("input"));
        await ${PICTURE};
        return performance.now() - start;
    })()`);
    await spent("20 jumps", async () => {
        const times = [];
        for (let n = 0; n < 20; n++) times.push(await jump(n * 7919 % 100 * 1000));
        return `mean ${Math.round(times.reduce((a, b) => a + b) / times.length)} ms, longest ${Math.round(Math.max(...times))} ms`;
    });
}

(async () => {
    const profile = files.mkdtempSync(path.join(os.tmpdir(), "page-speed-"));
    const browser = new Chromium(process.argv[2], profile);
    await browser.tab();
    await measure(browser, process.argv[3]);
    await browser.close();
    files.rmSync(profile, { recursive: true, force: true });
})();
