"use strict";
(() => {
  // Times: every [data-at] chooses one; the event tells all scripts of the page.
  const EVENT = "cellplan:time";
  const bar = document.getElementById("chosen");
  const strips = document.querySelector(".strips");
  const tell = (seconds) => document.dispatchEvent(new CustomEvent(EVENT, { detail: seconds }));
  const hasText = (text) => /\S/.test(text);

  for (const each of document.querySelectorAll("[data-at]")) {
    if (each.matches("a, button")) continue;
    each.setAttribute("role", "button");
    each.tabIndex = 0;
    if (!hasText(each.textContent) || each.title) each.setAttribute("aria-label", each.title || `${each.dataset.at} s`);
  }
  document.addEventListener("click", (event) => {
    const at = event.target.closest("[data-at]");
    if (!at || event.ctrlKey || event.metaKey || event.shiftKey || event.button) return;
    event.preventDefault();
    tell(underPointer(event, at) ?? Number(at.dataset.at));
  });
  document.addEventListener("keydown", (event) => {
    const at = event.target.closest("[data-at][role=button]");
    if (!at || (event.key !== "Enter" && event.key !== " ")) return;
    event.preventDefault();
    tell(Number(at.dataset.at));
  });
  function underPointer(event, at) {
    const strip = at.closest(".strip");
    if (!strip || !event.detail) return null;
    const box = strip.getBoundingClientRect();
    const share = Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
    return Math.round(1e4 * share * Number(strips.dataset.total)) / 1e4;
  }

  // What is chosen: a bar with a way to the 3-D page, the same times marked, a line through the time line.
  document.addEventListener(EVENT, ({ detail }) => {
    const isChosen = Number.isFinite(detail);
    for (const link of document.querySelectorAll("a[data-view]")) {
      const t = Number(link.dataset.begin || 0) + detail;
      link.href = isChosen ? `${link.dataset.view}#t=${Math.round(1e4 * t) / 1e4}` : link.dataset.view;
    }
    for (const each of document.querySelectorAll("[data-at].chosen")) each.classList.remove("chosen");
    for (const each of document.querySelectorAll(".at[data-at]"))
      if (isChosen && Number(each.dataset.at) === detail) each.classList.add("chosen");
    if (bar) {
      bar.hidden = !isChosen;
      if (isChosen) bar.querySelector("b").textContent = detail.toFixed(3);
    }
    if (strips) showCursor(isChosen ? detail / Number(strips.dataset.total) : null);
  });
  if (bar) bar.querySelector("button").addEventListener("click", () => tell(null));
  function showCursor(share) {
    for (const old of strips.querySelectorAll(".strip-cursor")) old.remove();
    if (share === null) return;
    for (const strip of strips.querySelectorAll(".strip")) {
      const cursor = document.createElement("i");
      cursor.className = "strip-cursor";
      cursor.style.left = `${100 * share}%`;
      strip.append(cursor);
    }
  }

  // Tables: a click on a heading sorts by its column, a second one the other way round, a third one as printed.
  const NEXT = { none: "ascending", ascending: "descending", descending: "none" };
  const NUMBER = /[-−]?\d+(?:\.\d+)?/;
  const words = new Intl.Collator("en", { numeric: true });
  for (const table of document.querySelectorAll("table")) {
    const [body] = table.tBodies;
    if (!table.tHead || !body || body.rows.length < 2 || body.querySelector("[colspan], [rowspan]")) continue;
    const printed = [...body.rows];
    for (const [heading, column] of leaves(table.tHead)) {
      if (!hasText(heading.textContent)) continue;
      const button = document.createElement("button");
      button.type = "button";
      button.append(...heading.childNodes);
      heading.append(button);
      heading.setAttribute("aria-sort", "none");
      button.addEventListener("click", () => {
        const way = NEXT[heading.getAttribute("aria-sort")];
        for (const each of table.tHead.querySelectorAll("[aria-sort]")) each.setAttribute("aria-sort", "none");
        heading.setAttribute("aria-sort", way);
        body.append(...(way === "none" ? printed : sorted(printed, column, way === "descending")));
      });
    }
  }
  function leaves(head) {
    const found = [];
    const taken = [...head.rows].map(() => []);
    [...head.rows].forEach((row, y) => {
      let x = 0;
      for (const cell of row.cells) {
        while (taken[y][x]) x += 1;
        for (let dy = 0; dy < cell.rowSpan; dy += 1)
          for (let dx = 0; dx < cell.colSpan; dx += 1) if (taken[y + dy]) taken[y + dy][x + dx] = true;
        if (cell.colSpan === 1 && y + cell.rowSpan === head.rows.length) found.push([cell, x]);
        x += cell.colSpan;
      }
    });
    return found;
  }
  function sorted(rows, column, isReversed) {
    const keyed = rows.map((row) => ({ row, ...key(row.cells[column]) }));
    const areNumbers = keyed.every((each) => each.isEmpty || Number.isFinite(each.value));
    const sign = isReversed ? -1 : 1;
    keyed.sort((a, b) => {
      if (a.isEmpty !== b.isEmpty) return a.isEmpty ? 1 : -1; // dashes stay at the end
      return sign * (areNumbers ? a.value - b.value : words.compare(a.text, b.text));
    });
    return keyed.map((each) => each.row);
  }
  function key(cell) {
    const text = cell ? cell.textContent.trim() : "";
    const isEmpty = text === "" || text === "–";
    const own = cell?.dataset.value;
    const match = own === undefined && !cell?.classList.contains("text") && cell?.tagName === "TD" && text.match(NUMBER);
    const value = own !== undefined ? Number(own) : match ? Number(match[0].replace("−", "-")) : Number(text || "x");
    return { text, isEmpty, value };
  }

  // Boxes that scroll can be scrolled by keys; what an address leads to is unfolded.
  const wide = () => {
    for (const box of document.querySelectorAll(".wide, .plot, .floor-plan div"))
      if (box.scrollWidth > box.clientWidth) box.tabIndex = 0;
      else box.removeAttribute("tabindex");
  };
  addEventListener("resize", wide);
  wide();
  const unfold = () => {
    const target = document.querySelector(":target");
    for (let each = target; each; each = each.parentElement) if (each.tagName === "DETAILS") each.open = true;
    if (target) target.scrollIntoView();
  };
  addEventListener("hashchange", unfold);
  unfold();

  document.body.dataset.ready = "true";
})();
