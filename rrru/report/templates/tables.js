"use strict";
// tables that sort by a click on a column's head and show the rows that hold what is looked for
(() => {
  const number = (text) => {
    const value = parseFloat(text.replace(/\u2212/g, "-").replace(/^(more|less) than /, ""));
    return Number.isNaN(value) ? null : value;
  };
  const compare = (a, b) => {
    const [x, y] = [number(a), number(b)];
    if (x !== null && y !== null) return x - y;
    if ((x === null) !== (y === null)) return x === null ? 1 : -1;
    return a.localeCompare(b, "en", { numeric: true });
  };
  const sort = (head, index) => {
    const body = head.closest("table").tBodies[0];
    const down = head.getAttribute("aria-sort") === "ascending";
    for (const other of head.parentNode.children) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", down ? "descending" : "ascending");
    const rows = [...body.rows].sort((a, b) => compare(a.cells[index].textContent, b.cells[index].textContent));
    body.append(...(down ? rows.reverse() : rows));
  };
  const find = (table, text) => {
    const wanted = text.toLowerCase().split(/\s+/).filter(Boolean);
    const rows = [...table.querySelectorAll("tbody tr")];
    let shown = 0;
    for (const row of rows) {
      const held = row.textContent.toLowerCase();
      row.hidden = !wanted.every((word) => held.includes(word));
      shown += !row.hidden;
    }
    table.querySelector(".count").textContent = wanted.length ? `${shown} of ${rows.length} rows` : `${rows.length} rows`;
    return shown;
  };
  for (const head of document.querySelectorAll("thead th")) {
    const index = [...head.parentNode.children].indexOf(head);
    head.querySelector("button").addEventListener("click", () => sort(head, index));
  }
  for (const field of document.querySelectorAll("input[data-find]"))
    field.addEventListener("input", () => find(field.closest(".table"), field.value));
  const contents = document.querySelector("nav details");
  if (contents && !matchMedia("(min-width: 64rem)").matches) contents.open = false;
  const everywhere = document.getElementById("find-all");
  everywhere?.addEventListener("input", () => {
    for (const mark of document.querySelectorAll(".hits")) {
      let hits = 0;
      for (const table of document.querySelectorAll(`#${mark.dataset.section} .table`)) {
        table.querySelector("input").value = everywhere.value;
        hits += find(table, everywhere.value);
      }
      mark.textContent = everywhere.value.trim() ? `(${hits})` : "";
    }
  });
})();
