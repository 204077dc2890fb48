/* The engine in WebAssembly, for the worker of a page and for tests: texts and numbers in its memory, and the few functions that it imports.
 *
 *     const engine = new Engine(await WebAssembly.compile(bytes), {message: (rank, text) => ..., progress: (time) => ...});
 *     const page = engine.open(scene, ["simulate.tolerance=1e-6"]);
 *     engine.run(page), engine.result(page)
 */
/* SPDX-License-Identifier: Apache-2.0 */

const FAULT = 0, NOTE = 1; /* ranks of messages */
const FMI_OK = 0;

class Engine {
    constructor(module, {message, progress}) {
        this.decoder = new TextDecoder();
        const page = {message: (rank, text, size) => message(rank, this.text_at(text, size)), progress};
        const imports = {page, wasi_snapshot_preview1: {}};
        for (const {module: from, name} of WebAssembly.Module.imports(module))
            if (from === "wasi_snapshot_preview1")
                imports[from][name] = this.call_of_system(name);
        this.calls = new WebAssembly.Instance(module, imports).exports;
        this.calls._initialize();
    }

    /* A page has no files, clocks or processes. An assertion that fails writes and ends. */
    call_of_system(name) {
        const NO_FILE = 8, NO_CALL = 52;
        if (name === "proc_exit")
            return () => { throw new Error("the engine has ended itself; please report this scene"); };
        return () => (name.startsWith("fd_") ? NO_FILE : NO_CALL);
    }

    bytes(at, size) { return new Uint8Array(this.calls.memory.buffer, at, size); }

    text_at(at, size) { return this.decoder.decode(this.bytes(at, size)); }

    /* A text with a zero behind it, which the caller frees. */
    put_text(text) {
        const bytes = new TextEncoder().encode(text), at = this.room(bytes.length + 1);
        this.bytes(at, bytes.length + 1).set([...bytes, 0]);
        return {at, size: bytes.length};
    }

    room(size) {
        const at = this.calls.malloc(size);
        if (at === 0)
            throw new Error("the page has not enough memory");
        return at;
    }

    /* The handle of a scene in flow style with settings; 0 after messages. */
    open(scene, settings) {
        const text = this.put_text(scene), lines = this.put_text(settings.join("\n"));
        const page = this.calls.kt_page_open(text.at, text.size, lines.at);
        this.calls.free(text.at);
        this.calls.free(lines.at);
        return page;
    }

    close(page) { this.calls.kt_page_close(page); }

    /* Sets variables of FMI: a map of references to numbers. */
    set(page, values) {
        const count = values.length, at = this.room(12 * Math.max(1, count)), view = new DataView(this.calls.memory.buffer, at, 12 * count);
        values.forEach(([reference, value], i) => {
            view.setFloat64(8 * i, value, true);
            view.setUint32(8 * count + 4 * i, reference, true);
        });
        const status = this.calls.fmi3SetFloat64(this.calls.kt_page_instance(page), at + 8 * count, count, at, count);
        this.calls.free(at);
        return status === FMI_OK;
    }

    get(page, references) {
        const count = references.length, at = this.room(12 * Math.max(1, count));
        new Uint32Array(this.calls.memory.buffer, at + 8 * count, count).set(references);
        const status = this.calls.fmi3GetFloat64(this.calls.kt_page_instance(page), at + 8 * count, count, at, count);
        const values = new Float64Array(this.calls.memory.buffer.slice(at, at + 8 * count));
        this.calls.free(at);
        return status === FMI_OK ? values : null;
    }

    /* method: {integrator: "" for the scene's, step, tolerance, duration: NaN for the scene's, unprojected: loops drift, partition: in place of QR} */
    choose(page, {integrator = "", step = NaN, tolerance = NaN, duration = NaN, unprojected = false, partition = false}) {
        const name = this.put_text(integrator);
        this.calls.kt_page_choose(page, name.at, step, tolerance, duration, unprojected, partition);
        this.calls.free(name.at);
    }

    run(page) { return this.calls.kt_page_run(page) !== 0; }

    /* The mechanism and the frames of the last run: copies. */
    result(page) {
        const {kt_page_json, kt_page_json_size, kt_page_frames, kt_page_frames_size} = this.calls;
        const json = this.text_at(kt_page_json(page), kt_page_json_size(page));
        return {data: JSON.parse(json), frames: this.bytes(kt_page_frames(page), kt_page_frames_size(page)).slice().buffer};
    }

    /* What the controls show, and the cost of the last run. */
    state(page) {
        const at = this.calls.kt_page_state(page), all = this.bytes(at, this.calls.memory.buffer.byteLength - at);
        return JSON.parse(this.text_at(at, all.indexOf(0)));
    }
}
