// The waveform of the rows around the one that is shown.

const LANE = 26;
const HEAD = 22;
const lanes = data.columns.map(([name, kind, id], at) => {
    if (["scan", "dt"].includes(kind)) return null;
    const type = kind === "input" ? data.inputs[id].type : kind === "output" ? data.outputs[id].type : null;
    const isBit = kind === "fault" || (["input", "output"].includes(kind) && type === null);
    return { name, at: at - 1, isBit, input: kind === "input" ? id : null };
}).filter((lane) => lane !== null).slice(0, 80);

// The width of the waveform, and whether it is in sight.
let waveWidth = 0;
let isWaveInSight = true;

// The rows that the waveform shows: as many as fit, with the current one in sight.
function drawWave() {
    if (waveWidth === 0 || !isWaveInSight) return;
    const room = Math.max(waveWidth, 240);
    const left = Math.min(160, Math.max(70, room / 4));
    const n = Math.max(Math.floor((room - left - 8) / 34), 4);
    const to = Math.min(session.length, Math.max(session.at + 2, n - 1));
    const from = Math.max(0, to - n + 1);
    const cells = session.cells(from, to);
    const step = (room - left - 8) / n;
    const x = (row) => left + (row - from) * step;
    const height = HEAD + lanes.length * LANE;
    const picture = shape("svg", { width: room, height: height + 4, role: "img", "aria-label": word("rows", { from, to }) });
    let grid = "";
    for (let row = from; row <= to; row++) {
        grid += `M${x(row)} ${HEAD}V${height}`;
        if ((row - from) % Math.ceil(40 / step) === 0) picture.append(shape("text", { class: "soft", x: x(row) + 2, y: HEAD - 7 }, row));
    }
    picture.append(shape("path", { class: "grid", d: grid }));
    const lines = { line: "", high: "", texts: [] };
    lanes.forEach((lane, n) => {
        const top = HEAD + n * LANE + 5;
        const name = lane.name.length > left / 7 ? `${lane.name.slice(0, Math.floor(left / 7) - 1)}…` : lane.name;
        lines.texts.push(shape("text", { x: 4, y: top + 13 }, forced.has(lane.input) ? `⚑ ${name}` : name));
        const values = cells.map((row) => String(row[lane.at]));
        if (lane.isBit) drawBit(lines, values, (k) => x(from + k), top);
        else drawValues(lines, values, (k) => x(from + k), top);
    });
    picture.append(shape("path", { class: "high", d: lines.high }), shape("path", { d: lines.line }), ...lines.texts);
    picture.append(shape("path", { class: "now", d: `M${x(session.at)} ${HEAD - 4}V${height}` }));
    picture.append(shape("text", { x: x(session.at) - 4, y: 9, class: "soft" }, "▼"));
    picture.addEventListener("click", (event) => {
        const at = from + Math.floor((event.clientX - picture.getBoundingClientRect().left - left) / step);
        if (at >= from && at <= to) show(at);
    });
    byId("wave").replaceChildren(picture);
}

function drawBit(lines, values, x, top) {
    for (let k = 0; k < values.length;) {
        let end = k + 1;
        while (end < values.length && values[end] === values[k]) end += 1;
        const y = values[k] === "1" ? top : top + 16;
        lines.line += `${k === 0 ? "M" : "L"}${x(k)} ${y}H${x(end)}`;
        if (values[k] === "1") lines.high += `M${x(k)} ${top}H${x(end)}V${top + 16}H${x(k)}Z`;
        k = end;
    }
}

function drawValues(lines, values, x, top) {
    for (let k = 0; k < values.length;) {
        let end = k + 1;
        while (end < values.length && values[end] === values[k]) end += 1;
        const [a, b] = [x(k), x(end)];
        lines.line += `M${a} ${top + 8}L${a + 3} ${top}H${b - 3}L${b} ${top + 8}L${b - 3} ${top + 16}H${a + 3}Z`;
        const most = Math.floor((b - a - 8) / 6.5);
        const text = values[k].length > most ? (most > 2 ? `${values[k].slice(0, most - 1)}…` : "") : values[k];
        if (text) {
            const written = shape("text", { x: a + 5, y: top + 12 }, text);
            written.append(shape("title", {}, values[k]));
            lines.texts.push(written);
        }
        k = end;
    }
}

new ResizeObserver(([{ contentRect }]) => {
    waveWidth = contentRect.width;
    drawWave();
}).observe(byId("wave"));
new IntersectionObserver((entries) => {
    isWaveInSight = entries.at(-1).isIntersecting;
    drawWave();
}, { rootMargin: "200px" }).observe(byId("waves"));
