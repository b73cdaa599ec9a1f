"use strict";
const table = document.getElementById("robots"), body = table.tBodies[0], rows = Array.from(body.rows);
const value = (row, column) => {
  const cell = row.cells[column], given = cell.dataset.v;
  return given === undefined ? cell.textContent.trim() : given === "" ? null : Number(given);
};
const words = new Intl.Collator(undefined, { numeric: true });
const order = (a, b) => typeof a === "number" && typeof b === "number" ? a - b : words.compare(a, b);
for (const head of table.tHead.rows[0].cells) {
  const button = head.querySelector("button");
  if (!button) continue;
  button.addEventListener("click", () => {
    const down = head.getAttribute("aria-sort") === "ascending", column = head.cellIndex;
    for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", down ? "descending" : "ascending");
    const keyed = rows.map((row) => [value(row, column), row]);
    keyed.sort(([a], [b]) => {
      const empty = (x) => x === null || x === "";
      if (empty(a) || empty(b)) return empty(a) - empty(b);
      return down ? order(b, a) : order(a, b);
    });
    body.append(...keyed.map(([, row]) => row));
  });
}
const search = document.getElementById("search"), shown = document.getElementById("shown");
search.addEventListener("input", () => {
  const wanted = search.value.toLowerCase().split(/\s+/).filter(Boolean);
  let count = 0;
  for (const row of rows) {
    const text = row.textContent.toLowerCase();
    row.hidden = !wanted.every((word) => text.includes(word));
    count += row.hidden ? 0 : 1;
  }
  shown.textContent = shown.dataset.of.replace("#", count);
});
