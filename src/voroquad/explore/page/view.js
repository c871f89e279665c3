// The image as its rounds come: pixels and numbers from the document, exposure and view from the page.
(function start() {
  const document_ = window.Bokeh?.documents[0];
  const film = document_?.get_model_by_name("film");
  if (!film) return void requestAnimationFrame(start);

  const element = (id) => document.getElementById(id);
  let pixels = null; // of the last round, by channel, top row first
  let [width, height, exposure] = [0, 0, 0];

  const duration = (seconds) => {
    if (seconds === null || !Number.isFinite(seconds)) return "–";
    const whole = Math.round(seconds);
    const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
    const two = (number) => String(number).padStart(2, "0");
    return h ? `${h}:${two(m)}:${two(s)}` : `${m}:${two(s)}`;
  };

  const draw = () => {
    const source = document_.get_model_by_name("pixels");
    if (!pixels || !source) return;
    const area = width * height;
    const shown = new Uint32Array(area);
    for (let row = 0; row < height; row++) {
      const to = (height - 1 - row) * width; // Bokeh has the bottom row first
      for (let column = 0; column < width; column++) {
        const k = row * width + column;
        shown[to + column] = shownPixel(pixels[k], pixels[area + k], pixels[2 * area + k], exposure);
      }
    }
    const Kind = source.get_array("image")[0].constructor;
    source.setv({ data: { image: [new Kind(shown.buffer, [height, width])] } }, { sync: false });
  };

  const tell = ({ spp, rounds, end, error, seconds, left }) => {
    const done = end !== null && rounds >= end;
    element("spp").textContent = spp;
    element("rounds").textContent = end === null ? rounds : `${rounds} of ${end}`;
    element("error").textContent = error === null ? "after two rounds" : `${(100 * error).toPrecision(2)} %`;
    element("seconds").textContent = duration(seconds);
    element("left").textContent = duration(left);
    element("state").textContent = done ? "The image is complete." : "Rendering; the image changes with each round.";
    if (end === null) element("progress").removeAttribute("value");
    else element("progress").value = rounds / end;
    element("view").setAttribute("aria-busy", String(!done));
  };

  const update = async () => {
    const [round] = film.tags;
    if (!round) return;
    if (!document_.get_model_by_name("image")) return void location.reload(); // opened before the first round
    [width, height] = [round.width, round.height];
    pixels = await unpack(round.pixels);
    draw();
    tell(round);
  };
  film.properties.tags.change.connect(update);
  update();

  // The view, in pixels of the image; the plot keeps it inside
  const zoom = (factor) => {
    const { x_range: x, y_range: y } = document_.get_model_by_name("image") ?? {};
    if (!x) return;
    const across = clamp((x.end - x.start) / factor, Math.min(8, width), width);
    const [middle, centre] = [(x.start + x.end) / 2, (y.start + y.end) / 2];
    const down = (across * height) / width;
    const left = clamp(middle - across / 2, 0, width - across);
    const bottom = clamp(centre - down / 2, 0, height - down);
    x.setv({ start: left, end: left + across }, { sync: false });
    y.setv({ start: bottom, end: bottom + down }, { sync: false });
  };
  const keys = { "+": () => zoom(2), "-": () => zoom(1 / 2), 0: () => zoom(0) };
  element("whole").addEventListener("click", () => zoom(0));
  element("zoom-in").addEventListener("click", () => zoom(2));
  element("zoom-out").addEventListener("click", () => zoom(1 / 2));
  document.addEventListener("keydown", (event) => {
    if (!event.ctrlKey && !event.metaKey && !event.altKey) keys[event.key]?.();
  });

  element("exposure").addEventListener("input", (event) => {
    exposure = Number(event.target.value);
    element("exposure-value").textContent = stops(exposure);
    draw();
  });
})();
