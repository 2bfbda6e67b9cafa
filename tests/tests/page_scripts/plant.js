// Runs a stimulus in a session with its plant, as a page does, and prints for each row the inputs as they were set and the quantities; looks at the past on the
// way. Before each row, what a plant says about its next change is compared with what happens then.
const files = require("fs");
const data = JSON.parse(files.readFileSync("data.json", "utf8"));
const rows = Grafsynth.readStimulus(data, files.readFileSync("stimulus.csv", "utf8"));
const session = new Grafsynth.Session(data);
const { plant } = session.machine;

// Whether each bound of each quantity is kept.
const sides = (part) => plant.bounds.map((all, at) => all.map(([lo, hi]) => `${lo === null || part[at] >= lo} ${hi === null || part[at] <= hi}`)).join();

function checkChange() {
    if (plant.sets.length > 0) return;
    const ticks = plant.toChange();
    const now = sides(plant.part());
    const later = ticks === null ? [100_000] : [ticks - 1, ticks];
    const found = later.map((some) => sides(plant.after(some)) === now);
    if (!found[0] || found[1]) throw new Error(`the next change is not after ${ticks} ticks`);
}

const lines = [];
rows.forEach((row, at) => {
    checkChange();
    const values = row.values.slice();
    for (const [input, value] of plant.driven(row.dt)) values[input] = value;
    session.react(values, row.dt);
    lines.push([...values, ...plant.part().slice(0, plant.quantities.length)].join(","));
    if (at % 37 === 5) {
        for (const past of [1, at >> 1, at]) {
            session.show(past);
            const shown = plant.part().slice(0, plant.quantities.length).join(",");
            if (!lines[past - 1].endsWith(shown)) throw new Error(`row ${past} after ${at}: ${shown}, expected ${lines[past - 1]}`);
        }
        session.show(at + 1);
    }
});
console.log(lines.join("\n"));
