// The arrays of messages as numbers, and solids as triangles: x, y, z and the normal of each corner.
import { plus } from "./matrices.js";

export function bytes(text) {
  return Uint8Array.from(atob(text), (char) => char.charCodeAt(0));
}

export function floats(text) {
  return new Float32Array(bytes(text).buffer);
}

// The middle of a cloud.
export function middleOf(points) {
  const sum = [0, 0, 0];
  points.forEach((value, place) => (sum[place % 3] += value));
  return sum.map((value) => (3 * value) / points.length);
}

// The height of a cloud's highest point.
export function topOf(points) {
  return points.reduce((top, value, place) => (place % 3 === 2 ? Math.max(top, value) : top), -Infinity);
}

export function solidBox([width, depth, height]) {
  const values = [];
  for (const [axis, sign] of [[0, 1], [0, -1], [1, 1], [1, -1], [2, 1], [2, -1]]) {
    const normal = [0, 0, 0];
    normal[axis] = sign;
    const one = [0, 0, 0], other = [0, 0, 0];
    one[(axis + 1) % 3] = 1;
    other[(axis + 2) % 3] = sign;
    const corners = [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]];
    for (const [a, b] of corners) {
      const corner = plus(plus(normal, one, a), other, b);
      values.push((corner[0] * width) / 2, (corner[1] * depth) / 2, (corner[2] * height) / 2, ...normal);
    }
  }
  return values;
}

export function solidCylinder(radius, length) {
  const values = [], count = 28;
  const rim = (step) => [Math.cos((2 * Math.PI * step) / count), Math.sin((2 * Math.PI * step) / count)];
  for (let step = 0; step < count; step++) {
    const [a, b] = [rim(step), rim(step + 1)];
    const at = ([x, y], z) => [radius * x, radius * y, (z * length) / 2];
    for (const [side, z] of [[a, -1], [b, -1], [b, 1], [a, -1], [b, 1], [a, 1]]) values.push(...at(side, z), side[0], side[1], 0);
    for (const z of [1, -1]) {
      const [first, second] = z > 0 ? [a, b] : [b, a];
      values.push(0, 0, (z * length) / 2, 0, 0, z, ...at(first, z), 0, 0, z, ...at(second, z), 0, 0, z);
    }
  }
  return values;
}
