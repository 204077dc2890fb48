/* The engine of a live page, and the worker in which it runs. */
/* SPDX-License-Identifier: Apache-2.0 */

/* Frames of a run are bytes already, those of the file are base64 (motion.js). */
const decode_text = decode;
globalThis.decode = (text) => (text instanceof ArrayBuffer ? text : decode_text(text));

const PATIENCE = 1500; /* ms; a run that takes longer ends where newer values are requested */

/* The bytes of the module, which the page has as base64 of gzip, filled up to three bytes. */
async function unpack(text, size) {
    if (typeof DecompressionStream === "undefined")
        throw new Error("this browser cannot unpack the engine (DecompressionStream); a browser of 2023 or later can");
    const unpacker = new DecompressionStream("gzip"), writer = unpacker.writable.getWriter(), parts = [];
    const written = writer.write(new Uint8Array(decode_text(text.trim()), 0, size)).then(() => writer.close());
    for (const reader = unpacker.readable.getReader(); ;) {
        const {done, value} = await reader.read();
        if (done)
            break;
        parts.push(value);
    }
    await written;
    const bytes = new Uint8Array(parts.reduce((size, part) => size + part.length, 0));
    parts.reduce((at, part) => { bytes.set(part, at); return at + part.length; }, 0);
    return bytes;
}

/* The worker, which is replaced where a run must end. */
class Bench {
    constructor(module, scene, answered) {
        Object.assign(this, {module, scene, answered, id: 0, is_busy: false, next: null});
        this.code = URL.createObjectURL(new Blob([find("worker").textContent], {type: "text/javascript"}));
        this.start();
    }

    start() {
        this.worker = new Worker(this.code);
        this.worker.onmessage = ({data}) => this.receive(data);
        this.worker.onerror = (event) => this.receive({id: this.id, faults: [`The engine stopped: ${event.message}`], notes: []});
        this.worker.postMessage({module: this.module, scene: this.scene});
        this.is_busy = false;
    }

    /* The latest request wins; earlier ones that have not begun are dropped. */
    request(values) {
        this.next = values;
        if (this.is_busy && performance.now() - this.since > PATIENCE)
            this.cancel();
        if (!this.is_busy)
            this.send();
    }

    send() {
        const values = this.next;
        this.next = null;
        this.is_busy = true;
        this.since = performance.now();
        this.worker.postMessage({...values, id: ++this.id});
    }

    cancel() {
        this.worker.terminate();
        this.start();
    }

    receive(answer) {
        if (answer.time === undefined) {
            this.is_busy = false;
            this.waited = performance.now() - this.since;
        }
        this.answered(answer);
        if (!this.is_busy && this.next !== null)
            this.send();
    }
}
