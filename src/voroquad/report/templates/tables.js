// A click on a column's name sorts the table by it, a second click the other way round.
function sortedBy(cell) {
  return cell.dataset.value ?? cell.textContent;
}

function compareNumbers(a, b) {
  const [x, y] = [Number(a), Number(b)];
  return Number.isNaN(x) || Number.isNaN(y) ? Number.isNaN(x) - Number.isNaN(y) : x - y;
}

function sortTable(head, descending) {
  const table = head.closest("table");
  const column = head.cellIndex;
  const key = head.classList.contains("number")
    ? compareNumbers
    : (a, b) => a.localeCompare(b, "en", { numeric: true });
  for (const other of table.tHead.querySelectorAll("[aria-sort]")) other.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", descending ? "descending" : "ascending");
  const rows = [...table.tBodies[0].rows];
  rows.sort((a, b) => key(sortedBy(a.cells[column]), sortedBy(b.cells[column])) * (descending ? -1 : 1));
  table.tBodies[0].append(...rows);
}

for (const button of document.querySelectorAll("table.sortable thead button")) {
  const head = button.parentElement;
  button.addEventListener("click", () => sortTable(head, head.getAttribute("aria-sort") === "ascending"));
}

// The equal-error ratios of another baseline.
for (const choice of document.querySelectorAll("select.baseline")) {
  choice.addEventListener("change", () => {
    for (const cell of choice.closest("table").querySelectorAll("td.ratio")) {
      [cell.dataset.value, cell.textContent] = JSON.parse(cell.dataset.ratios)[choice.value];
    }
  });
}

for (const button of document.querySelectorAll("button.copy")) {
  button.addEventListener("click", async () => {
    const code = button.parentElement.querySelector("code");
    try {
      await navigator.clipboard.writeText(code.textContent);
      button.textContent = "Copied";
    } catch {
      getSelection().selectAllChildren(code); // a page from disk may not write to the clipboard
      button.textContent = "Selected";
    }
    setTimeout(() => (button.textContent = "Copy"), 1500);
  });
}
