// A page without a plant.

const driven = new Set();
const quantities = [];
const realTime = 1;
const drive = () => {};
const buildScene = drive;
const drawScene = drive;
