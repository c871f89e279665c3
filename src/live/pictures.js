// The pictures: cells with their weights, the bias function, and the errors of many sets.
const WIDTH = 640;
const HEIGHT = 300;
const MARGIN = 12;
const SVG = "http://www.w3.org/2000/svg";

// The elements of a class in a picture, as many as there are items, made where they lack
function elements(svg, tag, kind, count) {
  const found = [...svg.getElementsByClassName(kind)];
  for (const surplus of found.splice(count)) surplus.remove();
  while (found.length < count) {
    const element = document.createElementNS(SVG, tag);
    element.classList.add(kind);
    svg.append(element);
    found.push(element);
  }
  return found;
}

const attributes = (element, values) => {
  for (const [name, value] of Object.entries(values)) element.setAttribute(name, value);
};
const path = (points) => "M" + points.map(([x, y]) => `${x.toFixed(2)},${y.toFixed(2)}`).join("L");
const across = (x) => MARGIN + x * (WIDTH - 2 * MARGIN);

// A share of 0, 1 and 2 of the mean weight has the first, the middle and the last colour.
function color(share, palette) {
  if (share < 0) return palette.negative;
  const place = Math.min(share, 2) * 2;
  const k = Math.min(Math.floor(place), 3);
  const [a, b] = [palette.anchors[k], palette.anchors[k + 1]];
  return `rgb(${a.map((channel, c) => Math.round(channel + (place - k) * (b[c] - channel))).join()})`;
}
function readPalette() {
  const probe = document.body.appendChild(document.createElement("span"));
  const read = (name) => {
    probe.style.color = `var(${name})`;
    return getComputedStyle(probe).color;
  };
  const anchors = [0, 1, 2, 3, 4].map((k) => read(`--w${k}`).match(/[\d.]+/g).map(Number));
  const negative = read("--negative");
  probe.remove();
  return { anchors, negative };
}

// Places on the picture and coordinates of samples
function frame(state) {
  if (state.d === 2) {
    const side = WIDTH - 2 * MARGIN;
    return {
      height: WIDTH,
      place: (x, y) => [across(x), MARGIN + (1 - y) * side],
      coordinates: (px, py) => [(px - MARGIN) / side, 1 - (py - MARGIN) / side],
    };
  }
  const { of } = INTEGRANDS[1][state.integrand];
  const heights = Array.from({ length: 401 }, (_, i) => of(i / 400));
  const [low, high] = [Math.min(0, ...heights), Math.max(...heights)];
  const up = (f) => HEIGHT - MARGIN - ((f - low) / (high - low)) * (HEIGHT - 2 * MARGIN);
  return {
    height: HEIGHT,
    heights,
    up,
    place: (x) => [across(x), up(of(x))],
    coordinates: (px) => [(px - MARGIN) / (WIDTH - 2 * MARGIN)],
  };
}

function drawCells(svg, state, { weights, corners, offsets }, palette, selected) {
  const { d, n, points } = state;
  const view = frame(state);
  svg.setAttribute("viewBox", `0 0 ${WIDTH} ${view.height}`);
  svg.dataset.d = d;
  const cells = elements(svg, "path", "cell", n);
  for (let i = 0; i < n; i++) {
    const outline = d === 1 ? bar(state, corners, view, i) : polygon(corners, offsets, view, i);
    attributes(cells[i], { d: outline + "Z", fill: color(n * weights[i], palette) });
  }
  const [curve] = elements(svg, "path", "curve", 1);
  curve.setAttribute("d", d === 1 ? path(view.heights.map((f, i) => [across(i / 400), view.up(f)])) : "");
  svg.append(curve);
  const dots = elements(svg, "circle", "dot", n);
  for (let i = 0; i < n; i++) {
    const [cx, cy] = view.place(...points.subarray(i * d, (i + 1) * d));
    attributes(dots[i], { cx: cx.toFixed(2), cy: cy.toFixed(2), r: n > 50 ? 5 : 7 });
    dots[i].classList.toggle("selected", i === selected);
    svg.append(dots[i]);
  }
}
// On a line: as wide as the cell or, with equal weights, 1/N
function bar({ n, points, rule, integrand }, corners, { up }, i) {
  const x = points[i];
  const [from, to] = rule === "equal" ? [x - 0.5 / n, x + 0.5 / n] : [corners[2 * i], corners[2 * i + 1]];
  const top = up(INTEGRANDS[1][integrand].of(x));
  return path([[across(from), up(0)], [across(from), top], [across(to), top], [across(to), up(0)]]);
}
function polygon(corners, offsets, { place }, i) {
  const outline = [];
  for (let c = offsets[i]; c < offsets[i + 1]; c++) outline.push(place(corners[2 * c], corners[2 * c + 1]));
  return path(outline);
}

