// Sorts tables, enlarges figures, copies commands, searches the home page. Without it, pages read the same.
(() => {
  const NUMBER = /^(-?)(\d[\d.]*(?:e[-+]?\d+)?|∞)/i;
  const element = (kind, attributes = {}, ...children) => {
    const made = Object.assign(document.createElement(kind), attributes);
    made.append(...children);
    return made;
  };

  // tables: numbers by their value, with texts and dashes behind them; the third click gives the order of the page
  function value(cell, numeric) {
    const text = cell.textContent.trim();
    if (!numeric) return text.toLowerCase();
    const found = NUMBER.exec(text.replace(/−/g, "-"));
    if (!found) return null;
    return (found[1] ? -1 : 1) * (found[2] === "∞" ? Infinity : Number(found[2]));
  }
  function order(a, b, way) {
    if (a === null || b === null) return (a === null) - (b === null);
    return way * (typeof a === "number" ? (a > b) - (a < b) : a.localeCompare(b, "en", { numeric: true }));
  }
  for (const table of document.querySelectorAll("table.sortable")) {
    const body = table.tBodies[0], rows = [...body.rows], heads = [...table.tHead.rows[0].cells];
    if (rows.length < 2) continue;
    heads.forEach((head, column) => {
      const button = element("button", { type: "button", title: "sort" });
      if (head.querySelector("a")) button.append("⇅"); else button.append(...head.childNodes);  // no link within a button
      head.append(" ", button);
      button.addEventListener("click", () => {
        const next = { ascending: "descending", descending: "none" }[head.getAttribute("aria-sort")] || "ascending";
        heads.forEach(each => each.removeAttribute("aria-sort"));
        let sorted = rows;
        if (next !== "none") {
          head.setAttribute("aria-sort", next);
          const numeric = head.classList.contains("number"), way = next === "ascending" ? 1 : -1;
          const keys = new Map(rows.map(row => [row, value(row.cells[column], numeric)]));
          sorted = [...rows].sort((a, b) => order(keys.get(a), keys.get(b), way));
        }
        body.append(...sorted);
      });
    });
  }

  // figures
  const zoom = document.getElementById("zoom");
  if (zoom && zoom.showModal) {
    const picture = zoom.querySelector("img");
    for (const link of document.querySelectorAll("a.picture")) {
      link.addEventListener("click", event => {
        if (event.ctrlKey || event.metaKey || event.shiftKey) return;
        event.preventDefault();
        zoom.classList.remove("large");
        picture.src = link.href;
        picture.alt = link.querySelector("img").alt;
        zoom.showModal();
      });
    }
    picture.addEventListener("click", () => zoom.classList.toggle("large"));
    zoom.addEventListener("click", event => { if (event.target === zoom) zoom.close(); });
  }

  // commands
  async function copy(code) {
    try {
      await navigator.clipboard.writeText(code.textContent);
    } catch {
      const range = document.createRange();
      range.selectNodeContents(code);
      getSelection().removeAllRanges();
      getSelection().addRange(range);
      document.execCommand("copy");
    }
  }
  for (const code of document.querySelectorAll("code.copy")) {
    const button = element("button", { type: "button", className: "copier" }, "copy");
    button.addEventListener("click", async () => {
      await copy(code);
      button.textContent = "copied";
      setTimeout(() => { button.textContent = "copy"; }, 1500);
    });
    code.after(button);
  }

  // the way back, for whoever came from the home page
  if (location.search === "?home") {
    const back = element("a", { href: "../index.html", className: "home" }, "← all reports");
    document.querySelector("nav.side").prepend(back);
  }
  if (innerWidth < 980) for (const each of document.querySelectorAll("nav.side details")) each.open = false;  // a telephone's page begins with its text

  // search
  const field = document.getElementById("search"), index = document.getElementById("search-index");
  if (field && index) {
    const entries = JSON.parse(index.textContent), MOST = 60, answer = document.getElementById("found"), count = document.getElementById("count");
    field.closest("section").hidden = false;
    field.addEventListener("input", () => {
      const words = field.value.toLowerCase().split(/\s+/).filter(Boolean);
      const found = words.length ? entries.filter(each => words.every(word => each.key.includes(word))) : [];
      count.textContent = words.length ? `${found.length} found${found.length > MOST ? `, ${MOST} shown` : ""}` : "";
      answer.replaceChildren(...found.slice(0, MOST).map(each =>
        element("li", {}, element("a", { href: each.url }, each.text), " ", element("small", {}, `${each.kind} · ${each.report}`))));
    });
    for (const each of entries) each.key = `${each.text} ${each.report} ${each.kind}`.toLowerCase();
  }
})();
