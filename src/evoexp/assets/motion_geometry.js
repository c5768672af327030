"use strict";
// Matrices (column by column), quaternions x, y, z, w, and surfaces as triangles: position, normal, six numbers a corner.
const geometry = (() => {
  const AROUND = 40, ALONG = 10;

  function fromPose(p, k = 0) {
    const x = p[k + 3], y = p[k + 4], z = p[k + 5], w = p[k + 6];
    return [
      1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w), 0,
      2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w), 0,
      2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y), 0,
      p[k], p[k + 1], p[k + 2], 1];
  }
  function times(a, b) {
    const c = new Array(16);
    for (let i = 0; i < 4; i++) for (let j = 0; j < 4; j++) {
      c[4 * i + j] = a[j] * b[4 * i] + a[4 + j] * b[4 * i + 1] + a[8 + j] * b[4 * i + 2] + a[12 + j] * b[4 * i + 3];
    }
    return c;
  }
  function applied(m, p) {
    return [0, 1, 2, 3].map(j => m[j] * p[0] + m[4 + j] * p[1] + m[8 + j] * p[2] + m[12 + j]);
  }
  function between(poses, a, b, u) {  // two poses of one frame, whose quaternions are on the same side
    const out = new Array(7);
    for (let i = 0; i < 7; i++) out[i] = poses[a + i] * (1 - u) + poses[b + i] * u;
    const n = Math.hypot(out[3], out[4], out[5], out[6]);
    for (let i = 3; i < 7; i++) out[i] /= n;
    return out;
  }
  const minus = (a, b) => a.map((v, i) => v - b[i]);
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const unit = a => { const n = Math.hypot(...a) || 1; return a.map(v => v / n); };
  function lookAt(eye, center, up) {
    const z = unit(minus(eye, center)), x = unit(cross(up, z)), y = cross(z, x);
    return [x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, -dot(x, eye), -dot(y, eye), -dot(z, eye), 1];
  }
  function orthographic(h, aspect, near, far) {
    return [1 / (h * aspect), 0, 0, 0, 0, 1 / h, 0, 0, 0, 0, -2 / (far - near), 0, 0, 0, -(far + near) / (far - near), 1];
  }
  function perspective(tan, aspect, near, far) {
    return [1 / (tan * aspect), 0, 0, 0, 0, 1 / tan, 0, 0, 0, 0, -(far + near) / (far - near), -1,
      0, 0, -2 * far * near / (far - near), 0];
  }

  function arc(radius, z, from, to) {  // of a profile: distance from the axis, height, and the normal's two parts
    const points = [];
    for (let k = 0; k <= ALONG; k++) {
      const a = from + (to - from) * k / ALONG, c = Math.abs(Math.cos(a)) < 1e-9 ? 0 : Math.cos(a);
      points.push([radius * c, z + radius * Math.sin(a), c, Math.sin(a)]);
    }
    return points;
  }
  function lathe(...profiles) {
    const out = [];
    const corner = (p, a) => out.push(p[0] * Math.cos(a), p[0] * Math.sin(a), p[1], p[2] * Math.cos(a), p[2] * Math.sin(a), p[3]);
    for (const profile of profiles) for (let k = 0; k + 1 < profile.length; k++) for (let s = 0; s < AROUND; s++) {
      const [p, q] = [profile[k], profile[k + 1]], a = 2 * Math.PI * s / AROUND, b = 2 * Math.PI * (s + 1) / AROUND;
      for (const [r, t] of [[p, a], [p, b], [q, b], [p, a], [q, b], [q, a]]) corner(r, t);
    }
    return out;
  }
  function box(x, y, z, shift = 0) {
    const out = [], half = [x / 2, y / 2, z / 2];
    for (let axis = 0; axis < 3; axis++) for (const side of [-1, 1]) {
      const b = (axis + 1) % 3, c = (axis + 2) % 3;
      const corners = [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]];
      for (const [u, v] of side > 0 ? corners : corners.map(([u, v]) => [v, u])) {
        const p = [0, 0, 0], n = [0, 0, 0];
        p[axis] = side * half[axis]; p[b] = u * half[b]; p[c] = v * half[c]; n[axis] = side;
        out.push(p[0], p[1], p[2] + shift, ...n);
      }
    }
    return out;
  }
  const CREASE = Math.cos(0.6);  // faces that meet at more than some 35 degrees have an edge between them
  function mesh(points, triangles) {  // light as on a smooth surface but for its edges
    const out = [], around = new Map(), flat = triangles.map(t => {
      const [a, b, c] = t.map(k => points[k]);
      return cross(minus(b, a), minus(c, a));  // as long as twice the area
    });
    const unitary = flat.map(n => dot(n, n) > 0 ? unit(n) : n);
    const key = k => points[k].join();
    triangles.forEach((triangle, k) => {
      for (const corner of triangle) around.set(key(corner), [...(around.get(key(corner)) || []), k]);
    });
    triangles.forEach((triangle, k) => {
      for (const corner of triangle) {
        const sum = [0, 0, 0];
        for (const near of around.get(key(corner))) if (dot(unitary[near], unitary[k]) >= CREASE) flat[near].forEach((v, i) => sum[i] += v);
        out.push(...points[corner], ...(dot(sum, sum) > 0 ? unit(sum) : unitary[k]));
      }
    });
    return out;
  }
  // Every shape once, of its true size; a half-space is a slab as large as what there is to see.
  function surface(shape, radius, planar) {
    const [a, b, c] = shape.size, q = Math.PI / 2;
    if (shape.kind === "box") return box(a, b, c);
    if (shape.kind === "sphere") return lathe(arc(a, 0, -q, q));
    if (shape.kind === "capsule") return lathe([...arc(a, -b / 2, -q, 0), ...arc(a, b / 2, 0, q)]);
    if (shape.kind === "cylinder" || shape.kind === "cone") {
      const top = shape.kind === "cone" ? 0 : a, n = unit([b, a - top, 0]);
      return lathe([[0, -b / 2, 0, -1], [a, -b / 2, 0, -1]], [[a, -b / 2, n[0], n[1]], [top, b / 2, n[0], n[1]]],
        [[top, b / 2, 0, 1], [0, b / 2, 0, 1]]);
    }
    if (shape.kind === "ellipsoid") {
      const ball = lathe(arc(1, 0, -q, q));
      for (let k = 0; k < ball.length; k += 6) {
        const n = unit([ball[k + 3] / a, ball[k + 4] / b, ball[k + 5] / c]);
        ball[k] *= a; ball[k + 1] *= b; ball[k + 2] *= c;
        ball[k + 3] = n[0]; ball[k + 4] = n[1]; ball[k + 5] = n[2];
      }
      return ball;
    }
    if (shape.kind === "half_space") {
      const depth = (planar ? 0.15 : 0.01) * radius;
      return box(6 * radius, 6 * radius, depth, -depth / 2);
    }
    return mesh(shape.points, shape.triangles);
  }
  return { fromPose, times, applied, between, lookAt, orthographic, perspective, surface, minus, cross, dot, unit };
})();
