// Renderings beside their reference, from linear pixels: two under a divider, their errors, close-ups of all.

function rgba(hex) {
  return (0xff000000 | (parseInt(hex.slice(5, 7), 16) << 16) | (parseInt(hex.slice(3, 5), 16) << 8) | parseInt(hex.slice(1, 3), 16)) >>> 0;
}

// As voroquad._support.numbers.scientific: 1.23·10⁻⁵.
function scientific(value) {
  if (!Number.isFinite(value)) return "nan"; // JSON has null in its place
  const [mantissa, exponent] = value.toExponential(2).split("e");
  return `${mantissa}·10${String(Number(exponent)).replace(/./g, (c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)])}`;
}

// Four digits, with a power of ten where zeros would hide them.
function fixed(value) {
  if (!Number.isFinite(value)) return String(value).replace("-", "−");
  const plain = value === 0 || (Math.abs(value) >= 1e-3 && Math.abs(value) < 1e5);
  return (plain ? value.toPrecision(4) : scientific(value)).replace(/^-/, "−");
}

const textOf = (id) => document.getElementById(id).textContent;

class Comparison {
  constructor(root) {
    this.root = root;
    this.data = JSON.parse(root.querySelector(".comparison-data").textContent);
    this.area = this.data.width * this.data.height;
    this.palette = Uint32Array.from(this.data.palette, rgba);
    this.known = new Map(this.data.renderings.map((r) => [r.key, r]));
    this.known.set(this.data.reference, { key: this.data.reference, name: "Reference" });
    this.methods = [...new Set(this.data.renderings.map((r) => r.method))];
    this.spps = [...new Set(this.data.renderings.map((r) => r.spp))].sort((a, b) => a - b);
    this.exposure = 0;
    this.scale = this.data.scale;
    this.split = 0.5;
    this.tones = new Map();
    this.pointed = null; // column and row of the pixel that is read
    this.wanted = {};
  }

  find(selector) {
    return this.root.querySelector(selector);
  }

  async show() {
    this.reference = await unpack(textOf(this.data.reference));
    const shown = await embed(this.data.plots);
    const model = (name) => shown.get_model_by_name(name);
    [this.pixels, this.errors, this.mapper, this.window, this.bar] = ["pixels", "errors", "mapper", "window", "bar"].map(model);
    this.stages = [model("image"), model("error")];
    this.x = this.stages[0].x_range;
    this.y = this.stages[0].y_range;
    this.listen();
    this.addCards();
    this.setExposure(0);
    this.setScale(0);
    this.paint();
    const spp = this.spps[this.spps.length >> 1];
    await this.chooseSpp(spp, this.methods.filter((method) => this.rendering(method, spp)));
    this.root.dataset.ready = "";
  }

  // ------------------------------------------------------------------ pixels

  // The errors of a rendering, decoded once.
  async load(key) {
    const image = this.known.get(key);
    if (key !== this.data.reference && !image.error) image.error = await unpack(textOf(key));
    return image;
  }

  value(image, channel, k) {
    const at = channel * this.area + k;
    return this.reference[at] + (image.error ? image.error[at] : 0);
  }

  error(image, k) {
    const { error } = image;
    return error ? (error[k] + error[k + this.area] + error[k + 2 * this.area]) / 3 : 0;
  }

  // The rgba pixel that a screen shows of one.
  tone(image, k) {
    return shownPixel(this.value(image, 0, k), this.value(image, 1, k), this.value(image, 2, k), this.exposure);
  }

  tint(image, k) {
    const last = this.palette.length - 1;
    return this.palette[Math.round(clamp(this.error(image, k) / this.scale / 2 + 0.5, 0, 1) * last)];
  }

