// Puts Bokeh's models into their elements; resolves to their document, once it is shown.
async function embed({ document: json, roots }) {
  const item = { docid: "document", roots, root_ids: Object.keys(roots) };
  const [manager] = await Bokeh.embed.embed_items({ document: json }, [item]);
  return [...manager][0].model.document;
}

// Axes, grids and titles in the page's colours.
function paint(plot) {
  const style = getComputedStyle(document.body);
  const ink = shownColor(style.color);
  for (const axis of [...plot.below, ...plot.left]) {
    axis.setv({
      axis_line_color: ink, axis_line_alpha: 0.5, major_tick_line_color: ink, major_tick_line_alpha: 0.5,
      minor_tick_line_color: null, axis_label_text_color: ink, major_label_text_color: ink,
      axis_label_text_font_style: "normal", axis_label_text_font: style.fontFamily,
      major_label_text_font: style.fontFamily, major_label_text_font_size: "12px",
    });
  }
  for (const grid of plot.center) {
    if (grid.grid_line_color !== undefined) grid.setv({ grid_line_color: ink, grid_line_alpha: 0.12 });
  }
  plot.title?.setv({ text_color: ink, text_font: style.fontFamily, text_font_size: "14px" });
}

class Plots {
  constructor(element) {
    this.element = element;
    this.buttons = [...element.querySelectorAll(".legend button")];
    this.data = JSON.parse(element.querySelector(".plots-data").textContent);
    for (const button of this.buttons) {
      button.addEventListener("click", () => this.toggle(button));
      for (const [event, on] of [["pointerenter", true], ["focus", true], ["pointerleave", false], ["blur", false]]) {
        button.addEventListener(event, () => this.highlight(on ? button : null));
      }
    }
  }

  async show() {
    const shown = await embed(this.data);
    this.plots = shown.roots();
    document.addEventListener("themechange", () => this.paint());
    this.paint();
  }

  // What Bokeh draws of a line: the line itself, its points, its error bars; or its fit.
  drawn(button, what = "line") {
    const name = `${what}-${button.dataset.line}`;
    return this.plots.flatMap((plot) => [...plot.renderers, ...plot.center].filter((model) => model.name === name));
  }

  paint() {
    this.plots.forEach(paint);
    for (const button of this.buttons) {
      const color = shownColor(getComputedStyle(button.querySelector("svg")).color);
      for (const model of [...this.drawn(button), ...this.drawn(button, "fit")]) {
        if (model.glyph === undefined) {
          model.setv({ line_color: color });
          for (const head of [model.lower_head, model.upper_head]) head.setv({ line_color: color });
        } else {
          model.glyph.setv({ line_color: color });
          if (model.glyph.fill_color?.value) model.glyph.setv({ fill_color: color });
        }
      }
    }
  }

  toggle(button) {
    const visible = button.getAttribute("aria-pressed") !== "true";
    button.setAttribute("aria-pressed", visible);
    for (const model of this.drawn(button)) model.visible = visible;
  }

  // One line with its fit, the others faint; null for all alike.
  highlight(chosen) {
    for (const button of this.buttons) {
      for (const fit of this.drawn(button, "fit")) fit.visible = button === chosen;
      const faint = chosen !== null && button !== chosen;
      for (const model of this.drawn(button)) {
        if (model.glyph && !model.glyph.tags.includes("invisible")) model.glyph.setv({ line_alpha: faint ? 0.15 : 1, ...(model.glyph.fill_alpha && { fill_alpha: faint ? 0.15 : 1 }) });
      }
    }
  }
}

// Plots are drawn when they come near the view.
const nearby = new IntersectionObserver(
  (entries) => {
    for (const { isIntersecting, target } of entries) {
      if (!isIntersecting) continue;
      nearby.unobserve(target);
      new Plots(target).show();
    }
  },
  { rootMargin: "400px" },
);
for (const element of document.querySelectorAll(".plots")) nearby.observe(element);
