/* Painting with WebGL 2: solids as instances of a few meshes, whose bodies' poses are in a texture, and lines as
 * rectangles of some pixels' width. The same solids, painted with numbers for colours, tell what is under the pointer. */
/* SPDX-License-Identifier: Apache-2.0 */

const SOLID_VERTEX = `#version 300 es
precision highp float;
uniform mat4 view;
uniform highp sampler2D poses;
uniform int row;
layout(location = 0) in vec3 point;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 at;
layout(location = 3) in vec4 turned;
layout(location = 4) in vec3 half_size;
layout(location = 5) in vec4 colour;
layout(location = 6) in vec3 body_id_mark;
out vec3 place;
out vec3 local;
out vec3 facing;
out vec4 tint;
flat out float id;
vec3 turn(vec4 q, vec3 u) { return u + 2.0 * cross(q.yzw, cross(q.yzw, u) + q.x * u); }
void main() {
    int body = int(body_id_mark.x);
    ivec2 texel = ivec2(2 * (body % row), body / row);
    vec3 origin = texelFetch(poses, texel, 0).xyz;
    vec4 q = texelFetch(poses, texel + ivec2(1, 0), 0);
    place = origin + turn(q, at + turn(turned, half_size * point));
    facing = turn(q, turn(turned, normal / half_size));
    tint = colour;
    local = body_id_mark.z > 0.5 ? point : vec3(0.0);
    id = body_id_mark.y;
    gl_Position = view * vec4(place, 1.0);
}`;

