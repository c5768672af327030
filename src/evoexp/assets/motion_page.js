// Plays motions: a stage (WebGL, with names and ways drawn over it) and a chart of the clearance for each, one clock for all.
(() => {
  const G = geometry, $ = id => document.getElementById(id);
  const DURATION = 8, FIT = 2.35;  // [s] of every motion at speed 1; [-] distance from which a scene fills the stage
  const GHOSTS = { start: 0.22, end: 0.38 }, LINE = 2.6, THIN = 1.8;  // [-] opacity, [px] half width of links without one
  const state = { share: 0, playing: false, last: null, ghosts: true, ways: true };

  const VERTEX = `attribute vec3 at, normal; uniform mat4 model, view, lens; uniform float swell; varying vec3 n, p;
    void main() { vec4 q = view * model * vec4(at + swell * normal, 1.0); n = mat3(view) * mat3(model) * normal; p = q.xyz;
      gl_Position = lens * q; }`;
  const FRAGMENT = `precision mediump float; uniform vec4 colour; uniform float lit, flatly, rim; varying vec3 n, p;
    void main() { vec3 m = normalize(n), eye = mix(normalize(-p), vec3(0.0, 0.0, 1.0), flatly); float facing = abs(dot(m, eye));
      float shade = mix(1.0, 0.5 + 0.42 * max(dot(m, normalize(vec3(0.35, 0.65, 0.7))), 0.0) + 0.16 * facing, lit);
      shade *= mix(1.0, mix(0.62, 1.0, smoothstep(0.0, 0.45, facing)), rim);
      gl_FragColor = vec4(colour.rgb * shade * colour.a, colour.a); }`;

  const css = name => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  const rgb = hex => [1, 3, 5].map(k => parseInt(hex.slice(k, k + 2), 16) / 255);
  const numbers = text => new Float32Array(Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer);
  const shown = (v, digits = 3) => v === null || !isFinite(v) ? "–" : String(Number(v.toPrecision(digits)));
  const element = (kind, attributes = {}, ...children) => {
    const made = Object.assign(document.createElement(kind), attributes);
    made.append(...children);
    return made;
  };

  function written(pen, text, x, y, colour, behind) {  // with a rim, so that lines behind it do not cross it out
    pen.lineJoin = "round"; pen.lineWidth = 3.5; pen.strokeStyle = behind; pen.strokeText(text, x, y);
    pen.fillStyle = colour; pen.fillText(text, x, y);
  }
  function sized(canvas) {  // in device pixels; whether anything is to be seen
    const scale = Math.max(2, window.devicePixelRatio || 1), { clientWidth: w, clientHeight: h } = canvas;
    if (canvas.width !== Math.round(w * scale) || canvas.height !== Math.round(h * scale)) {
      canvas.width = Math.round(w * scale); canvas.height = Math.round(h * scale);
    }
    return { w, h, scale, seen: w > 1 && h > 1 };
  }
  function niceStep(span, count) {
    const raw = span / count, power = 10 ** Math.floor(Math.log10(raw));
    return [1, 2, 5, 10].map(k => k * power).find(step => step >= raw);
  }

  class Clock {  // ticks of one motion
    constructor(motion) { this.times = numbers(motion.times); this.last = this.times[this.times.length - 1]; }
    at(share) {
      const t = share * this.last;
      let low = 0, high = this.times.length - 1;
      while (high - low > 1) { const middle = (low + high) >> 1; if (this.times[middle] <= t) low = middle; else high = middle; }
      const width = this.times[high] - this.times[low];
      return { t, low, high, u: width > 0 ? (t - this.times[low]) / width : 0 };
    }
  }

  class Stage {
    constructor(motion, clock, box) {
      Object.assign(this, { motion, clock, box });
      this.canvas = box.appendChild(element("canvas"));
      this.over = box.appendChild(element("canvas", { className: "over" }));
      this.gl = this.canvas.getContext("webgl", { antialias: true, alpha: false });
      this.poses = numbers(motion.poses);
      this.ways = motion.ways.map(way => ({ ...way, points: numbers(way.points) }));
      this.reset();
      this.listen();
      if (this.gl) this.prepare(); else box.append(element("p", { textContent: "This browser shows no WebGL: no picture here." }));
    }
    reset() {
      const { center, radius, planar } = this.motion;
      this.eye = { center: [...center], distance: FIT * radius, turn: -0.9, lift: 0.42, half: 0, planar };
    }
    prepare() {
      const gl = this.gl, program = this.program = gl.createProgram();
      for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
        const shader = gl.createShader(kind);
        gl.shaderSource(shader, text); gl.compileShader(shader); gl.attachShader(program, shader);
      }
      gl.linkProgram(program); gl.useProgram(program);
      this.where = name => gl.getUniformLocation(program, name);
      for (const name of ["model", "view", "lens", "swell", "colour", "lit", "flatly", "rim"]) this[`u_${name}`] = this.where(name);
      const made = new Map();
      this.shapes = this.motion.shapes.map(shape => {
        const key = JSON.stringify([shape.kind, shape.size, shape.points]);
        if (!made.has(key)) made.set(key, { ...this.upload(G.surface(shape, this.motion.radius, this.motion.planar)), open: shape.kind === "mesh" });
        return { ...shape, local: G.fromPose(shape.pose), buffer: made.get(key) };
      });
      this.floor = this.upload(this.grid());
      gl.enable(gl.BLEND); gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA); gl.enable(gl.CULL_FACE);
    }
    upload(list) {
      const gl = this.gl, buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(list), gl.STATIC_DRAW);
      return { buffer, count: list.length / 6 };
    }
    grid() {  // lines of the plane z = 0
      const { center, radius } = this.motion, out = [], step = this.step = niceStep(2 * radius, 10);
      const [x0, y0] = [0, 1].map(k => step * Math.floor((center[k] - 1.6 * radius) / step));
      const [x1, y1] = [0, 1].map(k => step * Math.ceil((center[k] + 1.6 * radius) / step));
      for (let x = x0; x <= x1 + step / 2; x += step) out.push(x, y0, 0, 0, 0, 1, x, y1, 0, 0, 0, 1);
      for (let y = y0; y <= y1 + step / 2; y += step) out.push(x0, y, 0, 0, 0, 1, x1, y, 0, 0, 0, 1);
      return out;
    }
    lens(w, h) {
      const { radius } = this.motion, { center, distance, turn, lift, planar } = this.eye, aspect = w / h;
      if (planar) {
        const [x, y] = this.motion.extent, half = distance / (FIT * radius) * 1.1 * Math.max(y, x / aspect);
        this.pixel = 2 * half / h;
        this.view = G.lookAt([center[0], center[1], center[2] + 50 * radius], center, [0, 1, 0]);
        this.project = G.orthographic(half, aspect, radius, 100 * radius);
      } else {
        const tan = 0.42 * Math.max(1, 1 / aspect), c = Math.cos(lift);
        this.pixel = 2 * distance * tan / h;
        const eye = [Math.cos(turn) * c, Math.sin(turn) * c, Math.sin(lift)].map((v, k) => center[k] + distance * v);
        this.view = G.lookAt(eye, center, [0, 0, 1]);
        this.project = G.perspective(tan, aspect, 0.02 * distance, distance + 12 * radius);
      }
      this.whole = G.times(this.project, this.view);
    }
    seen(point, w, h) {  // a point of the world, in CSS pixels
      const [x, y, , v] = G.applied(this.whole, point);
      return v > 0 ? [(x / v + 1) / 2 * w, (1 - y / v) / 2 * h] : null;
    }
    model(shape, tick) {
      if (shape.frame < 0) return shape.local;
      const n = 7 * this.motion.frames, pose = G.between(this.poses, tick.low * n + 7 * shape.frame, tick.high * n + 7 * shape.frame, tick.u);
      return G.times(G.fromPose(pose), shape.local);
    }
    draw(share) {
      const { w, h, scale, seen } = sized(this.canvas);
      if (!seen) return;
      this.lens(w, h);
      const now = this.clock.at(share), touching = this.touching(now);
      if (this.gl) this.paint(now, touching, w * scale, h * scale);
      this.annotate(now, w, h);
    }
    touching(now) {  // names of the bodies that touch now
      const tick = now.u < 0.5 ? now.low : now.high;
      const contact = this.motion.contacts.find(([begin, end]) => begin - 1e-6 <= now.t && now.t <= end + 1e-6);
      if (!contact) return new Set();
      const nearest = this.motion.clearance[tick] === 0 ? this.motion.pairs[this.motion.nearest[tick]] : contact[2];
      return new Set(nearest.split(" – "));
    }
    paint(now, touching, w, h) {
      const gl = this.gl, planar = this.eye.planar, still = this.clock, first = still.at(0), last = still.at(1);
      gl.viewport(0, 0, w, h);
      gl.clearColor(...rgb(css("stage")), 1);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.uniformMatrix4fv(this.u_view, false, this.view);
      gl.uniformMatrix4fv(this.u_lens, false, this.project);
      gl.uniform1f(this.u_lit, planar ? 0 : 1); gl.uniform1f(this.u_flatly, planar ? 1 : 0);
      gl.disable(gl.DEPTH_TEST); gl.depthMask(true);
      this.put(this.floor, G.fromPose([0, 0, 0, 0, 0, 0, 1]), rgb(css("grid")), 1, 0, gl.LINES);
      const solid = this.shapes.filter(s => s.role === "arm"), things = this.shapes.filter(s => s.role === "object");
      const walls = this.shapes.filter(s => s.role === "obstacle");
      const colour = s => touching.has(s.name) ? rgb(css("bad")) : s.role === "arm" ? rgb(s.colour) : rgb(css(s.role));
      const body = (s, tick, opacity, tint = colour(s)) => {
        gl.uniform1f(this.u_rim, planar && !s.line ? 1 : 0);
        this.put(s.buffer, this.model(s, tick), tint, opacity, this.swell(s));
      };
      const ghosts = () => {
        if (!state.ghosts) return;
        for (const [tick, opacity] of [[first, GHOSTS.start], [last, GHOSTS.end]]) {
          for (const s of [...things, ...solid]) if (s.frame >= 0) {
            body(s, tick, opacity * (s.line ? 1.4 : 1), s.role === "arm" ? rgb(s.colour) : rgb(css("object")));
          }
        }
      };
      const wall = s => body(s, now, touching.has(s.name) ? 0.6 : planar ? 0.5 : s.kind === "half_space" ? 0.1 : 0.34);
      if (planar) {
        walls.forEach(wall); ghosts(); things.forEach(s => body(s, now, 0.9)); solid.forEach(s => body(s, now, 1));
        return;
      }
      gl.enable(gl.DEPTH_TEST);
      [...solid, ...things].forEach(s => body(s, now, 1));
      gl.depthMask(false);
      ghosts();
      const depth = s => G.applied(this.view, this.model(s, now).slice(12, 15))[2];
      walls.map(s => [depth(s), s]).sort((a, b) => a[0] - b[0]).forEach(([, s]) => wall(s));
      gl.depthMask(true);
    }
    swell(shape) {  // links without thickness get that of a line
      return shape.line ? LINE * this.pixel : shape.kind === "capsule" ? Math.max(0, THIN * this.pixel - shape.size[0]) : 0;
    }
    put({ buffer, count, open }, model, tint, opacity, swell, mode = this.gl.TRIANGLES) {
      const gl = this.gl;
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      for (const [name, offset] of [["at", 0], ["normal", 12]]) {
        const place = gl.getAttribLocation(this.program, name);
        gl.enableVertexAttribArray(place);
        gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 24, offset);
      }
      gl.uniformMatrix4fv(this.u_model, false, model);
      gl.uniform1f(this.u_swell, swell);
      gl.uniform4f(this.u_colour, ...tint, opacity);
      if (mode === gl.LINES) gl.uniform1f(this.u_lit, 0);
      if (open) gl.disable(gl.CULL_FACE); else gl.enable(gl.CULL_FACE);
      gl.drawArrays(mode, 0, count);
      if (mode === gl.LINES) gl.uniform1f(this.u_lit, this.eye.planar ? 0 : 1);
    }
    annotate(now, w, h) {
      const { scale } = sized(this.over), pen = this.over.getContext("2d");
      pen.setTransform(scale, 0, 0, scale, 0, 0); pen.clearRect(0, 0, w, h);
      pen.font = "12px system-ui, DejaVu Sans, sans-serif";
      pen.lineJoin = "round";
      for (const way of state.ways ? this.ways : []) this.way(pen, way, now, w, h);
      for (const joint of this.eye.planar ? this.motion.dots : []) this.dot(pen, joint, now, w, h);
      for (const target of this.motion.targets) {
        const p = this.seen(target.point, w, h);
        if (p) this.cross(pen, p, target.name);
      }
    }
    way(pen, way, now, w, h) {
      const point = k => this.seen(way.points.slice(3 * k, 3 * k + 3), w, h), count = way.points.length / 3;
      pen.strokeStyle = way.colour;
      for (const [from, to, dash, width] of [[0, now.low, [], 2], [now.low, count - 1, [3, 4], 1.2]]) {
        pen.beginPath(); pen.setLineDash(dash); pen.lineWidth = width; pen.globalAlpha = 0.75;
        for (let k = from; k <= to; k++) { const p = point(k); if (p) pen.lineTo(...p); }
        pen.stroke();
      }
      pen.setLineDash([]);
      pen.globalAlpha = 1;
      const [start, end] = [point(0), point(count - 1)];
      if (!start || !end || Math.hypot(start[0] - end[0], start[1] - end[1]) < 3) return;
      for (const [p, filled] of [[start, false], [end, true]]) {
        pen.beginPath(); pen.arc(...p, 4, 0, 7); pen.lineWidth = 1.6;
        pen.fillStyle = filled ? way.colour : css("stage"); pen.fill(); pen.stroke();
      }
    }
    dot(pen, joint, now, w, h) {
      const m = this.model({ frame: joint.frame, local: G.fromPose([0, 0, 0, 0, 0, 0, 1]) }, now), p = this.seen(m.slice(12, 15), w, h);
      if (!p) return;
      pen.beginPath(); pen.arc(...p, 3.2, 0, 7);
      pen.fillStyle = css("stage"); pen.fill(); pen.lineWidth = 1.6; pen.strokeStyle = joint.colour; pen.stroke();
    }
    cross(pen, [x, y], name) {
      pen.strokeStyle = pen.fillStyle = css("target"); pen.lineWidth = 1.8;
      pen.beginPath();
      for (const [a, b] of [[-5, -5], [-5, 5]]) { pen.moveTo(x + a, y + b); pen.lineTo(x - a, y - b); }
      pen.stroke();
      written(pen, name, x + 8, y - 6, css("target"), css("stage"));
    }
    listen() {
      let from = null;
      const moved = (dx, dy, shift) => {
        const eye = this.eye;
        if (!shift && !eye.planar) {
          eye.turn -= 0.008 * dx; eye.lift = Math.min(1.55, Math.max(-1.2, eye.lift + 0.008 * dy));
          return;
        }
        const m = this.view, right = [m[0], m[4], m[8]], up = [m[1], m[5], m[9]];
        eye.center = eye.center.map((v, k) => v - this.pixel * (dx * right[k] - dy * up[k]));
      };
      this.canvas.addEventListener("pointerdown", e => { from = [e.clientX, e.clientY, e.shiftKey || e.button === 2];
        this.canvas.setPointerCapture(e.pointerId); });
      this.canvas.addEventListener("pointermove", e => {
        if (!from) return;
        moved(e.clientX - from[0], e.clientY - from[1], from[2]);
        from = [e.clientX, e.clientY, from[2]]; show();
      });
      this.canvas.addEventListener("pointerup", () => { from = null; });
      this.canvas.addEventListener("contextmenu", e => e.preventDefault());
      this.canvas.addEventListener("wheel", e => { e.preventDefault(); this.eye.distance *= Math.exp(0.0012 * e.deltaY); show(); },
        { passive: false });
    }
  }

  class Chart {  // clearance over time, with contacts in red
    constructor(motion, clock, canvas) {
      Object.assign(this, { motion, clock, canvas });
      this.values = motion.clearance.map(v => v === null ? Infinity : v);
      const finite = this.values.filter(isFinite);
      this.top = 1.08 * Math.max(motion.margin, ...finite, 0) || 1;
      this.any = finite.length > 0;
      const seek = e => { const r = canvas.getBoundingClientRect(); jump((e.clientX - r.left - this.left) / (r.width - this.left - 12)); };
      canvas.addEventListener("pointerdown", e => { canvas.setPointerCapture(e.pointerId); seek(e); });
      canvas.addEventListener("pointermove", e => { if (e.buttons) seek(e); });
      this.left = 50;
    }
    draw(share) {
      const { w, h, scale, seen } = sized(this.canvas);
      if (!seen) return;
      const pen = this.canvas.getContext("2d"), { motion, clock } = this, [left, right, top, bottom] = [this.left, w - 12, 24, h - 34];
      pen.setTransform(scale, 0, 0, scale, 0, 0); pen.clearRect(0, 0, w, h);
      pen.font = "11px system-ui, DejaVu Sans, sans-serif"; pen.lineWidth = 1;
      const X = t => left + (right - left) * (clock.last ? t / clock.last : 0), Y = v => bottom - (bottom - top) * v / this.top;
      this.axes(pen, X, Y, { left, right, top, bottom, w });
      for (const [begin, end] of motion.contacts) {
        pen.fillStyle = css("bad"); pen.globalAlpha = 0.22;
        pen.fillRect(X(begin) - 1, top, Math.max(2, X(end) - X(begin) + 2), bottom - top); pen.globalAlpha = 1;
      }
      if (motion.margin > 0) {
        pen.strokeStyle = css("faint"); pen.setLineDash([5, 4]); pen.beginPath(); pen.moveTo(left, Y(motion.margin)); pen.lineTo(right, Y(motion.margin));
        pen.stroke(); pen.setLineDash([]);
      }
      pen.strokeStyle = css("ink"); pen.lineWidth = 1.6; pen.beginPath();
      this.values.forEach((v, k) => { if (isFinite(v)) pen.lineTo(X(clock.times[k]), Y(v)); });
      pen.stroke();
      const at = motion.least_at;
      if (at !== null) this.mark(pen, X(at), Y(motion.least), motion.contacts.length ? css("bad") : css("ink"));
      if (motion.margin > 0) this.required(pen, X, Y, { left, right, top, bottom });
      this.cursor(pen, share, X, Y, top, bottom);
    }
    axes(pen, X, Y, { left, right, top, bottom, w }) {
      pen.fillStyle = css("faint"); pen.strokeStyle = css("line"); pen.textAlign = "right"; pen.textBaseline = "middle";
      const step = niceStep(this.top, 4), digits = Math.max(0, -Math.floor(Math.log10(step)));
      for (let v = 0; v <= this.top * 0.999; v += step) {
        pen.beginPath(); pen.moveTo(left, Y(v)); pen.lineTo(right, Y(v)); pen.stroke();
        pen.fillText(v.toFixed(digits), left - 6, Y(v));
      }
      pen.textBaseline = "alphabetic"; pen.textAlign = "center";
      const stride = niceStep(this.clock.last || 1, 6);
      for (let t = 0; t <= this.clock.last * 1.0001; t += stride) pen.fillText(shown(t), X(t), bottom + 14);
      pen.fillText("instant", (left + right) / 2, bottom + 28);
      pen.textAlign = "left"; pen.fillStyle = css("ink");
      pen.fillText(`clearance [${this.motion.unit}]${this.any ? "" : ": no two bodies are watched"}`, 10, 14);
    }
    required(pen, X, Y, { left, right, top, bottom }) {  // the margin's name, where it is farthest from the curve
      const text = `required ${shown(this.motion.margin)}`, wide = pen.measureText(text).width, line = Y(this.motion.margin);
      const curve = this.values.map((v, k) => [X(this.clock.times[k]), Y(v)]).filter(p => isFinite(p[1]));
      let best = [-1, left, line - 4];
      for (let k = 0; k <= 12; k++) for (const base of [line - 4, line + 12]) {
        if (base - 9 < top || base > bottom) continue;
        const x = left + 3 + (right - left - wide - 6) * k / 12;
        const near = curve.filter(p => p[0] > x - 6 && p[0] < x + wide + 6).map(p => Math.max(base - 9 - p[1], p[1] - base, 0));
        const room = Math.min(40, ...near);
        if (room > best[0]) best = [room, x, base];
      }
      pen.textAlign = "left"; written(pen, text, best[1], best[2], css("faint"), css("card"));
    }
    mark(pen, x, y, colour) {
      pen.fillStyle = colour; pen.beginPath();
      for (const [a, b] of [[0, -5], [5, 0], [0, 5], [-5, 0]]) pen.lineTo(x + a, y + b);
      pen.fill();
    }
    cursor(pen, share, X, Y, top, bottom) {
      const now = this.clock.at(share), [a, b] = [this.values[now.low], this.values[now.high]], v = a + now.u * (b - a);
      pen.strokeStyle = css("ink"); pen.lineWidth = 1;
      pen.beginPath(); pen.moveTo(X(now.t), top); pen.lineTo(X(now.t), bottom); pen.stroke();
      if (!isFinite(v)) return;
      pen.fillStyle = v > 0 ? css("ink") : css("bad");
      pen.beginPath(); pen.arc(X(now.t), Y(v), 3.5, 0, 7); pen.fill();
    }
  }

  function card(motion) {
    const box = element("section", { className: "motion" }), head = element("div", { className: "head" });
    head.append(element("h1", { textContent: motion.title }), element("span", { className: `badge ${motion.status}`, textContent: motion.status }),
      ...(motion.margin_text ? [element("span", { className: `badge ${motion.margin_kind}`, textContent: motion.margin_text })] : []),
      element("span", { className: "sub", textContent: motion.verdict }));
    const stage = element("div", { className: "stage" }), side = element("div", { className: "side" }), chart = element("canvas");
    const legend = element("div", { className: "legend" });
    for (const [name, colour] of motion.legend) {
      const spot = element("i");
      spot.style.background = colour.startsWith("#") ? colour : `var(--${colour})`;
      legend.append(element("span", {}, spot, name));
    }
    const facts = element("dl");
    for (const [name, value] of motion.facts) facts.append(element("dt", { textContent: name }), element("dd", { textContent: value }));
    side.append(chart, facts); box.append(head, stage, side); $("motions-here").append(box);
    const clock = new Clock(motion), view = new Stage(motion, clock, stage), graph = new Chart(motion, clock, chart);
    if (motion.moves) legend.append(element("span", { textContent: "○ start  ● end" }));
    legend.append(element("span", { textContent: view.step ? `grid ${shown(view.step)} ${motion.unit}` : "" }));
    stage.append(legend);
    for (const [begin, end] of motion.contacts) {
      const band = element("b", { title: "the bodies touch" });
      band.style.left = `${100 * begin / (clock.last || 1)}%`; band.style.width = `${100 * (end - begin) / (clock.last || 1)}%`;
      $("track").append(band);
    }
    return { motion, clock, view, graph };
  }

  const motions = JSON.parse($("motions").textContent);
  document.body.classList.toggle("several", motions.length > 1);
  if (new Set(motions.map(m => `${m.unit} ${m.planar}`)).size === 1) {  // side by side in one scale
    const radius = Math.max(...motions.map(m => m.radius)), extent = [0, 1].map(k => Math.max(...motions.map(m => m.extent[k])));
    const bound = (k, way) => way * Math.max(...motions.map(m => way * m.center[k] + m.extent[k]));
    const low = [0, 1, 2].map(k => bound(k, -1)), high = [0, 1, 2].map(k => bound(k, 1));
    const together = low.map((v, k) => 0.5 * (high[k] - v)), same = together.every((v, k) => v <= 1.25 * Math.max(...motions.map(m => m.extent[k])));
    for (const motion of motions) {
      Object.assign(motion, { radius, extent });
      if (same) Object.assign(motion, { radius: Math.max(radius, Math.hypot(...together)), extent: together, center: low.map((v, k) => 0.5 * (v + high[k])) });
    }
  }
  const cards = motions.map(card);

  const again = location.hash === "#again";  // at the top of a report: small, and over and over
  document.body.classList.toggle("small", again);
  let pending = false;
  function show() { if (!pending) { pending = true; requestAnimationFrame(draw); } }
  function draw(stamp) {
    pending = false;
    if (state.playing) {
      if (state.last !== null) state.share += (stamp - state.last) / 1000 / DURATION * Number($("speed").value);
      state.last = stamp;
      if (state.share >= 1) { state.share = again ? 0 : 1; play(again); }
      show();
    }
    $("time").value = state.share;
    $("now").textContent = cards.map(({ clock }) => `instant ${(state.share * clock.last).toFixed(2)} of ${shown(clock.last, 6)}`).join(" · ");
    for (const { view, graph } of cards) { view.draw(state.share); graph.draw(state.share); }
  }
  function play(on) {
    if (on && state.share >= 1) state.share = 0;
    state.playing = on; state.last = null;
    $("play").textContent = on ? "❚❚" : "▶";
    show();
  }
  async function copied(text) {
    try { await navigator.clipboard.writeText(text); return true; } catch { }
    const field = element("textarea", { value: text });
    document.body.append(field); field.select();
    const done = document.execCommand("copy");
    field.remove();
    return done;
  }
  function jump(share) {
    state.share = Math.min(1, Math.max(0, share)); play(false);
    try { history.replaceState(null, "", `#t=${state.share.toFixed(4)}`); } catch { }  // browsers bear only so many a second
  }

  $("speed").title = `1 ×: the whole motion in ${DURATION} s`;
  $("play").addEventListener("click", () => state.playing ? jump(state.share) : play(true));
  $("time").addEventListener("input", e => jump(Number(e.target.value)));
  $("ghosts").addEventListener("change", e => { state.ghosts = e.target.checked; show(); });
  $("ways").addEventListener("change", e => { state.ways = e.target.checked; show(); });
  $("link").addEventListener("click", async () => {
    jump(state.share);
    const told = await copied(location.href) ? "copied" : "see the address";
    $("link").textContent = told;
    setTimeout(() => { $("link").textContent = "copy link"; }, 1500);
  });
  $("view").addEventListener("click", () => { for (const { view } of cards) view.reset(); show(); });
  document.addEventListener("keydown", e => {
    if (["SELECT", "BUTTON"].includes(e.target.tagName)) return;
    if (e.key === " ") { e.preventDefault(); $("play").click(); }
    const faster = { ArrowUp: 1, ArrowDown: -1 }[e.key], end = { Home: 0, End: 1 }[e.key];
    if (faster) {
      const speed = $("speed");
      speed.selectedIndex = Math.min(speed.options.length - 1, Math.max(0, speed.selectedIndex + faster));
      e.preventDefault();
    }
    if (end !== undefined) { jump(end); e.preventDefault(); }
    if (e.key === "ArrowRight" && e.target.id !== "time") jump(state.share + 0.01);
    if (e.key === "ArrowLeft" && e.target.id !== "time") jump(state.share - 0.01);
  });
  new ResizeObserver(show).observe(document.body);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", show);
  const asked = /[#&]t=([\d.]+)/.exec(location.hash);  // page.html#t=0.5 stands still half way
  play(false);
  const still = window.parent !== window && !again || matchMedia("(prefers-reduced-motion: reduce)").matches;  // within a report it waits
  if (asked) jump(Number(asked[1])); else if (!still) play(true);
  window.motionPage = { jump, play, state, motions, picture: k => { draw(0); return cards[k].view.canvas.toDataURL(); } };
})();