  // All pixels of an image in a form of their own, bottom row first as Bokeh has them; kept until `state` changes.
  map(image, what, state, make) {
    const name = `${what} ${image.key}`;
    const kept = this.tones.get(name);
    if (kept?.state === state) return kept.pixels;
    const { width, height } = this.data;
    const pixels = new (what === "tone" ? Uint32Array : Float32Array)(this.area);
    for (let row = 0; row < height; row++) {
      const to = (height - 1 - row) * width;
      for (let column = 0; column < width; column++) pixels[to + column] = make(image, row * width + column);
    }
    this.tones.set(name, { state, pixels });
    return pixels;
  }

  // Left image left of the divider, right image right of it.
  joined(left, right) {
    const { width } = this.data;
    const column = clamp(Math.round(this.x.start + this.split * (this.x.end - this.x.start)), 0, width);
    const pixels = right.slice();
    for (let k = 0; k < this.area; k += width) pixels.set(left.subarray(k, k + column), k);
    return pixels;
  }

  draw() {
    const { left, right } = this;
    if (!left || !right) return; // nothing is chosen yet
    const tone = (image) => this.map(image, "tone", this.exposure, (i, k) => this.tone(i, k));
    const error = (image) => this.map(image, "error", 0, (i, k) => this.error(i, k));
    this.put(this.pixels, this.joined(tone(left), tone(right)));
    this.put(this.errors, this.joined(error(left), error(right)));
  }

  put(source, pixels) {
    const Kind = source.get_array("image")[0].constructor;
    source.data = { image: [new Kind(pixels.buffer, [this.data.height, this.data.width])] };
  }

  // ------------------------------------------------------------------ state

  async choose(side, key) {
    this.wanted[side] = key;
    const image = await this.load(key);
    if (this.wanted[side] !== key) return; // something else was chosen meanwhile
    this[side] = image;
    this.find(`select.${side}`).value = key;
    for (const tag of this.root.querySelectorAll(`.tag.${side}`)) tag.textContent = this[side].name;
    this.find(`.readout .${side} th`).textContent = this[side].name;
    for (const card of this.root.querySelectorAll(".card")) {
      card.classList.toggle(side, card.dataset.key === key);
    }
    if (this.left && this.right) this.find(".verdict").textContent = this.verdict;
    this.tellPixel();
    this.draw();
  }

  // How the two compare, in words.
  get verdict() {
    const told = ({ name, mse }) => (mse === undefined ? "the reference" : `${name} (MSE ${scientific(mse)})`);
    const [left, right] = [this.left, this.right];
    if (!Number.isFinite(left.mse) || !Number.isFinite(right.mse) || left.mse === right.mse) return `${told(left)} and ${told(right)}`;
    const [better, worse] = left.mse < right.mse ? [left, right] : [right, left];
    return `${told(better)} has ${(worse.mse / better.mse).toPrecision(3)} times less squared error than ${told(worse)}`;
  }

  rendering(method, spp) {
    return this.data.renderings.find((r) => r.method === method && r.spp === spp);
  }

  // Cards, left and right move to another spp; the reference stays.
  async chooseSpp(spp, methods) {
    this.spp = spp;
    this.find(".spp-value").textContent = spp;
    this.find(`.spp input[value="${spp}"]`).checked = true;
    const [left, right] = methods ?? [this.left.method, this.right.method];
    await this.drawCards();
    for (const [side, method] of [["left", left], ["right", right ?? left]]) {
      const rendering = this.rendering(method, spp);
      if (rendering) await this.choose(side, rendering.key);
    }
  }

  setSplit(split) {
    this.split = clamp(split, 0, 1);
    this.find(".divider").value = this.split;
    this.find(".stages").style.setProperty("--split", this.split);
    this.draw();
  }

  setExposure(exposure) {
    this.exposure = clamp(exposure, -8, 8);
    this.find(".exposure").value = this.exposure;
    this.find(".exposure-value").textContent = stops(this.exposure);
    this.draw();
    this.drawCards();
  }