const SOLID_FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 eye; /* w: 0 parallel, its direction; 1 perspective, its place */
uniform vec3 light;
uniform float opacity;
uniform bool numbers;
in vec3 place;
in vec3 facing;
in vec3 local; /* of marked solids the point of the mesh, else zeros */
in vec4 tint;
flat in float id;
out vec4 paint;
void main() {
    if (numbers) {
        int n = int(id);
        paint = vec4(float(n & 255), float((n >> 8) & 255), float((n >> 16) & 255), 255.0) / 255.0;
        return;
    }
    vec3 n = normalize(facing), to_eye = normalize(eye.w > 0.5 ? eye.xyz - place : eye.xyz);
    float rim = 1.0 - abs(dot(n, to_eye));
    float shade = 0.58 + 0.30 * max(dot(n, light), 0.0) + 0.18 * abs(dot(n, to_eye));
    float gloss = pow(max(dot(reflect(-light, n), to_eye), 0.0), 24.0);
    if (local.x * local.y > 0.0)
        shade *= 0.8; /* two quarters of round solids, so that their rotation shows */
    paint = vec4(tint.rgb * shade * (1.0 - 0.25 * rim * rim * rim) + 0.10 * gloss, tint.a * opacity);
}`;

const LINE_VERTEX = `#version 300 es
precision highp float;
uniform mat4 view;
uniform vec2 pixels; /* of the page */
uniform float width;
layout(location = 0) in vec2 corner; /* x: 0 or 1 along, y: -1 or 1 across */
layout(location = 1) in vec3 from;
layout(location = 2) in vec3 to;
layout(location = 3) in vec4 from_colour;
layout(location = 4) in vec4 to_colour;
out vec4 tint;
void main() {
    vec4 a = view * vec4(from, 1.0), b = view * vec4(to, 1.0);
    float near_a = a.z + a.w, near_b = b.z + b.w; /* both sides of the near plane */
    if (near_a < 0.0 && near_b > 0.0)
        a = mix(a, b, near_a / (near_a - near_b) + 1e-4);
    else if (near_b < 0.0 && near_a > 0.0)
        b = mix(b, a, near_b / (near_b - near_a) + 1e-4);
    vec2 along = (b.xy / b.w - a.xy / a.w) * pixels;
    vec2 across = length(along) > 1e-6 ? normalize(vec2(-along.y, along.x)) : vec2(0.0, 1.0);
    vec4 end = corner.x < 0.5 ? a : b;
    end.xy += corner.y * across * width / pixels * end.w;
    gl_Position = near_a < 0.0 && near_b < 0.0 ? vec4(0.0, 0.0, 2.0, 1.0) : end;
    tint = corner.x < 0.5 ? from_colour : to_colour;
}`;

const LINE_FRAGMENT = `#version 300 es
precision highp float;
in vec4 tint;
out vec4 paint;
void main() { paint = tint; }`;

/* ---- meshes: points and normals, three points a triangle --------------------------------------------------------- */

function box_mesh() {
    const points = [], normals = [];
    for (let axis = 0; axis < 3; axis++)
        for (const side of [-1, 1])
            for (const [u, v] of [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]]) {
                const point = [0, 0, 0], normal = [0, 0, 0];
                point[axis] = normal[axis] = side;
                point[(axis + 1) % 3] = u * side;
                point[(axis + 2) % 3] = v;
                points.push(...point);
                normals.push(...normal);
            }
    return {points, normals};
}

/* A surface of revolution about z: rows of [radius, height, normal's radius, normal's height]. */
function turned_mesh(rows, sides) {
    const points = [], normals = [];
    const corner = ([r, h, nr, nh], k) => {
        const c = Math.cos((2 * Math.PI * k) / sides), s = Math.sin((2 * Math.PI * k) / sides);
        points.push(r * c, r * s, h);
        normals.push(nr * c, nr * s, nh);
    };
    for (let i = 0; i + 1 < rows.length; i++)
        for (let k = 0; k < sides; k++) {
            const [a, b] = [rows[i], rows[i + 1]];
            if (b[0] > 0)
                corner(a, k), corner(b, k + 1), corner(b, k);
            if (a[0] > 0)
                corner(a, k), corner(a, k + 1), corner(b, k + 1);
        }
    return {points, normals};
}

function sphere_mesh(sides) {
    const rows = [], half = Math.max(4, sides >> 1);
    for (let i = 0; i <= half; i++) {
        const a = (Math.PI * i) / half, s = i === 0 || i === half ? 0 : Math.sin(a);
        rows.push([s, Math.cos(a), s, Math.cos(a)]);
    }
    return turned_mesh(rows, sides);
}

const join_meshes = (...all) => ({points: all.flatMap((m) => m.points), normals: all.flatMap((m) => m.normals)});

const cylinder_mesh = (sides) => join_meshes(
    turned_mesh([[0, 1, 0, 1], [1, 1, 0, 1]], sides),
    turned_mesh([[1, 1, 1, 0], [1, -1, 1, 0]], sides),
    turned_mesh([[1, -1, 0, -1], [0, -1, 0, -1]], sides));

/* From its base at z = -1 to its tip at z = 1. */
const cone_mesh = (sides) => join_meshes(
    turned_mesh([[1e-6, 1, 2, 1], [1, -1, 2, 1]], sides),
    turned_mesh([[1, -1, 0, -1], [0, -1, 0, -1]], sides));

/* ---- the painter ------------------------------------------------------------------------------------------------- */

const INSTANCE_FLOATS = 14; /* place 3, quaternion 4, half 3, colour as four bytes 1, body, id, mark */
const POSES_A_ROW = 512;

function compile(gl, vertex, fragment) {
    const program = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
        const shader = gl.createShader(type);
        gl.shaderSource(shader, source);
        gl.compileShader(shader);
        if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost())
            throw new Error(gl.getShaderInfoLog(shader));
        gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    const uniforms = {};
    for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); i++) {
        const name = gl.getActiveUniform(program, i).name;
        uniforms[name] = gl.getUniformLocation(program, name);
    }
    return {program, uniforms};
}

/* A growing list of floats, kept from frame to frame. A colour, [red, green, blue, opacity] from 0 to 1, takes the
 * place of one float as four bytes, so that all travel as bits. */
class Numbers {
    constructor() {
        this.floats = new Float32Array(1024);
        this.bits = new Uint32Array(this.floats.buffer);
        this.used = 0;
    }
    clear() { this.used = 0; }
    push(x) {
        if (this.used === this.floats.length) {
            const more = new Float32Array(2 * this.used);
            new Uint32Array(more.buffer).set(this.bits);
            this.floats = more;
            this.bits = new Uint32Array(more.buffer);
        }
        this.floats[this.used++] = x;
    }
    push_all(...list) {
        for (const x of list)
            this.push(x);
    }
    push_colour(c) {
        this.push(0);
        this.bits[this.used - 1] = (Math.round(255 * clamp(c[0], 0, 1)) | (Math.round(255 * clamp(c[1], 0, 1)) << 8) |
            (Math.round(255 * clamp(c[2], 0, 1)) << 16) | (Math.round(255 * clamp(c[3], 0, 1)) << 24)) >>> 0;
    }
    get view() { return this.bits.subarray(0, this.used); }
}

class Painter {
    constructor(canvas, body_count) {
        const gl = canvas.getContext("webgl2", {antialias: true, alpha: false, powerPreference: "high-performance"});
        if (gl === null)
            throw new Error("this browser has no WebGL 2");
        this.gl = gl;
        this.canvas = canvas;
        this.rows = Math.max(1, Math.ceil(body_count / POSES_A_ROW));
        this.poses = new Float32Array(8 * POSES_A_ROW * this.rows);
        this.start();
    }

    /* Everything that is lost with the context. */
    start() {
        const gl = this.gl;
        this.solid = compile(gl, SOLID_VERTEX, SOLID_FRAGMENT);
        this.line = compile(gl, LINE_VERTEX, LINE_FRAGMENT);
        this.meshes = new Map();
        this.batches = new Set();
        this.texture = this.make_texture();
        this.corners = gl.createBuffer();
        gl.bindBuffer(gl.ARRAY_BUFFER, this.corners);
        gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([0, -1, 1, -1, 0, 1, 1, 1]), gl.STATIC_DRAW);
        this.picked = null;
    }

    make_texture() {
        const gl = this.gl, texture = gl.createTexture();
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
        gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, 2 * POSES_A_ROW, this.rows);
        return texture;
    }

    /* A texture of poses, eight numbers a body. */
    set_poses(texture, poses) {
        const gl = this.gl;
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 2 * POSES_A_ROW, this.rows, gl.RGBA, gl.FLOAT, poses);
    }

    /* Points and normals in shares, six numbers a point. */
    add_mesh(name, numbers) {
        this.surfaces ??= new Map();
        this.surfaces.set(name, Float32Array.from(numbers, (x) => x / 32767));
    }

    mesh(name, sides) {
        const key = `${name} ${sides}`, gl = this.gl, surface = this.surfaces?.get(name);
        if (!this.meshes.has(key) && surface !== undefined) {
            const buffer = gl.createBuffer();
            gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
            gl.bufferData(gl.ARRAY_BUFFER, surface, gl.STATIC_DRAW);
            this.meshes.set(key, {buffer, count: surface.length / 6});
        } else if (!this.meshes.has(key)) {
            const make = {box: box_mesh, sphere: sphere_mesh, end: sphere_mesh, cylinder: cylinder_mesh, cone: cone_mesh}[name];
            const {points, normals} = make(sides), mixed = new Float32Array(2 * points.length);
            for (let i = 0; i < points.length / 3; i++)
                mixed.set([...points.slice(3 * i, 3 * i + 3), ...normals.slice(3 * i, 3 * i + 3)], 6 * i);
            const buffer = gl.createBuffer();
            gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
            gl.bufferData(gl.ARRAY_BUFFER, mixed, gl.STATIC_DRAW);
            this.meshes.set(key, {buffer, count: points.length / 3});
        }
        return this.meshes.get(key);
    }

    /* Instances of one mesh, in Numbers of INSTANCE_FLOATS each, none of them wider than `radius`. */
    make_batch(name, radius) {
        return {name, radius, numbers: new Numbers(), buffer: this.gl.createBuffer(), is_changed: true, sides: 0, array: null};
    }

    /* Joins the mesh and the instances; the sides may change from one picture to the next. */
    ready_batch(batch, sides) {
        const gl = this.gl;
        gl.bindBuffer(gl.ARRAY_BUFFER, batch.buffer);
        if (batch.is_changed)
            gl.bufferData(gl.ARRAY_BUFFER, batch.numbers.view, gl.DYNAMIC_DRAW);
        batch.is_changed = false;
        if (batch.sides === sides)
            return gl.bindVertexArray(batch.array);
        batch.sides = sides;
        batch.mesh = this.mesh(batch.name, sides);
        batch.array = gl.createVertexArray();
        gl.bindVertexArray(batch.array);
        gl.bindBuffer(gl.ARRAY_BUFFER, batch.mesh.buffer);
        this.attribute(0, 3, gl.FLOAT, 24, 0, 0);
        this.attribute(1, 3, gl.FLOAT, 24, 12, 0);
        gl.bindBuffer(gl.ARRAY_BUFFER, batch.buffer);
        const stride = 4 * INSTANCE_FLOATS;
        this.attribute(2, 3, gl.FLOAT, stride, 0, 1);
        this.attribute(3, 4, gl.FLOAT, stride, 12, 1);
        this.attribute(4, 3, gl.FLOAT, stride, 28, 1);
        this.attribute(5, 4, gl.UNSIGNED_BYTE, stride, 40, 1);
        this.attribute(6, 3, gl.FLOAT, stride, 44, 1);
    }

    attribute(index, size, type, stride, offset, divisor) {
        const gl = this.gl;
        gl.enableVertexAttribArray(index);
        gl.vertexAttribPointer(index, size, type, type === gl.UNSIGNED_BYTE, stride, offset);
        gl.vertexAttribDivisor(index, divisor);
    }

    /* Lines in Numbers of four each: point and colour. A strip joins all points, else every two are a line. */
    make_lines(width, is_strip) {
        return {numbers: new Numbers(), buffer: this.gl.createBuffer(), is_changed: true, width, is_strip, array: null};
    }

    begin(width, height, background) {
        const gl = this.gl;
        gl.viewport(0, 0, width, height);
        gl.clearColor(...background, 1);
        gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
        gl.enable(gl.DEPTH_TEST);
        gl.depthFunc(gl.LEQUAL);
    }

    /* What lies behind something: what is drawn between this and the next call is drawn there alone. */
    behind(draw) {
        this.gl.depthFunc(this.gl.GREATER);
        draw();
        this.gl.depthFunc(this.gl.LEQUAL);
    }

    /* camera: view (16 numbers), eye [x, y, z, w], light, scale (pixels a metre). sides: the most that a circle has. */
    paint_solids(batches, camera, texture, sides, opacity = 1, as_numbers = false) {
        const gl = this.gl, u = this.solid.uniforms;
        gl.useProgram(this.solid.program);
        gl.uniformMatrix4fv(u.view, false, camera.view);
        gl.uniform4fv(u.eye, camera.eye);
        gl.uniform3fv(u.light, camera.light);
        gl.uniform1f(u.opacity, opacity);
        gl.uniform1i(u.numbers, as_numbers ? 1 : 0);
        gl.uniform1i(u.row, POSES_A_ROW);
        gl.bindTexture(gl.TEXTURE_2D, texture);
        if (opacity < 1) {
            gl.enable(gl.BLEND);
            gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
            gl.depthMask(false);
        }
        for (const batch of batches) {
            const count = batch.numbers.used / INSTANCE_FLOATS, pixels = batch.radius * camera.scale;
            if (count === 0 || (batch.name === "end" && pixels < 1))
                continue;
            this.ready_batch(batch, batch.name === "box" || batch.name.startsWith("mesh") ? 4 : clamp(4 + 2 * Math.round(1.5 * Math.sqrt(pixels)), 6, sides));
            gl.drawArraysInstanced(gl.TRIANGLES, 0, batch.mesh.count, count);
        }
        gl.bindVertexArray(null);
        gl.disable(gl.BLEND);
        gl.depthMask(true);
    }

    paint_lines(all, camera, pixels) {
        const gl = this.gl, u = this.line.uniforms;
        gl.useProgram(this.line.program);
        gl.uniformMatrix4fv(u.view, false, camera.view);
        gl.uniform2fv(u.pixels, pixels);
        gl.enable(gl.BLEND);
        gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
        for (const lines of all) {
            const points = lines.numbers.used / 4, count = lines.is_strip ? points - 1 : points / 2;
            if (count < 1)
                continue;
            this.ready_lines(lines);
            gl.uniform1f(u.width, lines.width);
            gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count);
        }
        gl.bindVertexArray(null);
        gl.disable(gl.BLEND);
    }

    ready_lines(lines) {
        const gl = this.gl, stride = lines.is_strip ? 16 : 32;
        gl.bindBuffer(gl.ARRAY_BUFFER, lines.buffer);
        if (lines.is_changed)
            gl.bufferData(gl.ARRAY_BUFFER, lines.numbers.view, gl.DYNAMIC_DRAW);
        lines.is_changed = false;
        if (lines.array !== null)
            return gl.bindVertexArray(lines.array);
        lines.array = gl.createVertexArray();
        gl.bindVertexArray(lines.array);
        gl.bindBuffer(gl.ARRAY_BUFFER, this.corners);
        this.attribute(0, 2, gl.FLOAT, 8, 0, 0);
        gl.bindBuffer(gl.ARRAY_BUFFER, lines.buffer);
        this.attribute(1, 3, gl.FLOAT, stride, 0, 1);
        this.attribute(2, 3, gl.FLOAT, stride, 16, 1);
        this.attribute(3, 4, gl.UNSIGNED_BYTE, stride, 12, 1);
        this.attribute(4, 4, gl.UNSIGNED_BYTE, stride, 28, 1);
    }

    /* A buffer of its own for numbers in place of colours, as large as the picture. */
    begin_numbers(width, height) {
        const gl = this.gl;
        if (this.picked === null || this.picked.width !== width || this.picked.height !== height) {
            if (this.picked !== null) {
                gl.deleteFramebuffer(this.picked.frame);
                this.picked.parts.forEach((part) => gl.deleteRenderbuffer(part));
            }
            const frame = gl.createFramebuffer(), parts = [gl.createRenderbuffer(), gl.createRenderbuffer()];
            gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
            [[gl.RGBA8, gl.COLOR_ATTACHMENT0], [gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT]].forEach(([format, to], i) => {
                gl.bindRenderbuffer(gl.RENDERBUFFER, parts[i]);
                gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
                gl.framebufferRenderbuffer(gl.FRAMEBUFFER, to, gl.RENDERBUFFER, parts[i]);
            });
            this.picked = {frame, parts, width, height};
        }
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.picked.frame);
        this.begin(width, height, [0, 0, 0]);
    }

    /* Ends it, and returns the numbers in a rectangle; 0: nothing is there. */
    end_numbers(x, y, width, height) {
        const gl = this.gl, bytes = new Uint8Array(4 * width * height);
        gl.readPixels(x, y, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
        gl.bindFramebuffer(gl.FRAMEBUFFER, null);
        const numbers = new Uint32Array(width * height);
        for (let i = 0; i < numbers.length; i++)
            numbers[i] = bytes[4 * i] | (bytes[4 * i + 1] << 8) | (bytes[4 * i + 2] << 16);
        return numbers;
    }
}
