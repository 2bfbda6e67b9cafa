// Plays a stimulus in a session, looks at the past on the way, goes back and takes another way once, and prints the recording and its trace.
const files = require("fs");
const data = JSON.parse(files.readFileSync("data.json", "utf8"));
const rows = Grafsynth.readStimulus(data, files.readFileSync("stimulus.csv", "utf8"));
const session = new Grafsynth.Session(data);
const cells = [session.machine.row().join(",")];
rows.forEach((row, at) => {
    session.react(row.values, row.dt);
    cells.push(session.machine.row().join(","));
    if (at % 37 === 5) {
        for (const past of [0, 1, at >> 1, at, 64, 65]) {
            session.show(past);
            const shown = session.machine.row().join(",");
            if (shown !== cells[session.at]) throw new Error(`row ${past} after ${at}: ${shown}, expected ${cells[session.at]}`);
        }
        session.show(at + 1);
    }
    if (at === 200) {
        // Another way from row 150 on, and back to the first one.
        session.show(150);
        session.react(data.inputs.map(Grafsynth.zero), 7);
        session.show(150);
        for (const again of rows.slice(150, 201)) session.react(again.values, again.dt);
    }
});
const window = session.cells(100, 230).map((row) => row.join(","));
if (window.join("\n") !== cells.slice(100, 231).join("\n")) throw new Error("the rows 100 to 230 differ");
const recording = session.stimulus();
process.stdout.write(recording + Grafsynth.trace(data, Grafsynth.readStimulus(data, recording)));
