// Links to a row: `#row=12` alone, or with the recording up to there, `&play=..`, the check sum of the chart, `&chart=..`, and that of the row, `&is=..`.

// A link with a longer recording is refused: programs cut off long addresses.
const LONGEST_LINK = 30_000;

const sum = (text) => Grafsynth.hash(text).toString(16).padStart(8, "0");
const chartSum = () => sum(JSON.stringify([data.program, data.columns]));

// Bytes through a stream of the browser, such as one that compresses.
const through = async (bytes, stream) => new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(stream)).arrayBuffer());

async function packed(text) {
    const bytes = await through(new TextEncoder().encode(text), new CompressionStream("deflate-raw"));
    let signs = "";
    for (const byte of bytes) signs += String.fromCharCode(byte);
    return btoa(signs).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

async function unpacked(text) {
    const signs = atob(text.replaceAll("-", "+").replaceAll("_", "/"));
    return new TextDecoder().decode(await through(Uint8Array.from(signs, (sign) => sign.charCodeAt(0)), new DecompressionStream("deflate-raw")));
}

// Makes the link to the row that is shown, and offers it for copying.
async function makeLink() {
    const at = session.at;
    const play = await packed(Grafsynth.writeStimulus(data, session.rows(1, at)));
    const isLong = play.length > LONGEST_LINK;
    const hash = `#row=${at}` + (isLong ? "" : `&chart=${chartSum()}&is=${sum(machine.row().join(","))}&play=${play}`);
    const field = byId("link-text");
    field.value = location.href.split("#")[0] + hash;
    field.hidden = false;
    field.focus();
    field.select();
    byId("loaded").className = "";
    byId("loaded").textContent = word(isLong ? "linkLong" : "linkMade", { row: at });
}

// Opens the page at the row that its address names.
async function openLink() {
    const wanted = new URLSearchParams(location.hash.slice(1));
    if (!/^\d+$/.test(wanted.get("row") ?? "")) return;
    const row = Number(wanted.get("row"));
    if (!wanted.has("play")) {
        // The row is shown if the page has it.
        if (row <= session.length) show(row);
        else note("linkWithout", row);
        return;
    }
    try {
        if (wanted.get("play").length > LONGEST_LINK) throw Grafsynth.problem("linkBroken");
        const rows = Grafsynth.readStimulus(data, await unpacked(wanted.get("play")));
        reset();
        for (const one of rows) session.react(one.values, one.dt);
        show(row);
        if (row > rows.length) note("linkWithout", row);
        else if (wanted.get("is") === sum(machine.row().join(","))) note("linkSame", row);
        else note(wanted.get("chart") === chartSum() ? "linkDiffers" : "linkOther", row);
    } catch {
        note("linkBroken", row);
    }
}