  // The errors that have the last colours: the scale of all methods and spp.
  setScale(decades) {
    const slider = this.find(".scale");
    slider.value = decades;
    this.scale = this.data.scale * 10 ** Number(slider.value);
    this.mapper.setv({ low: -this.scale, high: this.scale });
    for (const value of this.root.querySelectorAll(".scale-value")) value.textContent = `±${this.scale.toPrecision(2)}`;
    this.drawCards();
  }

  // ------------------------------------------------------------------ view

  get whole() {
    return this.x.end - this.x.start >= this.data.width * 0.999;
  }

  // The view in whole pixels: left, top, width, height.
  get viewWindow() {
    const { width, height } = this.data;
    const [left, top] = [Math.max(Math.floor(this.x.start), 0), Math.max(Math.floor(height - this.y.end), 0)];
    const [right, bottom] = [Math.min(Math.ceil(this.x.end), width), Math.min(Math.ceil(height - this.y.start), height)];
    return [left, top, right - left, bottom - top];
  }

  view(left, top, width) {
    const height = (width * this.data.height) / this.data.width;
    const x = clamp(left, 0, this.data.width - width);
    const y = clamp(this.data.height - top - height, 0, this.data.height - height);
    this.x.setv({ start: x, end: x + width });
    this.y.setv({ start: y, end: y + height });
  }

  zoom(factor) {
    const old = this.x.end - this.x.start;
    const width = clamp(old / factor, Math.min(8, this.data.width), this.data.width);
    const [x, y] = [(this.x.start + this.x.end) / 2, this.data.height - (this.y.start + this.y.end) / 2];
    this.view(x - width / 2, y - (width * this.data.height) / this.data.width / 2, width);
  }

  move(right, down) {
    const [width, height] = [this.x.end - this.x.start, this.y.end - this.y.start];
    this.view(this.x.start + right * width, this.data.height - this.y.end + down * height, width);
  }

  // A close-up, widened to the image's shape.
  closeup([left, top, width, height]) {
    const wide = Math.max(width, (height * this.data.width) / this.data.height);
    const high = (wide * this.data.height) / this.data.width;
    this.view(left + (width - wide) / 2, top + (height - high) / 2, wide);
  }

  // ------------------------------------------------------------------ cards

  // The window of the cards: the view, or the first close-up of the whole image.
  get shownWindow() {
    return this.whole && this.data.closeups.length ? this.data.closeups[0] : this.viewWindow;
  }

  addCards() {
    const sheet = this.find(".sheet");
    for (const method of [null, ...this.methods]) {
      const card = document.createElement("button");
      card.type = "button";
      card.className = "card";
      card.append(...["image", "error"].map((name) => Object.assign(document.createElement("canvas"), { className: name })));
      card.append(Object.assign(document.createElement("span"), { className: "name", textContent: method ?? "Reference" }));
      card.append(Object.assign(document.createElement("span"), { className: "numbers" }));
      card.dataset.method = method ?? "";
      card.addEventListener("click", () => this.choose("right", card.dataset.key));
      sheet.append(card);
    }
  }

  async drawCards() {
    if (!this.spp) return;
    const box = this.shownWindow;
    const [left, top, width, height] = box;
    this.window.setv({ visible: this.whole, left, right: left + width, top: this.data.height - top, bottom: this.data.height - top - height });
    for (const card of this.root.querySelectorAll(".card")) {
      const { method } = card.dataset;
      const known = method ? this.rendering(method, this.spp) : this.known.get(this.data.reference);
      card.hidden = !known;
      if (!known) continue;
      card.dataset.key = known.key;
      const image = await this.load(known.key);
      this.crop(card.querySelector(".image"), box, (k) => this.tone(image, k));
      const below = card.querySelector(".error");
      if (method) this.crop(below, box, (k) => this.tint(image, k));
      else this.overview(below, box);
      card.querySelector(".numbers").textContent = method ? `MSE ${scientific(known.mse)}` : "";
      card.title = `Show ${known.name} on the right`;
    }
  }

