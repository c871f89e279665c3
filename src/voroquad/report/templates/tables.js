// A click on a column's name sorts the table by it, a second click the other way round.
function sortedBy(cell) {
  return cell.dataset.value ?? cell.textContent;
}

const compareTexts = (a, b) => a.localeCompare(b, "en", { numeric: true });
const compareNumbers = (a, b) => a - b;

function sortTable(head, descending) {
  const table = head.closest("table");
  const column = head.cellIndex;
  const numbers = head.classList.contains("number");
  const key = (row) => (numbers ? parseFloat(sortedBy(row.cells[column])) : sortedBy(row.cells[column]));
  const order = numbers ? compareNumbers : compareTexts;
  for (const other of table.tHead.querySelectorAll("[aria-sort]")) other.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", descending ? "descending" : "ascending");
  const rows = [...table.tBodies[0].rows];
  const known = rows.filter((row) => !Number.isNaN(key(row)));
  known.sort((a, b) => order(key(a), key(b)) * (descending ? -1 : 1));
  table.tBodies[0].append(...known, ...rows.filter((row) => Number.isNaN(key(row)))); // without a number: last
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
