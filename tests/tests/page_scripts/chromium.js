// Starts chromium without a window and drives it through the DevTools protocol on a pipe: no port, no network, no library.
const { spawn } = require("child_process");

class Chromium {
    constructor(program, profile) {
        const options = ["--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking", "--remote-debugging-pipe"];
        this.process = spawn(program, [...options, `--user-data-dir=${profile}`, "about:blank"], { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
        this.number = 0;
        this.waiting = new Map();
        this.listeners = [];
        let text = "";
        this.process.stdio[4].setEncoding("utf8");
        this.process.stdio[4].on("data", (part) => {
            text += part;
            const messages = text.split("\0");
            text = messages.pop();
            for (const message of messages) this.receive(JSON.parse(message));
        });
        this.process.on("error", (error) => { throw error; });
    }

    receive(message) {
        const wait = this.waiting.get(message.id);
        if (!wait) {
            for (const listener of this.listeners) listener(message);
            return;
        }
        this.waiting.delete(message.id);
        if (message.error) wait.reject(new Error(`${wait.method}: ${message.error.message}`));
        else wait.resolve(message.result);
    }

    send(method, params = {}, sessionId = undefined) {
        const id = ++this.number;
        this.process.stdio[3].write(JSON.stringify({ id, method, params, sessionId }) + "\0");
        return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject, method }));
    }

    async close() {
        const ended = new Promise((resolve) => this.process.on("exit", resolve));
        await this.send("Browser.close").catch(() => {});
        await ended;
    }

    // A tab with `width` and `height` in CSS pixels, which records what its page reports and requests.
    async tab({ width = 1280, height = 900 } = {}) {
        const { targetId } = await this.send("Target.createTarget", { url: "about:blank", newWindow: true, width, height });
        const { sessionId } = await this.send("Target.attachToTarget", { targetId, flatten: true });
        const tab = new Tab(this, sessionId, targetId);
        for (const domain of ["Page", "Runtime", "Log", "Network"]) await tab.send(`${domain}.enable`);
        return tab;
    }
}

class Tab {
    constructor(browser, sessionId, targetId) {
        this.browser = browser;
        this.targetId = targetId;
        this.sessionId = sessionId;
        // Errors and warnings of the console, and the addresses that the page asked for.
        this.problems = [];
        this.requests = [];
        browser.listeners.push((message) => { if (message.sessionId === sessionId) this.event(message); });
    }

    event({ method, params }) {
        if (method === "Runtime.exceptionThrown") this.problems.push(params.exceptionDetails.exception?.description || params.exceptionDetails.text);
        if (method === "Runtime.consoleAPICalled" && ["error", "warning", "assert"].includes(params.type)) this.problems.push(JSON.stringify(params.args));
        if (method === "Log.entryAdded") this.problems.push(params.entry.text);
        if (method === "Network.requestWillBeSent") this.requests.push(params.request.url);
        if (method === "Page.loadEventFired" && this.loaded) this.loaded();
    }

    send(method, params) { return this.browser.send(method, params, this.sessionId); }

    close() { return this.browser.send("Target.closeTarget", { targetId: this.targetId }); }

    async open(url) {
        const loaded = new Promise((resolve) => { this.loaded = resolve; });
        await this.send("Page.navigate", { url });
        await loaded;
    }

    // The value of an expression in the page; a promise is awaited.
    async value(expression) {
        const { result, exceptionDetails } = await this.send("Runtime.evaluate", { expression, awaitPromise: true, returnByValue: true });
        if (exceptionDetails) throw new Error(`${expression}: ${exceptionDetails.exception?.description || exceptionDetails.text}`);
        return result.value;
    }

    // Waits until an expression is true.
    async until(expression, seconds = 20) {
        const end = Date.now() + seconds * 1000;
        while (!await this.value(expression)) {
            if (Date.now() > end) throw new Error(`not true after ${seconds} s: ${expression}`);
            await new Promise((resolve) => setTimeout(resolve, 20));
        }
    }

    // Presses and releases a key: a character, or a name such as `ArrowLeft`.
    async key(key) {
        const text = key.length === 1 ? key : key === "Enter" ? "\r" : undefined;
        const code = { Enter: 13, Escape: 27, Tab: 9, " ": 32 }[key];
        await this.send("Input.dispatchKeyEvent", { type: "keyDown", key, text, windowsVirtualKeyCode: code });
        await this.send("Input.dispatchKeyEvent", { type: "keyUp", key, windowsVirtualKeyCode: code });
    }

    // Presses and releases the mouse in the middle of an element.
    async press(selector) {
        const [x, y] = await this.value(`{
            const element = document.querySelector(${JSON.stringify(selector)});
            element.scrollIntoView({ block: "center" });
            const box = element.getBoundingClientRect();
            [box.x + box.width / 2, box.y + box.height / 2];
        }`);
        for (const type of ["mousePressed", "mouseReleased"]) await this.send("Input.dispatchMouseEvent", { type, x, y, button: "left", clickCount: 1 });
    }

    async keys(text) { for (const key of text) await this.key(key); }
}

module.exports = { Chromium };