  crop(canvas, [left, top, width, height], color) {
    Object.assign(canvas, { width, height });
    const pixels = new Uint32Array(width * height);
    for (let row = 0; row < height; row++) {
      for (let column = 0; column < width; column++) {
        pixels[row * width + column] = color((top + row) * this.data.width + left + column);
      }
    }
    canvas.getContext("2d").putImageData(new ImageData(new Uint8ClampedArray(pixels.buffer), width, height), 0, 0);
  }

  // The whole reference, and where the cards' window is.
  overview(canvas, [left, top, width, height]) {
    const { width: whole, height: high } = this.data;
    this.crop(canvas, [0, 0, whole, high], (k) => this.tone(this.known.get(this.data.reference), k));
    const context = canvas.getContext("2d");
    context.lineWidth = Math.max(1, whole / 100);
    context.strokeStyle = "white";
    context.strokeRect(left, top, width, height);
  }

  // ------------------------------------------------------------------ what people do

  listen() {
    const on = (selector, event, action) => this.find(selector)?.addEventListener(event, action);
    on(".divider", "input", (e) => this.setSplit(Number(e.target.value)));
    on(".exposure", "input", (e) => this.setExposure(Number(e.target.value)));
    on(".scale", "input", (e) => this.setScale(Number(e.target.value)));
    for (const side of ["left", "right"]) on(`select.${side}`, "change", (e) => this.choose(side, e.target.value));
    on(".swap", "click", () => this.swap());
    on(".flip", "click", () => this.flip());
    on(".whole", "click", () => this.view(0, 0, this.data.width));
    on(".zoom-in", "click", () => this.zoom(1.5));
    on(".zoom-out", "click", () => this.zoom(1 / 1.5));
    on(".enlarge", "click", ({ currentTarget: button }) => {
      button.setAttribute("aria-pressed", this.root.classList.toggle("large"));
    });
    for (const button of this.root.querySelectorAll(".closeup")) {
      button.addEventListener("click", () => this.closeup(this.data.closeups[Number(button.dataset.closeup)]));
    }
    for (const cell of this.root.querySelectorAll("td[data-key]")) {
      cell.addEventListener("click", () => this.choose("right", cell.dataset.key));
    }
    for (const kind of ["csv", "json"]) on(`.take-${kind}`, "click", () => this.take(kind));
    on(".spp", "change", (e) => this.chooseSpp(Number(e.target.value)));
    this.root.addEventListener("keydown", (e) => this.key(e));
    document.addEventListener("themechange", () => this.paint());

    let pending = false; // one redraw for the changes of both ranges
    const moved = () => {
      if (pending) return;
      pending = true;
      requestAnimationFrame(() => {
        pending = false;
        this.activate("pan", !this.whole);
        this.draw();
        this.drawCards();
      });
    };
    for (const range of [this.x, this.y]) range.change.connect(moved);
    for (const stage of this.stages) {
      for (const event of ["mousemove", "tap"]) stage.on_event(event, ({ x, y }) => this.read(x, y));
    }
    // The wheel scrolls the page until the images are clicked, and a finger until they are zoomed
    this.activate("wheel", false);
    on(".stages", "pointerdown", () => this.activate("wheel", true));
    on(".stages", "pointerleave", () => this.activate("wheel", false));
  }

  activate(name, active) {
    for (const stage of this.stages) stage.toolbar.tools.find((tool) => tool.name === name).setv({ active });
  }

  async swap() {
    const [left, right] = [this.right.key, this.left.key];
    await this.choose("left", left);
    await this.choose("right", right);
  }

