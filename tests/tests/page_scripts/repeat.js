// Repeats the reference run of a page; then spoils one constant hash, and expects that this is found.
const data = JSON.parse(require("fs").readFileSync("data.json", "utf8"));
const run = (what) => {
    const steps = Grafsynth.repeat(what);
    for (;;) {
        const { done, value } = steps.next();
        if (done) return value;
    }
};
const clean = run(data);
const hashes = data.reference.hashes.match(/-|.{4}/g);
const at = hashes.findLastIndex((hash) => hash !== "-");
hashes[at] = hashes[at] === "AAAA" ? "AAAB" : "AAAA";
data.reference.hashes = hashes.join("");
const spoiled = run(data);
const found = spoiled.different === at + 1 ? "found" : `missed (${spoiled.different})`;
console.log(clean.different === null ? `${clean.compared} equal, spoiled: ${found}` : `different in reaction ${clean.different}: ${clean.row}`);
