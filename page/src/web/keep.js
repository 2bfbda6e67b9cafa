// A page that is loaded again in its tab has its session again: it plays the inputs that it had, also if the chart has changed since.

const KEPT = `grafsynth ${location.pathname}`;
// Some browsers give no storage to files, and none has more than a few megabytes: the session is then not kept.
const stored = (use) => { try { return use(sessionStorage); } catch { return null; } };

addEventListener("pagehide", () => {
    stored((storage) => {
        storage.removeItem(KEPT);
        if (session.length > 0) storage.setItem(KEPT, JSON.stringify([session.at, session.stimulus(), chartSum()]));
    });
});

function reopen() {
    const isAgain = performance.getEntriesByType("navigation")[0]?.type === "reload";
    const text = stored((storage) => storage.getItem(KEPT));
    if (!isAgain || !text || location.hash.length > 1) return;
    try {
        const [at, play, chart] = JSON.parse(text);
        const rows = Grafsynth.readStimulus(data, play);
        reset();
        for (const one of rows) session.react(one.values, one.dt);
        show(at);
        note(chart === chartSum() ? "keptSame" : "keptOther", session.length);
    } catch {
        reset();
        note("keptLost");
    }
}