// On a line: G as a curve, and N times each weight as a stem
function drawBiasLine(svg, rules, state, weights) {
  const places = Float64Array.from({ length: 501 }, (_, i) => i / 500);
  const bias = rules.bias(state, places);
  const up = (share) => 140 - Math.max(-0.5, Math.min(share, 2.5)) * 50;
  const axes = elements(svg, "line", "axis", 2);
  [0, 1].forEach((share, k) => attributes(axes[k], { x1: MARGIN, x2: WIDTH - MARGIN, y1: up(share), y2: up(share) }));
  const labels = elements(svg, "text", "label", 2);
  [0, 1].forEach((share, k) => {
    attributes(labels[k], { x: 0, y: up(share) + 4 });
    labels[k].textContent = share;
  });
  const stems = elements(svg, "line", "stem", state.n);
  stems.forEach((stem, i) => {
    const x = across(state.points[i]);
    attributes(stem, { x1: x, x2: x, y1: up(0), y2: up(state.n * weights[i]) });
  });
  const [curve] = elements(svg, "path", "curve", 1);
  curve.setAttribute("d", path([...bias].map((g, i) => [across(places[i]), up(g)])));
}

// In the plane: G in the colours of weights, from violet (0) through neutral (1) to orange (2)
function drawBiasSquare(canvas, rules, state, palette) {
  const { width } = canvas;
  const axis = Array.from({ length: width }, (_, i) => (i + 0.5) / width);
  const places = Float64Array.from(axis.flatMap((v) => axis.flatMap((u) => [u, 1 - v])));
  const bias = rules.bias(state, places, [8, 8]);
  const context = canvas.getContext("2d");
  const image = context.createImageData(width, width);
  bias.forEach((g, i) => {
    const [red, green, blue] = color(g, palette).match(/\d+/g).map(Number);
    image.data.set([red, green, blue, 255], 4 * i);
  });
  context.putImageData(image, 0, 0);
}

// Outlines of two histograms of errors, within three standard deviations of equal weights
function drawHistogram(svg, trials) {
  const bins = 60;
  const most = 3 * (trials.equal.rms || 1);
  const counts = (errors) => {
    const found = new Array(bins).fill(0);
    for (const error of errors) {
      const bin = Math.floor(((error / most + 1) / 2) * bins);
      if (bin >= 0 && bin < bins) found[bin] += 1 / errors.length;
    }
    return found;
  };
  const [axis] = elements(svg, "line", "axis", 1);
  attributes(axis, { x1: WIDTH / 2, x2: WIDTH / 2, y1: 0, y2: 110 });
  const [label] = elements(svg, "text", "label", 1);
  attributes(label, { x: WIDTH / 2, y: 126, "text-anchor": "middle" });
  label.textContent = "error 0";
  for (const name of ["equal", "chosen"]) {
    const heights = counts(trials[name].errors);
    const top = Math.max(...heights, 1e-9);
    const outline = heights.flatMap((share, b) => {
      const y = 108 - (share / top) * 100;
      return [[across(b / bins), y], [across((b + 1) / bins), y]];
    });
    elements(svg, "path", name, 1)[0].setAttribute("d", trials[name].errors.length ? path(outline) : "");
  }
}
