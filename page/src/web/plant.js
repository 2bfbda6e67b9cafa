// A plant beside the chart (docs/plant.md): numbers that change with time and with the outputs, and inputs that follow from them. The arithmetic is exact, and
// is that of the simulator: values are counted in parts of a unit.
(() => {
    const SCALE = 1_000_000_000;

    Grafsynth.Plant = class {
        constructor(machine) {
            const { data, cells } = machine;
            Object.assign(this, data.plant, { machine, tick: BigInt(data.tick) });
            // The cells: the quantities, then the inputs and the outputs of the last reaction.
            this.first = cells.length;
            const counts = [this.quantities.length, data.inputs.length, data.outputs.length];
            this.starts = [0, counts[0], counts[0] + counts[1]];
            for (let n = counts[0] + counts[1] + counts[2]; n > 0; n--) cells.push(0);
            // The bounds at which a condition can change, for each quantity.
            this.bounds = this.quantities.map(() => []);
            const note = ([sign, ...rest]) => {
                if (sign === "all" || sign === "any" || sign === "not") rest.forEach(note);
                else if (sign === 0) this.bounds[rest[0]].push([rest[1], rest[2]]);
            };
            for (const [, , , when] of this.moves) note(when);
            for (const [, , when] of this.sets) note(when);
            for (const [, , when] of this.sensors) if (when) note(when);
        }

        reset() {
            this.quantities.forEach(({ init }, at) => { this.machine.cells[this.first + at] = init * SCALE; });
            this.hold();
        }

        // Takes the inputs and the outputs of the reaction.
        hold() {
            const { cells, inputs, outputs } = this.machine;
            const [, ofInputs, ofOutputs] = this.starts;
            for (let i = 0; i < inputs.length; i++) cells[this.first + ofInputs + i] = inputs[i];
            for (let i = 0; i < outputs.length; i++) cells[this.first + ofOutputs + i] = Number(outputs[i]);
        }

        // The cells of the plant in a state of the machine.
        part(cells = this.machine.cells) { return cells.slice(this.first); }

        holds(condition, part) {
            const [sign, first, lo, hi] = condition;
            if (sign === "all") return condition.slice(1).every((one) => this.holds(one, part));
            if (sign === "any") return condition.slice(1).some((one) => this.holds(one, part));
            if (sign === "not") return !this.holds(first, part);
            const value = part[this.starts[sign] + first];
            return (lo === null || value >= lo) && (hi === null || value <= hi);
        }

        // The change of each quantity in one tick.
        rates(part) {
            const rates = this.quantities.map(() => 0n);
            for (const [quantity, rate, speed, when] of this.moves) {
                if (this.holds(when, part)) rates[quantity] += BigInt(rate) * (speed === null ? 1n : BigInt(part[this.starts[2] + speed]));
            }
            return rates.map((rate) => rate * this.tick);
        }

        // The cells after some ticks.
        after(ticks) {
            const part = this.part();
            this.rates(part).forEach((rate, at) => {
                if (rate === 0n) return;
                const { lo, hi } = this.quantities[at];
                const moved = BigInt(part[at]) + rate * BigInt(ticks);
                const [least, most] = [BigInt(lo * SCALE), BigInt(hi * SCALE)];
                part[at] = Number(moved < least ? least : moved > most ? most : moved);
            });
            for (const [quantity, value, when] of this.sets) if (this.holds(when, part)) part[quantity] = value * SCALE;
            return part;
        }

        advance(ticks) {
            const part = this.after(ticks);
            for (let at = 0; at < this.quantities.length; at++) this.machine.cells[this.first + at] = part[at];
        }

        // The inputs that the plant sets after some ticks, each with its value.
        driven(ticks) {
            const part = this.after(ticks);
            return this.sensors.map(([input, quantity, when]) => {
                if (when) return [input, this.holds(when, part) ? 1 : 0];
                const [lo, hi] = this.machine.data.inputs[input].type;
                return [input, Math.min(Math.max(Math.floor(part[quantity] / SCALE), lo), hi)];
            });
        }

        // The ticks until a quantity that moves now passes a bound of a condition; null if none does.
        toChange() {
            const part = this.part();
            let nearest = null;
            this.rates(part).forEach((rate, at) => {
                if (rate === 0n) return;
                const isUp = rate > 0n;
                const { lo, hi } = this.quantities[at];
                for (const [least, most] of this.bounds[at]) {
                    for (const bound of isUp ? [least, most === null ? null : most + 1] : [most, least === null ? null : least - 1]) {
                        if (bound === null || bound < lo * SCALE || bound > hi * SCALE || (isUp ? bound <= part[at] : bound >= part[at])) continue;
                        const way = BigInt(bound) - BigInt(part[at]);
                        const left = Number((way + (isUp ? rate - 1n : rate + 1n)) / rate);
                        if (nearest === null || left < nearest) nearest = left;
                    }
                }
            });
            return nearest;
        }
    };
})();
