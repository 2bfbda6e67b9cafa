// Compares PNG files with what a browser shows for the SVG files of the same names: `node pictures.js CHROMIUM NAME..`, in their folder, prints for each name
// the sizes, and how much the light of blocks of 8 x 8 pixels differs: the mean, the worst, and the share of blocks with more than a fourth of white.
const fs = require("fs");
const path = require("path");
const { Chromium } = require("./chromium.js");

async function compare(svg, png) {
    const image = (url) => new Promise((done, failed) => {
        const image = new Image();
        image.onload = () => done(image);
        image.onerror = () => failed(new Error(`cannot show ${url.slice(0, 40)}`));
        image.src = url;
    });
    const shown = [await image(`data:image/svg+xml;base64,${svg}`), await image(`data:image/png;base64,${png}`)];
    const [width, height] = [shown[1].naturalWidth, shown[1].naturalHeight];
    const blocks = shown.map((one) => {
        const canvas = new OffscreenCanvas(width, height);
        const context = canvas.getContext("2d");
        context.drawImage(one, 0, 0, width, height);
        const data = context.getImageData(0, 0, width, height).data;
        const columns = Math.ceil(width / 8);
        const sums = new Float64Array(columns * Math.ceil(height / 8));
        for (let y = 0; y < height; y++) {
            for (let x = 0; x < width; x++) {
                const at = 4 * (y * width + x);
                sums[(y >> 3) * columns + (x >> 3)] += (data[at] + data[at + 1] + data[at + 2]) / 3 / 64;
            }
        }
        return sums;
    });
    let [sum, worst, many] = [0, 0, 0];
    blocks[0].forEach((light, index) => {
        const difference = Math.abs(light - blocks[1][index]);
        sum += difference;
        worst = Math.max(worst, difference);
        many += difference > 64;
    });
    return { svg: shown[0].naturalWidth, png: width, mean: sum / blocks[0].length, worst, share: many / blocks[0].length };
}

(async () => {
    const browser = new Chromium(process.argv[2], path.resolve("profile"));
    const tab = await browser.tab();
    const results = {};
    for (const name of process.argv.slice(3)) {
        const [svg, png] = ["svg", "png"].map((ending) => JSON.stringify(fs.readFileSync(`${name}.${ending}`, "base64")));
        results[name] = await tab.value(`(${compare})(${svg}, ${png})`);
    }
    await browser.close();
    console.log(JSON.stringify(results));
})().catch((error) => { console.error(error); process.exit(1); });
