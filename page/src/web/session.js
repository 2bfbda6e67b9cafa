// A machine with its past: every reaction can be shown again. The past takes little space: of each reaction the inputs that changed, and of each 16th reaction
// the cells that changed. Every 32nd of these states is stored as a whole.
(() => {
    const { Machine, trace, writeStimulus } = Grafsynth;

    // The number of reactions between two saved states, and the number of saved states between two whole ones.
    const APART = 16;
    const WHOLE = 32;

    // The places where two lists of the same length differ, each followed by its new value; null if there are none.
    function changes(from, to) {
        let found = null;
        for (let i = 0; i < to.length; i++) if (from[i] !== to[i]) (found ||= []).push(i, to[i]);
        return found;
    }

    function apply(list, found) {
        if (found) for (let i = 0; i < found.length; i += 2) list[found[i]] = found[i + 1];
    }

    Grafsynth.Session = class {
        constructor(data) {
            this.data = data;
            this.machine = new Machine(data);
            this.spare = new Machine(data);
            this.clear();
        }

        clear() {
            this.machine.reset();
            // Of each reaction: the ticks, the changes of the inputs (whole after each saved state), and the ticks since the reset.
            this.dts = [];
            this.inputs = [];
            this.times = [];
            // Saved states: `whole` for some, changes for the others.
            this.states = [];
            this.last = [];
            this.save();
            // The inputs of the last reaction.
            this.values = this.data.inputs.map(Grafsynth.zero);
            // The number of the reaction that is shown.
            this.at = 0;
        }

        // The number of reactions.
        get length() { return this.dts.length; }

        // Saves the state of the machine; `last` is the one that was saved before.
        save() {
            const now = this.machine.cells;
            const found = this.states.length % WHOLE === 0 ? null : changes(this.last, now) || [];
            this.states.push(found && found.length < now.length ? { found } : { whole: now.slice() });
            this.last = now.slice();
        }

        // The saved state with this number.
        saved(number) {
            let start = number;
            while (!this.states[start].whole) start -= 1;
            const cells = this.states[start].whole.slice();
            for (let n = start + 1; n <= number; n++) apply(cells, this.states[n].found);
            return cells;
        }

        // One reaction after the one that is shown; the reactions that followed it are forgotten.
        react(values, dt) {
            if (this.at < this.length) this.forget();
            this.times.push(this.time() + dt);
            this.dts.push(dt);
            this.inputs.push(this.at % APART === 0 ? values.slice() : changes(this.values, values));
            if (this.inputs[this.at]) this.values = values.slice();
            this.machine.react(values, dt);
            this.at += 1;
            if (this.at % APART === 0) this.save();
        }

        // Forgets what followed the reaction that is shown.
        forget() {
            this.values = this.at === 0 ? this.data.inputs.map(Grafsynth.zero) : this.inputsOf(this.at);
            for (const list of [this.dts, this.inputs, this.times]) list.length = this.at;
            const kept = Math.floor(this.at / APART) + 1;
            if (kept === this.states.length) return;
            this.states.length = kept;
            this.last = this.saved(kept - 1);
        }

        // The ticks from the reset to the reaction that is shown.
        time() { return this.at === 0 ? 0 : this.times[this.at - 1]; }

        // The reactions from..to, counted from 1, with their ticks and inputs. The list of inputs is the same for all: copy it to keep it.
        *rows(from = 1, to = this.length) {
            if (from > to) return;
            const start = from - 1 - (from - 1) % APART;
            let values = null;
            for (let n = start; n < to; n++) {
                if (n % APART === 0) values = this.inputs[n].slice();
                else apply(values, this.inputs[n]);
                if (n >= from - 1) yield { dt: this.dts[n], values };
            }
        }

        // The inputs of a reaction.
        inputsOf(at) {
            for (const { values } of this.rows(at, at)) return values;
            return this.data.inputs.map(Grafsynth.zero);
        }

        // Shows a reaction of the past, or the last one.
        show(at) {
            this.at = Math.min(Math.max(at, 0), this.length);
            this.replay(this.machine, this.at);
        }

        // Brings a machine to the state after a reaction.
        replay(machine, at) {
            machine.reset();
            if (at === 0) return;
            const start = Math.floor((at - 1) / APART);
            machine.restore(this.saved(start));
            for (const { values, dt } of this.rows(start * APART + 1, at)) machine.react(values, dt);
        }

        // The micro-steps of the reaction that is shown: for each the state before it, and the transitions that fire in it.
        frames() {
            if (this.at === 0) return [];
            this.replay(this.spare, this.at - 1);
            this.spare.observed = true;
            this.spare.react(this.inputsOf(this.at), this.dts[this.at - 1]);
            this.spare.observed = false;
            return this.spare.frames;
        }

        // The cells of the rows from..to, without the first column.
        cells(from, to) {
            this.replay(this.spare, from);
            const found = [this.spare.row()];
            for (const { values, dt } of this.rows(from + 1, to)) {
                this.spare.react(values, dt);
                found.push(this.spare.row());
            }
            return found;
        }

        stimulus() { return writeStimulus(this.data, this.rows()); }

        trace() { return trace(this.data, this.rows()); }

        // The ticks until something that depends on time or on the plant changes; null if no timer runs towards a threshold, and nothing moves.
        toThreshold(values) {
            const machine = this.machine;
            this.runs ||= this.data.timers.map((timer) => machine.evaluator(timer.runs));
            let nearest = machine.plant ? machine.plant.toChange() : null;
            this.data.timers.forEach((timer, n) => {
                if (!this.runs[n](values, 0)) return;
                const now = machine.cells[machine.places[timer.cell]];
                for (const left of timer.down ? [now] : timer.at.map((at) => at - now)) {
                    if (left > 0 && (nearest === null || left < nearest)) nearest = left;
                }
            });
            return nearest;
        }
    };
})();
