// The figure: its state, its controls, and drawing once a frame.
const rules = new Rules(await loadCore(CORE), TABLES);
const form = document.querySelector("form");
const hand = document.querySelector("fieldset").elements;
const picture = document.getElementById("picture");
const ENOUGH = 20000; // sets of an experiment
const byId = (id) => document.getElementById(id);
const sizes = { 1: TABLES.sizes, 2: TABLES.squares };
let random = generator(1);
let selected = 0;
let dragged = null;
let waiting = false;
let trials = null;
let palette = readPalette();
let shownBias = "";

const state = { d: 1, design: "uniform", n: 20, rule: "none", integrand: "exp(x)", points: null };

function options(select, names, chosen) {
  select.replaceChildren(...Object.entries(names).map(([value, text]) => new Option(text, value, false, value === String(chosen))));
}

// Brings a change into the state, and what depends on it into order
function change(changes) {
  const before = { ...state };
  Object.assign(state, changes);
  if (state.d !== before.d)
    Object.assign(state, { n: sizes[state.d][state.d === 1 ? 2 : 4], integrand: Object.keys(INTEGRANDS[state.d])[0] }, changes);
  if (!(state.rule in rules.offered(state))) state.rule = "none";
  const other = ["d", "design", "n"].some((name) => state[name] !== before[name]);
  if (!changes.points && (other || !state.points)) state.points = draw(state, random);
  selected = Math.min(selected, state.n - 1);
  if (!changes.points || changes.rule) restart();
  fillControls();
  ask();
}

function fillControls() {
  document.body.dataset.d = state.d;
  document.body.dataset.rule = state.rule;
  form.elements.d.value = state.d;
  options(form.elements.n, Object.fromEntries(sizes[state.d].map((n) => [n, n])), state.n);
  form.elements.design.value = state.design;
  options(form.elements.rule, rules.offered(state), state.rule);
  options(form.elements.integrand, Object.fromEntries(Object.keys(INTEGRANDS[state.d]).map((name) => [name, name])), state.integrand);
  hand.sample.max = state.n - 1;
}

function move(i, coordinates) {
  coordinates.forEach((value, axis) => {
    const [low, high] = range(state, i, axis);
    state.points[i * state.d + axis] = Math.min(Math.max(value, low), high);
  });
  ask();
}

// At most one drawing a frame
function ask() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    show();
  });
}

const digits = (value) => (Math.abs(value) < 1e-4 && value !== 0 ? value.toExponential(2) : value.toFixed(6));

function show() {
  const found = rules.weigh(state);
  drawCells(picture, state, found, palette, selected);
  showBias(found.weights);
  byId("picture-name").textContent =
    state.d === 1 ? "The integrand, and each sample as a rectangle: its cell and the value there." : "The cells of the samples in the unit square.";
  showNumbers(found.weights);
  showHand(found.weights);
  document.body.setAttribute("aria-busy", "false");
}

function showBias(weights) {
  const { d, n, design } = state;
  byId("bias-name").textContent =
    d === 1 ? `N times each weight, and the bias function G of ${n} ${design} samples` : `The bias function G of ${n} ${design} samples`;
  if (d === 1) return drawBiasLine(byId("bias-line"), rules, state, weights);
  const key = [n, design, palette.negative].join();
  if (key !== shownBias) drawBiasSquare(byId("bias-square"), rules, state, palette);
  shownBias = key;
}

function showNumbers(weights) {
  byId("chosen").cells[0].textContent = rules.offered(state)[state.rule];
  const { integral } = INTEGRANDS[state.d][state.integrand];
  const equal = new Float64Array(state.n).fill(1 / state.n);
  for (const [row, of] of [[byId("chosen"), weights], [byId("equal"), equal]]) {
    const value = estimate(state, of);
    row.cells[1].textContent = digits(value);
    row.cells[2].textContent = digits(value - integral);
  }
}

function showHand(weights) {
  const { d, n, points } = state;
  hand.sample.value = selected;
  ["x", "y"].slice(0, d).forEach((name, axis) => {
    const [low, high] = range(state, selected, axis);
    Object.assign(hand[name], { min: low, max: high, value: points[selected * d + axis] });
    hand[name].setAttribute("aria-valuetext", points[selected * d + axis].toFixed(3));
  });
  const at = [...points.subarray(selected * d, (selected + 1) * d)].map((c) => c.toFixed(4)).join(", ");
  hand["of-sample"].textContent = `at ${at}: weight ${digits(weights[selected])}, ${(n * weights[selected]).toFixed(3)}/N`;
}

// Says the result to those who do not see it, once a change is over
function speak() {
  const cells = byId("chosen").cells;
  byId("spoken").textContent = `${cells[0].textContent}: estimate ${cells[1].textContent}, error ${cells[2].textContent}`;
}

// ---------------------------------------------------------------------- many sets

