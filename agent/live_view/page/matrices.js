// Matrices (4, 4) as arrays of 16, column by column, as WebGL takes them. Poses are x, y, z and a quaternion x, y, z, w.

export const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
export const AT_REST = [0, 0, 0, 0, 0, 0, 1];

export function multiply(a, b) {
  const out = new Array(16);
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) sum += a[4 * k + row] * b[4 * column + k];
      out[4 * column + row] = sum;
    }
  }
  return out;
}

export function transformed(matrix, [x, y, z], w = 1) {
  return [0, 1, 2, 3].map((row) => matrix[row] * x + matrix[4 + row] * y + matrix[8 + row] * z + matrix[12 + row] * w);
}

export function perspective(angle, aspect, near, far) {
  const scale = 1 / Math.tan(angle / 2);
  const depth = near - far;
  return [scale / aspect, 0, 0, 0, 0, scale, 0, 0, 0, 0, (near + far) / depth, -1, 0, 0, (2 * near * far) / depth, 0];
}

export function lookAt(eye, target, up) {
  const back = normalized(minus(eye, target));
  const right = normalized(cross(up, back));
  const above = cross(back, right);
  const move = [right, above, back].map((axis) => -dot(axis, eye));
  return [
    right[0], above[0], back[0], 0, right[1], above[1], back[1], 0, right[2], above[2], back[2], 0, ...move, 1,
  ];
}

export function fromPose([x, y, z, i, j, k, w]) {
  return [
    1 - 2 * (j * j + k * k), 2 * (i * j + k * w), 2 * (i * k - j * w), 0,
    2 * (i * j - k * w), 1 - 2 * (i * i + k * k), 2 * (j * k + i * w), 0,
    2 * (i * k + j * w), 2 * (j * k - i * w), 1 - 2 * (i * i + j * j), 0,
    x, y, z, 1,
  ];
}

// The upper three rows of a matrix, row by row, from `offset` on.
export function fromRows(rows, offset) {
  const out = [...IDENTITY];
  for (let row = 0; row < 3; row++) for (let column = 0; column < 4; column++) out[4 * column + row] = rows[offset + 4 * row + column];
  return out;
}

// The pose at `part` (0 to 1) of the way from one to another.
export function between(from, to, part) {
  const sign = dot4(from, to) < 0 ? -1 : 1;
  const mixed = to.map((value, index) => from[index] + (value * (index < 3 ? 1 : sign) - from[index]) * part);
  const length = Math.hypot(...mixed.slice(3)) || 1;
  return mixed.map((value, index) => (index < 3 ? value : value / length));
}

// What flattens everything onto z = `height`, away from a light in the direction `light`.
export function shadowOn(height, [x, y, z]) {
  return [1, 0, 0, 0, 0, 1, 0, 0, -x / z, -y / z, 0, 0, (height * x) / z, (height * y) / z, height, 1];
}

export function minus(a, b) {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

export function plus(a, b, times = 1) {
  return [a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2]];
}

export function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

export function normalized(a) {
  const length = Math.hypot(...a) || 1;
  return a.map((value) => value / length);
}

function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

function dot4(a, b) {
  return a[3] * b[3] + a[4] * b[4] + a[5] * b[5] + a[6] * b[6];
}
