// Draws an arrangement from above in a small picture: the robot is below, left is left.
const MARGIN = 3; // px
const WOOD = "#d4c2a8", EDGE = "rgba(40, 30, 20, .55)";
const EVERY = 7; // of the points of a cloud; their hull is nearly the same

// `outlines`: for each object its colour, whether it takes part, and its hull as [x, y] in the world.
export function drawFromAbove(canvas, table, outlines) {
  const [x0, x1, y0, y1] = table;
  const scale = Math.min((canvas.width - 2 * MARGIN) / (y1 - y0), (canvas.height - 2 * MARGIN) / (x1 - x0));
  const place = ([x, y]) => [
    canvas.width / 2 + ((y0 + y1) / 2 - y) * scale,
    canvas.height / 2 + ((x0 + x1) / 2 - x) * scale,
  ];
  const pen = canvas.getContext("2d");
  pen.clearRect(0, 0, canvas.width, canvas.height);
  pen.fillStyle = WOOD;
  const [left, top] = place([x1, y1]);
  pen.fillRect(left, top, (y1 - y0) * scale, (x1 - x0) * scale);
  pen.lineWidth = 1;
  pen.strokeStyle = EDGE;
  for (const { color, takesPart, hull } of outlines) {
    pen.beginPath();
    for (const corner of hull) pen.lineTo(...place(corner));
    pen.closePath();
    pen.globalAlpha = takesPart ? 1 : 0.35;
    pen.fillStyle = `rgb(${color.join(" ")})`;
    pen.fill();
    pen.stroke();
  }
  pen.globalAlpha = 1;
}

// The convex hull of a cloud (x, y, z, ...) from above, after a motion (12 numbers, row by row; none to stay).
export function hullFromAbove(points, motion) {
  const seen = [];
  for (let place = 0; place < points.length; place += 3 * EVERY) {
    const [x, y, z] = [points[place], points[place + 1], points[place + 2]];
    if (motion) seen.push([0, 4].map((row) => motion[row] * x + motion[row + 1] * y + motion[row + 2] * z + motion[row + 3]));
    else seen.push([x, y]);
  }
  seen.sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  return [...chain(seen), ...chain(seen.reverse())];
}

// One half of the hull of sorted points, without its last one.
function chain(points) {
  const kept = [];
  for (const point of points) {
    while (kept.length > 1 && turns(kept.at(-2), kept.at(-1), point) <= 0) kept.pop();
    kept.push(point);
  }
  return kept.slice(0, -1);
}

function turns(a, b, c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}
