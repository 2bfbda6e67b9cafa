// Recordings, and the reference run.

function save(name, text) {
    const link = make("a", { download: name, href: URL.createObjectURL(new Blob([text], { type: "text/csv" })) });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

// Plays a stimulus from the reset on; reports the first cell that differs from the expected values of a trace.
function load(name, text) {
    const note = byId("loaded");
    byId("link-text").hidden = true;
    note.className = "";
    try {
        const rows = Grafsynth.readStimulus(data, text);
        reset();
        let different = null;
        let compared = 0;
        for (const row of rows) {
            session.react(withForced(row.values), row.dt);
            if (row.expected.size === 0 || different) continue;
            const cells = machine.row();
            data.columns.slice(1).forEach(([column], at) => {
                const expected = row.expected.get(column);
                if (expected === undefined || different) return;
                compared += 1;
                if (String(cells[at]) !== expected) different = word("different", { row: session.at, column, expected, found: cells[at] });
            });
        }
        const verdict = different || (compared > 0 ? word("cellsEqual", { cells: compared }) : "");
        note.textContent = clean(`${name}: ${word("played", { rows: rows.length })} ${verdict}`);
        if (different) note.className = "bad";
        show(session.length);
    } catch (error) {
        note.className = "bad";
        note.textContent = clean(`${name}: ${told(error)}`);
    }
}

// --- the reference ------------------------------------------------------------------------------------------------------------------------

// The result of the comparison with the reference run: a key of a sentence and its values.
let verdict = ["comparing", {}];
// The sentence that says why the page cannot be trusted, with its values; null if it can.
let broken = null;

function drawVerdict() {
    byId("reference").textContent = word(...verdict);
    byId("reference").classList.toggle("good", verdict[0] === "equalToReference");
}

function compareWithReference() {
    const steps = Grafsynth.repeat(data);
    const turn = () => {
        const end = performance.now() + 10;
        try {
            while (performance.now() < end) {
                const { done, value } = steps.next();
                if (!done) continue;
                const { different, row, compared } = value;
                if (different !== null) broken = ["unequalRow", { reaction: different, row }];
                verdict = different !== null ? ["unequal", {}] : compared > 0 ? ["equalToReference", { n: compared }] : ["notCompared", {}];
                drawVerdict();
                redraw();
                return;
            }
        } catch (error) {
            broken = ["unequalError", { error: error.message }];
            verdict = ["unequal", {}];
            drawVerdict();
            redraw();
            return;
        }
        setTimeout(turn, 0);
    };
    turn();
}