class Errors {
  errors = [];
  #sum = 0;
  #squares = 0;
  add(error) {
    this.errors.push(error);
    this.#sum += error;
    this.#squares += error * error;
  }
  get mean() { return this.#sum / this.errors.length; }
  get rms() { return Math.sqrt(this.#squares / this.errors.length); }
  get meanError() { return Math.sqrt(Math.max(this.rms ** 2 - this.mean ** 2, 0) / this.errors.length); }
}

function restart() {
  trials = { chosen: new Errors(), equal: new Errors() };
  showTrials();
}

function trySets() {
  if (byId("many").getAttribute("aria-pressed") !== "true") return;
  if (trials.equal.errors.length >= ENOUGH) return byId("many").click();
  const { integral } = INTEGRANDS[state.d][state.integrand];
  const equal = new Float64Array(state.n).fill(1 / state.n);
  for (const end = performance.now() + 8; performance.now() < end; ) {
    const set = { ...state, points: draw(state, random) };
    trials.chosen.add(estimate(set, rules.weights(set)) - integral);
    trials.equal.add(estimate(set, equal) - integral);
  }
  showTrials();
  requestAnimationFrame(trySets);
}

function showTrials() {
  const count = trials.equal.errors.length;
  byId("count").textContent = count ? `${count.toLocaleString("en")} sets of ${state.n}` : "";
  for (const name of ["chosen", "equal"]) {
    const { cells } = byId(name);
    const { mean, meanError, rms } = trials[name];
    cells[3].textContent = count ? `${mean.toExponential(2)} ± ${meanError.toExponential(1)}` : "";
    cells[4].textContent = count ? rms.toExponential(2) : "";
  }
  drawHistogram(byId("histogram"), trials);
}

// ---------------------------------------------------------------------- hands

// Where on the picture a pointer is
function pointed(event) {
  const box = picture.getBoundingClientRect();
  const scale = WIDTH / box.width;
  return [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
}
function nearest([px, py]) {
  const { d, n, points } = state;
  const view = frame(state);
  let best = [Infinity, 0];
  for (let i = 0; i < n; i++) {
    const [x, y] = view.place(...points.subarray(i * d, (i + 1) * d));
    const distance = d === 1 ? Math.abs(x - px) : Math.hypot(x - px, y - py);
    if (distance < best[0]) best = [distance, i];
  }
  return best[1];
}

picture.addEventListener("pointerdown", (event) => {
  picture.setPointerCapture(event.pointerId);
  selected = dragged = nearest(pointed(event));
  ask();
});
picture.addEventListener("pointermove", (event) => {
  if (dragged !== null) move(dragged, frame(state).coordinates(...pointed(event)));
});
for (const end of ["pointerup", "pointercancel"])
  picture.addEventListener(end, () => {
    dragged = null;
    speak();
  });

form.addEventListener("change", ({ target }) => change({ [target.name]: ["d", "n"].includes(target.name) ? Number(target.value) : target.value }));
byId("fresh").addEventListener("click", () => change({ points: draw(state, random) }));
hand.sample.addEventListener("input", () => {
  if (!hand.sample.validity.valid || hand.sample.value === "") return;
  selected = Number(hand.sample.value);
  ask();
});
["x", "y"].forEach((name) =>
  hand[name].addEventListener("input", () => move(selected, ["x", "y"].slice(0, state.d).map((axis) => Number(hand[axis].value)))),
);
["x", "y"].forEach((name) => hand[name].addEventListener("change", speak));
byId("many").addEventListener("click", ({ currentTarget }) => {
  const running = currentTarget.getAttribute("aria-pressed") !== "true";
  currentTarget.setAttribute("aria-pressed", running);
  currentTarget.textContent = running ? "Pause" : "Draw many sets";
  if (running && trials.equal.errors.length >= ENOUGH) restart();
  trySets();
});
function repaint() {
  palette = readPalette();
  ask();
}
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", repaint);

// In a page of the same origin, the frame is as high as what it shows, and as light or dark as the page
if (frameElement) {
  new ResizeObserver(() => (frameElement.style.height = `${document.body.scrollHeight}px`)).observe(document.body);
  const { body, documentElement } = parent.document;
  const follow = () => {
    document.documentElement.dataset.theme = body.dataset.theme ?? documentElement.dataset.theme ?? "auto";
    repaint();
  };
  for (const element of [body, documentElement]) new MutationObserver(follow).observe(element, { attributeFilter: ["data-theme"] });
  follow();
}

// For tests: puts a state in place, and says what is shown
window.live = {
  set: (changes) => change({ ...changes, ...(changes.points && { points: Float64Array.from(changes.points) }) }),
  get: () => {
    const { corners, offsets, weights } = rules.weigh(state);
    const plain = Object.fromEntries(Object.entries({ corners, offsets, weights, bias: rules.biasAtSamples(state) }).map(([k, v]) => [k, [...v]]));
    return { ...state, ...plain, points: [...state.points], estimate: estimate(state, weights), offered: Object.keys(rules.offered(state)) };
  },
  fresh: (seed) => ((random = generator(seed)), change({ points: draw(state, random) })),
};
change({});
