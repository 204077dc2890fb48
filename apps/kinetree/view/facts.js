/* Facts that follow from the data of a view, without a page. */
/* SPDX-License-Identifier: Apache-2.0 */

/* The largest set of bodies with solids that joints, loops and effects join, the world left out; of equal ones the
 * heaviest: the robot, but not what lies around it. */
function largest_part(data) {
    const root = data.bodies.map((_, i) => i), find_root = (i) => (root[i] === i ? i : (root[i] = find_root(root[i])));
    const join = (a, b) => { if (a > 0 && b > 0) root[find_root(a)] = find_root(b); };
    data.bodies.forEach(({parent}, i) => join(i, parent));
    [...data.loops, ...data.effects].forEach(({ends, type}) => { if (ends.length === 2 && type !== "contact") join(ends[0].body, ends[1].body); });
    const parts = new Map();
    data.bodies.forEach(({mass, colour}, i) => {
        if (i === 0 || colour < 0 || !data.seen.has(i))
            return;
        const part = parts.get(find_root(i)) ?? {bodies: [], mass: 0};
        part.bodies.push(i);
        part.mass += mass;
        parts.set(find_root(i), part);
    });
    const is_before = (a, b) => a.bodies.length > b.bodies.length || (a.bodies.length === b.bodies.length && a.mass > b.mass);
    return [...parts.values()].reduce((best, part) => (is_before(part, best) ? part : best), {bodies: [], mass: -1}).bodies;
}

/* What follows from the data: what is seen and followed, the upward direction, and what is to the right. */
function complete(data) {
    data.seen = new Set(data.solids.map(({body}) => body));
    data.followed = largest_part(data);
    const along = (a, b) => Math.abs(dot(a, b)) > 0.999, z = [0, 0, 1], y = [0, 1, 0], x = [1, 0, 0];
    const weight = norm(data.gravity) > 0;
    data.up = weight ? scale(-1, unit(data.gravity)) : data.normal !== null && along(data.normal, z) ? y : z;
    if (data.normal !== null && !along(data.normal, data.up))
        data.east = unit(cross(data.up, data.normal));
    else
        data.east = unit(sub(along(data.up, x) ? y : x, scale(dot(along(data.up, x) ? y : x, data.up), data.up)));
}

/* A box, [lowest, highest], that holds p too. */
function widen(box, p) {
    p.forEach((x, k) => {
        box[0][k] = Math.min(box[0][k], x);
        box[1][k] = Math.max(box[1][k], x);
    });
}

/* A note as a sentence. One about a line of a file begins with the file's name, without its folder. */
function as_sentence(what) {
    const place = /^(?:[^\s:]*\/)?([^\s:/]+:\d.*)$/s.exec(what);
    return place !== null ? place[1] : `${what[0].toUpperCase()}${what.slice(1)}`;
}
