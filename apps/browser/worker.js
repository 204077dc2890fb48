/* The worker of a live page: one run for each request. The scene is opened again only if its settings have changed.
 *
 *     request: {id, settings, parameters: [[reference, value], ...], method}
 *     answers: {id, time} while the run goes on; at its end {id, notes, faults, state, ms}, with data and frames if there are any
 */
/* SPDX-License-Identifier: Apache-2.0 */

let engine = null, scene = "", opened = {page: 0, key: null, notes: []}, id = 0, reported = 0;
let notes = [], faults = [];

function report_progress(time) {
    const now = performance.now();
    if (now - reported < 50)
        return;
    reported = now;
    postMessage({id, time});
}

/* The handle of the scene with these settings; 0 after messages. */
function open_scene(settings) {
    const key = settings.join("\n");
    if (opened.page !== 0 && opened.key === key) {
        notes = [...opened.notes];
        return opened.page;
    }
    if (opened.page !== 0)
        engine.close(opened.page);
    opened = {page: engine.open(scene, settings), key, notes: [...notes]};
    return opened.page;
}

function answer({settings, parameters, method}) {
    const start = performance.now(), page = open_scene(settings);
    if (page === 0 || !engine.set(page, parameters))
        return {};
    engine.choose(page, method);
    const is_run = engine.run(page), ms = performance.now() - start;
    return {state: engine.state(page), ms, ...(is_run ? engine.result(page) : {})};
}

onmessage = ({data: request}) => {
    if (request.module !== undefined) {
        ({scene} = request);
        engine = new Engine(request.module, {message: (rank, text) => (rank === NOTE ? notes : faults).push(text), progress: report_progress});
        return;
    }
    ({id} = request);
    notes = [];
    faults = [];
    reported = performance.now();
    let result = {};
    try {
        result = answer(request);
    } catch (error) {
        faults.push(`The engine stopped: ${error.message}`);
        opened = {page: 0, key: null, notes: []};
    }
    postMessage({id, notes, faults, ...result}, result.frames !== undefined ? [result.frames] : []);
};
