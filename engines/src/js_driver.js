// Runs the engine of a page, which precedes this text: for each number below the first argument, the chart N.json with the stimulus N.csv gives N.trace.
const files = require("fs");
for (let n = 0; n < Number(process.argv[2]); n++) {
    const data = JSON.parse(files.readFileSync(`${n}.json`, "utf8"));
    const rows = Grafsynth.readStimulus(data, files.readFileSync(`${n}.csv`, "utf8"));
    files.writeFileSync(`${n}.trace`, Grafsynth.trace(data, rows));
}
