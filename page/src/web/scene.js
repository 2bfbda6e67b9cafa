// The plant: its picture, its quantities, and the inputs that it drives.

const driven = new Set(plant.sensors.map(([input]) => input));
const inUnits = (value) => Math.floor(value / 100_000_000) / 10;

// The quantities with a label, as the panel shows outputs.
const quantities = plant.quantities.map(({ name, label, lo, hi }, at) => {
    return { name, label, type: [lo, hi], read: () => inUnits(machine.cells[plant.first + at]) };
}).filter(({ label }) => label);

// Gives the driven inputs the values that they have after some ticks, unless they are forced.
function drive(ticks) {
    for (const [input, value] of plant.driven(ticks)) if (!forced.has(input)) panel[input] = value;
}

// The number of the speed at which a second of the chart takes about a second.
const realTime = Math.max(SPEEDS.findLastIndex((speed) => speed * data.tick <= 1e9), 0);

const PLACES = { rect: ["x", "y", "width", "height"], circle: ["cx", "cy", "r"], line: ["x1", "y1", "x2", "y2"], text: ["x", "y"] };

// Each shape with its element.
const scene = plant.shapes.map(([kind, places, text, fill, when]) => {
    return { kind, places, when, element: shape(kind, { class: fill || "plain" }, kind === "text" ? text : undefined) };
});

function makeScene() {
    const [width, height] = plant.view;
    const drawing = shape("svg", { viewBox: `0 0 ${width} ${height}`, "font-size": Math.max(width / 30, height / 24) });
    drawing.append(...scene.map((one) => one.element));
    byId("plant").append(drawing);
}

makeScene();

// What contains words.
function buildScene() {
    byId("quantities").replaceChildren(...quantities.map(makeResult));
    byId("plant").setAttribute("aria-label", word("plant"));
}

function drawScene(cells) {
    const part = plant.part(cells);
    for (const one of scene) {
        const isShown = plant.holds(one.when, part);
        if (isNew(one, isShown)) one.element.classList.toggle("gone", !isShown);
        if (!isShown) continue;
        one.places.forEach(([base, ...terms], at) => {
            const value = terms.reduce((sum, [quantity, factor, divisor]) => sum + part[quantity] / 1e9 * factor / divisor, base);
            const name = PLACES[one.kind][at];
            const limited = ["width", "height", "r"].includes(name) ? Math.max(value, 0) : value;
            if (isNew(one.places[at], limited)) one.element.setAttribute(name, limited);
        });
    }
}
