// From a state to weights. A state has d, design ("uniform" or "stratified"), n, rule, integrand and points, the
// coordinates of each sample side by side. Point i of a stratified set is in stratum i, in C order.
const strataPerAxis = ({ d, n }) => (d === 1 ? n : Math.round(Math.sqrt(n)));

const INTEGRANDS = {
  1: {
    "exp(x)": { of: Math.exp, integral: Math.E - 1 },
    "1 + cos(9x)": { of: (x) => 1 + Math.cos(9 * x), integral: 1 + Math.sin(9) / 9 },
    "kink, |x − 1/3|": { of: (x) => Math.abs(x - 1 / 3), integral: 5 / 18 },
    "jump, x + (x > 0.4)": { of: (x) => x + (x > 0.4), integral: 1.1 },
  },
  2: {
    "exp(x + y)": { of: (x, y) => Math.exp(x + y), integral: (Math.E - 1) ** 2 },
    "1 + cos(9x) cos(5y)": {
      of: (x, y) => 1 + Math.cos(9 * x) * Math.cos(5 * y),
      integral: 1 + (Math.sin(9) / 9) * (Math.sin(5) / 5),
    },
    "disc, x² + y² < 1": { of: (x, y) => Number(x * x + y * y < 1), integral: Math.PI / 4 },
  },
};

class Rules {
  #core;
  #tables;
  #known = { key: "", places: new Float64Array(0), bias: new Float64Array(0) };

  constructor(core, tables) {
    this.#core = core;
    this.#tables = tables;
  }

  // The rules that there are for a state, by name, each with its title
  offered(state) {
    const { d, design, n } = state;
    const found = { equal: "equal, 1/N", none: "Voronoi cells", "bias-function": "Voronoi cells ÷ G" };
    if (d === 1) found.exchange = "exchange";
    if (d === 1) found["leave-one-out-0"] = "leave-one-out, order 0";
    if (design === "stratified")
      for (const order of Object.keys(this.#tables.stencils[`${d}-${n}`]))
        found[`leave-one-out-${order}`] = `leave-one-out, order ${order}`;
    return found;
  }

  // Weights, and the corners of the cells
  weigh(state) {
    const core = this.#core;
    core.put("points", state.points);
    core.cut_cells(state.d);
    const cells = { measures: core.get("weights"), corners: core.get("corners"), offsets: core.get("offsets") };
    return { ...cells, weights: this.#ruled(state, cells.measures) };
  }

  // Weights alone
  weights(state) {
    const core = this.#core;
    core.put("points", state.points);
    core.room(ARRAYS.indexOf("weights"), state.n);
    if (!["none", "bias-function", "leave-one-out-0"].includes(state.rule)) return this.#ruled(state);
    core.measure_cells(state.d);
    return this.#ruled(state, core.get("weights"));
  }

  #ruled(state, measures) {
    const core = this.#core;
    const { n, design, rule } = state;
    if (rule === "equal") return new Float64Array(n).fill(1 / n);
    if (rule === "none") return measures;
    if (rule === "bias-function") {
      const bias = this.biasAtSamples(state);
      return measures.map((measure, i) => measure / bias[i]);
    }
    if (rule === "exchange") core[`exchange_${design}`]();
    else if (rule === "leave-one-out-0") this.#controlBoundary(state);
    else {
      const { order, width } = this.#tables.stencils[`${state.d}-${n}`][rule.split("-").pop()];
      core.leave_one_out_strata(state.d, strataPerAxis(state), width, order);
    }
    return core.get("weights");
  }

  #controlBoundary({ n, design, points }) {
    const lattice = this.#tables.lattices[`${design}-${n}`];
    this.bias({ d: 1, n, design }, points);
    for (const name of ["position", "share", "kind", "excess"]) this.#core.put(name, numbers(lattice[name]));
    this.#core.control_boundary(design === "stratified" ? n : 0);
  }

  // G at places
  bias(state, places, [across, along] = this.#tables.resolution) {
    this.#core.put("places", places);
    if (state.design === "uniform") this.#core.bias_uniform(state.d, state.n, across, along);
    else this.#core.bias_stratified(state.d, strataPerAxis(state), across, along);
    return this.#core.get("bias");
  }

  // G at the samples. In the plane each takes a while, so that only those which moved are computed again.
  biasAtSamples(state) {
    const { d, n, design, points } = state;
    const key = `${d} ${n} ${design}`;
    const known = this.#known.key === key ? this.#known : { places: new Float64Array(n * d).fill(NaN), bias: new Float64Array(n) };
    const moved = [];
    for (let i = 0; i < n; i++)
      for (let a = 0; a < d; a++)
        if (points[i * d + a] !== known.places[i * d + a] && moved.at(-1) !== i) moved.push(i);
    const places = Float64Array.from(moved.flatMap((i) => [...points.subarray(i * d, (i + 1) * d)]));
    const bias = known.bias.slice();
    if (moved.length) this.bias(state, places).forEach((g, m) => (bias[moved[m]] = g));
    this.#known = { key, places: points.slice(), bias };
    return bias;
  }
}

// Σ w f
function estimate({ d, integrand, points }, weights) {
  const { of } = INTEGRANDS[d][integrand];
  return weights.reduce((sum, w, i) => sum + w * of(...points.subarray(i * d, (i + 1) * d)), 0);
}

// A new set of samples
function draw({ d, design, n }, random) {
  const points = new Float64Array(n * d).map(() => random());
  if (design === "uniform") return points;
  const k = strataPerAxis({ d, n });
  return points.map((u, c) => (stratum(Math.floor(c / d), c % d, d, k) + Math.min(Math.max(u, 1e-9), 1 - 1e-9)) / k);
}

// The index of a stratum along an axis
const stratum = (i, axis, d, k) => (d === 1 ? i : axis === 0 ? Math.floor(i / k) : i % k);

// Where a coordinate of a sample may be
function range({ d, design, n }, i, axis) {
  if (design === "uniform") return [0, 1 - 1e-9];
  const k = strataPerAxis({ d, n });
  const s = stratum(i, axis, d, k);
  return [(s + 1e-9) / k, (s + 1 - 1e-9) / k];
}

// Numbers in [0, 1) of 32 bits (PCG's permutation of a linear congruential generator, by B. O'Neill)
function generator(seed) {
  let state = BigInt.asUintN(64, BigInt(seed) * 747796405n + 2891336453n);
  return () => {
    state = BigInt.asUintN(64, state * 6364136223846793005n + 1442695040888963407n);
    const word = Number(BigInt.asUintN(32, ((state >> 18n) ^ state) >> 27n));
    const turn = Number(state >> 59n);
    return (((word >>> turn) | (word << (-turn & 31))) >>> 0) / 2 ** 32;
  };
}
