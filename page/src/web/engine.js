"use strict";
// Executes a chart: interprets the reaction program of a page, exactly as docs/semantics.md defines a reaction. This file needs no document: node runs it too.
//
// Booleans are 0 and 1. A value is a Number, or a BigInt where the program says that it may be beyond 2^53; every value that is stored is a Number.
const Grafsynth = (() => {
    const VERSION = 2;

    // --- expressions ------------------------------------------------------------------------------------------------------------------

    // Division truncates toward zero. The remainder is exact, so the quotient is, too.
    const divided = (a, b) => (a - a % b) / b;

    // Operators on Numbers. The compiler chooses them only if no operand and no result is beyond 2^53, or 32 bits for the bit operators.
    const NUMBERS = {
        "+": (a, b) => () => a() + b(),
        "-": (a, b) => () => a() - b(),
        "*": (a, b) => () => a() * b(),
        "/": (a, b) => () => divided(a(), b()),
        "mod": (a, b) => () => a() % b(),
        "band": (a, b) => () => a() & b(),
        "bor": (a, b) => () => a() | b(),
        "bxor": (a, b) => () => a() ^ b(),
        "shl": (a, b) => () => a() * 2 ** b(),
        "shr": (a, b) => () => Math.floor(a() / 2 ** b()),
        "=": (a, b) => () => (a() === b() ? 1 : 0),
        "<>": (a, b) => () => (a() === b() ? 0 : 1),
        "<": (a, b) => () => (a() < b() ? 1 : 0),
        "<=": (a, b) => () => (a() <= b() ? 1 : 0),
        ">": (a, b) => () => (a() > b() ? 1 : 0),
        ">=": (a, b) => () => (a() >= b() ? 1 : 0),
    };

    // The same operators on BigInts.
    const BIG = {
        "+": (a, b) => a + b,
        "-": (a, b) => a - b,
        "*": (a, b) => a * b,
        "/": (a, b) => a / b,
        "mod": (a, b) => a % b,
        "band": (a, b) => a & b,
        "bor": (a, b) => a | b,
        "bxor": (a, b) => a ^ b,
        "shl": (a, b) => a << b,
        "shr": (a, b) => a >> b,
        "=": (a, b) => (a === b ? 1 : 0),
        "<>": (a, b) => (a === b ? 0 : 1),
        "<": (a, b) => (a < b ? 1 : 0),
        "<=": (a, b) => (a <= b ? 1 : 0),
        ">": (a, b) => (a > b ? 1 : 0),
        ">=": (a, b) => (a >= b ? 1 : 0),
    };

    // Whether an operator was computed with BigInts: 1 if its result is a Number again, 2 if it stays a BigInt.
    const result = (mark) => (mark === 2 ? (value) => value : Number);

    // Compiles an expression to a function without arguments, over the state of the machine.
    function compiled(m, e) {
        if (typeof e === "number") return () => e;
        if (typeof e === "string") {
            const big = BigInt(e);
            return () => big;
        }
        const [sign, first, second, third, mark] = e;
        switch (sign) {
            case "cell": {
                const at = m.places[first];
                return () => m.cells[at];
            }
            case "element": {
                const at = m.places[first];
                const length = m.places[first + 1] - at;
                const index = compiled(m, second);
                return () => {
                    const i = Number(index());
                    return i >= 0 && i < length ? m.cells[at + i] : 0;
                };
            }
            case "temp": return () => m.temps[first];
            case "input": return () => m.inputs[first];
            case "dt": return () => m.dt;
            case "not": {
                const a = compiled(m, first);
                return () => (a() ? 0 : 1);
            }
            case "and": return junction(m, e, 0);
            case "or": return junction(m, e, 1);
            case "neg": {
                const a = compiled(m, first);
                if (!second) return () => -a();
                const as = result(second);
                return () => as(-BigInt(a()));
            }
            case "select": {
                const [c, a, b] = [first, second, third].map((one) => compiled(m, one));
                return mark === 2 ? () => BigInt(c() ? a() : b()) : () => (c() ? a() : b());
            }
        }
        const a = compiled(m, first);
        const b = compiled(m, second);
        if (!third) return NUMBERS[sign](a, b);
        const big = BIG[sign];
        const as = result(third);
        return () => as(big(BigInt(a()), BigInt(b())));
    }

    // A conjunction ends at the first operand that is 0, a disjunction at the first that is 1.
    function junction(m, e, end) {
        const all = e.slice(1).map((one) => compiled(m, one));
        if (all.length === 2) {
            const [a, b] = all;
            return end ? () => (a() || b() ? 1 : 0) : () => (a() && b() ? 1 : 0);
        }
        return () => {
            for (const one of all) if ((one() ? 1 : 0) === end) return end;
            return 1 - end;
        };
    }

    // --- statements -------------------------------------------------------------------------------------------------------------------

    function list(m, statements) {
        const all = statements.map((one) => statement(m, one));
        if (all.length === 1) return all[0];
        return () => {
            for (const one of all) one();
        };
    }

    function statement(m, [sign, first, second, third]) {
        switch (sign) {
            case "set": {
                const value = compiled(m, second);
                return () => { m.temps[first] = value(); };
            }
            case "store": return store(m, first, second, third);
            case "if": {
                const condition = compiled(m, first);
                const then = list(m, second);
                const otherwise = list(m, third);
                return () => (condition() ? then() : otherwise());
            }
            case "repeat": {
                const condition = compiled(m, second);
                const body = list(m, third);
                return () => {
                    for (let round = 0; round < first && condition(); round++) body();
                };
            }
            case "output": {
                const value = compiled(m, second);
                return () => { m.outputs[first] = value(); };
            }
            case "call": {
                const values = second.map((one) => compiled(m, one));
                return () => { m.effects.push([first, values.map((one) => one())]); };
            }
            case "code": return () => { m.effects.push([first]); };
            case "micro-step": return () => { m.frame(); };
            case "fires": return () => { m.fires(first); };
            case "fault": {
                const value = compiled(m, first);
                return () => { m.fault = value() ? 1 : 0; };
            }
        }
        throw new Error(`unknown statement ${sign}`);
    }

    // An assignment limits the value to the range of the cell.
    function store(m, cell, what, where) {
        const [lo, hi] = m.program.cells[cell];
        const at = m.places[cell];
        const length = m.places[cell + 1] - at;
        const value = compiled(m, what);
        if (where === undefined) {
            return () => {
                const given = value();
                m.cells[at] = Number(given < lo ? lo : given > hi ? hi : given);
            };
        }
        const index = compiled(m, where);
        return () => {
            const given = value();
            const i = Number(index());
            if (i >= 0 && i < length) m.cells[at + i] = Number(given < lo ? lo : given > hi ? hi : given);
        };
    }

    // --- machine ----------------------------------------------------------------------------------------------------------------------

    // A chart with its state, and what its last reaction did.
    class Machine {
        constructor(data) {
            if (data.version !== VERSION) throw new Error(`data of version ${data.version}, expected ${VERSION}`);
            this.data = data;
            this.program = data.program;
            // The place of each cell in `cells`, and the end of the last one.
            this.places = [0];
            for (const [, , , init] of this.program.cells) this.places.push(this.places.at(-1) + init.length);
            this.cells = new Array(this.places.at(-1)).fill(0);
            this.temps = new Array(this.program.temps).fill(0);
            this.inputs = [];
            this.dt = 0;
            this.observed = false;
            this.listed = data.steps.filter((step) => step.listed && step.cell !== null).map((step) => [this.places[step.cell], step.name]);
            this.body = list(this, this.program.body);
            // The plant has its cells after those of the chart.
            this.plant = data.plant ? new Grafsynth.Plant(this) : null;
            this.reset();
        }

        // Row 0.
        reset() {
            this.program.cells.forEach(([, , , init], cell) => init.forEach((value, i) => { this.cells[this.places[cell] + i] = value; }));
            this.inputs = this.data.inputs.map(zero);
            this.dt = 0;
            this.outputs = this.program.outputs.slice();
            this.effects = this.program.effects.slice();
            this.fault = this.program.fault;
            this.plant?.reset();
            this.frames = [];
            // The transitions that fired in the last reaction, in order.
            this.fired = [];
        }

        // One reaction. If the machine is observed, `frames` has one entry for each micro-step: the state before it, and what fires.
        react(inputs, dt) {
            this.plant?.advance(dt);
            this.inputs = inputs;
            this.dt = dt;
            this.outputs.fill(0);
            this.effects = [];
            this.fault = 0;
            this.fired.length = 0;
            if (this.observed) {
                this.frames = [];
                this.before = this.cells.slice();
            }
            this.body();
            this.plant?.hold();
        }

        frame() {
            if (this.observed) this.frames.push({ before: this.cells.slice(), fired: [] });
        }

        fires(transition) {
            this.fired.push(transition);
            if (!this.observed) return;
            // A single check has no mark of its own: it begins with the reaction.
            if (this.frames.length === 0) this.frames.push({ before: this.before, fired: [] });
            this.frames.at(-1).fired.push(transition);
        }

        // The state between reactions.
        save() { return this.cells.slice(); }

        restore(cells) {
            for (let i = 0; i < cells.length; i++) this.cells[i] = cells[i];
        }

        // The value of an expression of the data with these inputs, in a saved state or the current one.
        evaluator(e) {
            const value = compiled(this, e);
            return (inputs, dt, cells) => {
                const kept = [this.inputs, this.dt, this.cells];
                this.inputs = inputs;
                this.dt = dt;
                if (cells) this.cells = cells;
                const found = value();
                [this.inputs, this.dt, this.cells] = kept;
                return found;
            };
        }

        isActive(step, cells = this.cells) {
            const cell = this.data.steps[step].cell;
            return cell !== null && cells[this.places[cell]] === 1;
        }

        // The names of the active steps that a trace lists.
        situation() {
            const names = [];
            for (const [place, name] of this.listed) if (this.cells[place] === 1) names.push(name);
            return names;
        }

        // The cells of a row of the trace, without the first column, the number of the row.
        row() {
            return this.data.columns.slice(1).map(([, kind, id, element]) => {
                switch (kind) {
                    case "dt": return this.dt;
                    case "input": return this.inputs[id];
                    case "steps": return this.situation().join(" ");
                    case "output": return this.outputs[id];
                    case "count": return this.effects.filter(([called, values]) => called === id && values).length;
                    case "calls": return this.effects.filter(([called, values]) => called === id && values).map(([, values]) => values.join(":")).join(";");
                    case "var": return id === null ? 0 : this.cells[this.places[id] + element];
                    case "fault": return this.fault;
                }
                throw new Error(`unknown column ${kind}`);
            });
        }
    }

    // The value of an input before anything sets it: 0, or the bound nearest to 0.
    function zero(input) {
        const [lo, hi] = input.type || [0, 1];
        return Math.min(Math.max(0, lo), hi);
    }

    // An error that a page can say in any language: the key of a sentence, and the values in it.
    function problem(key, values = {}) {
        return Object.assign(new Error(`${key} ${JSON.stringify(values)}`), { key, values });
    }

    // --- stimuli and traces -----------------------------------------------------------------------------------------------------------

    const given = (data) => data.inputs.map((input, id) => ({ ...input, id })).filter((input) => input.kind !== "internal");

    // Reads a stimulus, or a trace as a stimulus with expected values. Returns the rows, each with the expected cells by column; throws an Error that
    // names the line.
    function readStimulus(data, text) {
        const lines = text.replace(/^\uFEFF+/, "").split("\n").map((line, at) => ({ number: at + 1, text: line.split("#")[0].trim() }))
            .filter((line) => line.text !== "");
        const cells = (line) => line.text.split(",").map((cell) => cell.trim());
        if (lines.length === 0) throw problem("csvEmpty");
        const inputs = given(data);
        const computed = new Set(data.columns.filter(([, kind]) => !["scan", "dt", "input"].includes(kind)).map(([name]) => name));
        const header = cells(lines[0]).map((name, at) => {
            const input = inputs.find((one) => one.name === name);
            if (name === "dt") return { kind: "dt" };
            if (input) return { kind: "input", input };
            if (name === "scan" && at === 0) return { kind: "scan" };
            if (computed.has(name)) return { kind: "expected", name };
            throw problem("csvInput", { line: lines[0].number, name });
        });
        const rows = [];
        for (const line of lines.slice(1)) {
            const found = cells(line);
            if (found.length !== header.length) {
                throw problem("csvCells", { line: line.number, found: found.length, expected: header.length });
            }
            const row = { dt: 1, values: data.inputs.map(zero), expected: new Map(), line: line.number };
            let isReset = false;
            header.forEach((column, at) => {
                const cell = found[at];
                const number = /^-?\d+$/.test(cell) ? Number(cell) : NaN;
                if (column.kind === "expected") {
                    row.expected.set(column.name, cell);
                    return;
                }
                const [lo, hi] = column.kind === "input" ? column.input.type || [0, 1] : [0, data.maxDt];
                if (!(number >= lo && number <= hi)) {
                    throw problem("csvNumber", { line: line.number, cell, lo, hi });
                }
                if (column.kind === "dt") row.dt = number;
                if (column.kind === "input") row.values[column.input.id] = number;
                if (column.kind === "scan") isReset = number === 0;
            });
            // Row 0 of a trace is the reset.
            if (!isReset) rows.push(row);
        }
        return rows;
    }

    function writeStimulus(data, rows) {
        const inputs = given(data);
        const lines = [["dt", ...inputs.map((input) => input.name)].join(",")];
        for (const row of rows) lines.push([row.dt, ...inputs.map((input) => row.values[input.id])].join(","));
        return lines.join("\n") + "\n";
    }

    // The trace of a stimulus, as `sim` writes it.
    function trace(data, rows) {
        const machine = new Machine(data);
        const lines = [data.columns.map(([name]) => name).join(",")];
        lines.push([0, ...machine.row()].join(","));
        for (const row of rows) {
            machine.react(row.values, row.dt);
            lines.push([lines.length - 1, ...machine.row()].join(","));
        }
        return lines.join("\n") + "\n";
    }

    // --- the reference run ------------------------------------------------------------------------------------------------------------

    // FNV-1a with 32 bits.
    const encoder = new TextEncoder();
    function hash(text) {
        let value = 0x811c9dc5;
        for (const byte of encoder.encode(text)) value = Math.imul(value ^ byte, 0x01000193);
        return value >>> 0;
    }

    // The low 24 bits of a hash as 4 digits of base64.
    const low24 = (value) => btoa(String.fromCharCode(value >> 16 & 255, value >> 8 & 255, value & 255));

    // The inputs of the reference run: ticks if they change, four Booleans in each hexadecimal digit, and the numbers.
    function referenceRows(data) {
        if (data.reference.rows === "") return [];
        const bits = given(data).filter((input) => !input.type);
        const numbers = given(data).filter((input) => input.type);
        let dt = 1;
        return data.reference.rows.split(",").map((text) => {
            const [, ticks, digits, rest] = /^(?:(\d+):)?([0-9a-f]*)(.*)$/.exec(text);
            if (ticks) dt = Number(ticks);
            const values = data.inputs.map(zero);
            bits.forEach((input, n) => { values[input.id] = parseInt(digits[n >> 2], 16) >> (n & 3) & 1; });
            rest.split(".").slice(1).forEach((number, n) => { values[numbers[n].id] = Number(number); });
            return { dt, values };
        });
    }

    // Repeats the reference run of the page, up to the first difference; yields after every few reactions, so that a page can do something else.
    function* repeat(data) {
        const hashes = data.reference.hashes.match(/-|.{4}/g) || [];
        const rows = referenceRows(data);
        const machine = new Machine(data);
        const jumps = new Map(data.reference.from);
        const wanted = new Set(jumps.values());
        const saved = new Map([[0, machine.save()]]);
        let compared = 0;
        for (let at = 0; at < rows.length; at++) {
            if (jumps.has(at)) machine.restore(saved.get(jumps.get(at)));
            machine.react(rows[at].values, rows[at].dt);
            if (wanted.has(at + 1)) saved.set(at + 1, machine.save());
            const row = machine.row().join(",");
            if (hashes[at] !== "-") {
                if (low24(hash(row)) !== hashes[at]) return { compared, different: at + 1, row };
                compared += 1;
            }
            if (at % 16 === 15) yield compared;
        }
        return { compared, different: null };
    }

    return { Machine, given, hash, problem, readStimulus, repeat, trace, writeStimulus, zero };
})();
