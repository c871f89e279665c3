// What the page does beside its plots and widgets: colours of the theme, the cards of the dimension, the clipboard.
(function start() {
  const page = document.getElementById("page");
  const model = (name) => window.Bokeh?.documents[0]?.get_model_by_name(name);
  if (!model("code") || !window.Bokeh.documents[0].is_idle) return void requestAnimationFrame(start);

  const dark = matchMedia("(prefers-color-scheme: dark)");
  const paint = () => {
    for (const name of ["interval-shares", "interval-scale", "square-shares", "square-shares-above", "bias"]) {
      const mapper = model(name);
      mapper.setv({ palette: mapper.tags[dark.matches ? 1 : 0] }, { sync: false });
    }
    window.dispatchEvent(new Event("resize")); // plots take their other colours from the style sheet as they draw
  };
  dark.addEventListener("change", paint);
  paint();

  const dimension = model("dimension");
  const arrange = () => { page.dataset.d = dimension.active + 1; };
  dimension.properties.active.change.connect(arrange);
  arrange();

  const code = model("code");
  const copied = document.getElementById("copied");
  code.properties.tags.change.connect(async () => {
    try {
      await navigator.clipboard.writeText(code.text);
      copied.textContent = "copied";
    } catch {
      copied.textContent = "the browser keeps the clipboard closed: select the text below";
    }
    setTimeout(() => { copied.textContent = ""; }, 4000);
  });
  page.setAttribute("aria-busy", "false");
})();
