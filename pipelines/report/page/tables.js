// Tables one can sort by a column and filter by words. Without this script they are plain tables.
(() => {
  "use strict";
  const value = cell => {
    const text = (cell.dataset.sort ?? cell.textContent).trim();
    const number = parseFloat(text.replace(/−/g, "-"));
    return text !== "" && !Number.isNaN(number) && /^[-−+.\d]/.test(text) ? number : text.toLowerCase();
  };
  const compare = (a, b) => (typeof a === "number" && typeof b === "number" ? a - b
    : typeof a === "number" ? -1 : typeof b === "number" ? 1 : a.localeCompare(b));
  for (const table of document.querySelectorAll("table.sortable")) {
    const head = table.rows[0], body = head.parentNode, rows = [...table.rows].slice(1);
    [...head.cells].forEach((th, column) => {
      const button = document.createElement("button");
      button.type = "button";
      button.append(...th.childNodes);
      th.append(button);
      button.onclick = () => {
        const down = th.getAttribute("aria-sort") === "ascending";
        for (const other of head.cells) other.removeAttribute("aria-sort");
        th.setAttribute("aria-sort", down ? "descending" : "ascending");
        rows.sort((a, b) => (down ? -1 : 1) * compare(value(a.cells[column]), value(b.cells[column])));
        body.append(...rows);
      };
    });
    const box = table.closest(".scroll"), field = document.createElement("input"), count = document.createElement("output");
    const filter = document.createElement("div"), label = document.createElement("label");
    filter.className = "filter";
    field.type = "search";
    label.append("Rows that contain ", field);
    filter.append(label, count);
    const tell = shown => { count.textContent = `${shown} of ${rows.length} rows`; };
    field.oninput = () => {
      const words = field.value.toLowerCase().split(/\s+/).filter(Boolean);
      let shown = 0;
      for (const row of rows) {
        const text = row.textContent.toLowerCase();
        row.hidden = !words.every(word => text.includes(word));
        shown += !row.hidden;
      }
      tell(shown);
    };
    tell(rows.length);
    (box || table).before(filter);
  }
  // What scrolls within itself can be scrolled by keyboard.
  const boxes = [...document.querySelectorAll(".scroll, .drawn, pre")];
  const reach = () => {
    for (const box of boxes) {
      if (box.scrollWidth > box.clientWidth + 1) {
        box.tabIndex = 0;
        if (!box.hasAttribute("role")) { box.setAttribute("role", "region"); box.setAttribute("aria-label", "scrolls sideways"); }
      } else box.removeAttribute("tabindex");
    }
  };
  addEventListener("resize", reach);
  document.addEventListener("toggle", reach, true);
  reach();
  document.documentElement.classList.add("scripted");
})();
