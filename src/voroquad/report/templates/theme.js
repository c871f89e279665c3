// The theme: the system's, or the one chosen with the button. Runs in the head, so that no wrong one flashes up.
"use strict";
const THEMES = ["system", "light", "dark"];

function storedTheme() {
  try {
    const theme = localStorage.getItem("voroquad-theme");
    return THEMES.includes(theme) ? theme : "system";
  } catch {
    return "system"; // a page from disk may have no storage
  }
}

function setTheme(theme) {
  if (theme === "system") delete document.documentElement.dataset.theme;
  else document.documentElement.dataset.theme = theme;
  try {
    localStorage.setItem("voroquad-theme", theme);
  } catch {
    // it then lasts as long as the page
  }
  document.dispatchEvent(new Event("themechange"));
}

setTheme(storedTheme());
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => document.dispatchEvent(new Event("themechange")));

document.addEventListener("DOMContentLoaded", () => {
  const button = document.querySelector("button.theme");
  const label = () => {
    button.textContent = document.documentElement.dataset.theme ?? "system";
    button.ariaLabel = `Colour theme: ${button.textContent}`;
  };
  button.addEventListener("click", () => {
    setTheme(THEMES[(THEMES.indexOf(document.documentElement.dataset.theme ?? "system") + 1) % THEMES.length]);
    label();
  });
  label();
});

// A CSS colour as the browser shows it, in a form that a canvas and Bokeh both read.
function shownColor(css) {
  const context = Object.assign(document.createElement("canvas"), { width: 1, height: 1 }).getContext("2d");
  context.fillStyle = css;
  context.fillRect(0, 0, 1, 1);
  const [r, g, b, a] = context.getImageData(0, 0, 1, 1).data;
  return `rgba(${r}, ${g}, ${b}, ${a / 255})`;
}