  flip() {
    this.setSplit(this.split < 0.5 ? 1 : 0);
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches("select, input:not(.divider)")) return;
    const spp = (step) => this.chooseSpp(this.spps[clamp(this.spps.indexOf(this.spp) + step, 0, this.spps.length - 1)]);
    const actions = {
      f: () => this.flip(),
      x: () => this.swap(),
      e: () => this.setExposure(this.exposure + 0.5),
      E: () => this.setExposure(this.exposure - 0.5),
      s: () => this.setScale(Number(this.find(".scale").value) + 0.1),
      S: () => this.setScale(Number(this.find(".scale").value) - 0.1),
      ",": () => spp(-1),
      ".": () => spp(1),
      p: () => this.readCentre(),
      0: () => this.view(0, 0, this.data.width),
      "+": () => this.zoom(1.5),
      "-": () => this.zoom(1 / 1.5),
      ArrowLeft: () => (event.shiftKey ? this.move(-0.25, 0) : this.setSplit(this.split - 0.02)),
      ArrowRight: () => (event.shiftKey ? this.move(0.25, 0) : this.setSplit(this.split + 0.02)),
      ArrowUp: event.shiftKey && (() => this.move(0, -0.25)),
      ArrowDown: event.shiftKey && (() => this.move(0, 0.25)),
    };
    const numbered = this.rendering(this.methods[Number(event.key) - 1], this.spp);
    const action = actions[event.key] || (numbered && (() => this.choose("right", numbered.key)));
    if (!action) return;
    event.preventDefault();
    action();
  }

  // Read the pixel at (x, y), y upwards.
  read(x, y) {
    const [column, row] = [Math.floor(x), this.data.height - 1 - Math.floor(y)];
    if (!(column >= 0 && column < this.data.width && row >= 0 && row < this.data.height)) return;
    this.pointed = [column, row];
    this.tellPixel();
  }

  readCentre() {
    this.read((this.x.start + this.x.end) / 2, (this.y.start + this.y.end) / 2);
  }

  tellPixel() {
    if (!this.pointed || !this.left || !this.right) return;
    const [column, row] = this.pointed;
    const k = row * this.data.width + column;
    this.find(".readout caption").textContent = `Pixel (${column}, ${row})`;
    const images = { left: this.left, right: this.right, reference: this.known.get(this.data.reference) };
    for (const [side, image] of Object.entries(images)) {
      const cells = this.find(`.readout .${side}`).querySelectorAll("td");
      const numbers = [0, 1, 2].map((channel) => this.value(image, channel, k)).concat(this.error(image, k));
      numbers.forEach((number, i) => (cells[i].textContent = fixed(number)));
    }
  }

  // The pixels in view as a table, one pixel per row, y downwards.
  table() {
    const images = { left: this.left, right: this.right, reference: this.known.get(this.data.reference) };
    const [left, top, width, height] = this.viewWindow;
    const rows = [];
    for (let y = top; y < top + height; y++) {
      for (let x = left; x < left + width; x++) {
        const row = { x, y };
        for (const [side, image] of Object.entries(images)) {
          ["red", "green", "blue"].forEach((color, channel) => {
            row[`${side}_${color}`] = Number(this.value(image, channel, y * this.data.width + x).toPrecision(5));
          });
        }
        rows.push(row);
      }
    }
    return rows;
  }

  take(kind) {
    const rows = this.table();
    const lines = () => [Object.keys(rows[0]), ...rows.map(Object.values)].map((row) => row.join(",")).join("\n");
    const names = { left: this.left.name, right: this.right.name };
    const text = kind === "csv" ? `${lines()}\n` : JSON.stringify({ ...names, pixels: rows });
    const url = URL.createObjectURL(new Blob([text]));
    Object.assign(document.createElement("a"), { href: url, download: `pixels.${kind}` }).click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
  }

  paint() {
    const style = getComputedStyle(document.body);
    this.bar.setv({ major_label_text_color: shownColor(style.color), major_label_text_font: style.fontFamily, major_tick_line_color: null });
  }
}

for (const root of document.querySelectorAll(".comparison")) new Comparison(root).show();
