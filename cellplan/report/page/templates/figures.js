"use strict";
(() => {
  // Figures over time share one cursor and one zoom; all that is drawn here is added to SVG that is whole without it.
  const SVG = "http://www.w3.org/2000/svg";
  const EVENT = "cellplan:time";
  const KEYS = "Arrow keys move the time cursor, Enter chooses its time, plus and minus zoom, 0 shows all, Escape clears.";
  const LEFT = 42, RIGHT = 11, HEAD = 33, FOOT = 20, NARROW = 560, PIXELS = 1.25; // points; pixels; pixels to a point
  const TOOLS = 56; // points beside a title for the buttons
  const SUPERSCRIPTS = "⁰¹²³⁴⁵⁶⁷⁸⁹";
  const figures = [];
  let pinned = null, hovered = null, pixelsBefore = innerWidth, isPrinting = false;

  function make(name, attributes, parent, text = "") {
    const element = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.textContent = text;
    parent.append(element);
    return element;
  }

  // ---- what a figure holds
  function readFigure(svg) {
    const panels = [...svg.querySelectorAll("g.panel[data-time]")].map(readPanel);
    const [, , width, height] = svg.getAttribute("viewBox").split(" ").map(Number);
    const title = [...svg.children].find((each) => each.tagName === "text" && each.getAttribute("font-weight"));
    const others = [...svg.children].filter((each) => each.tagName === "text" && each !== title);
    return { svg, panels, title, name: title?.textContent ?? "", others, width, height, holder: svg.parentElement };
  }
  function readPanel(group) {
    const numbers = (key) => group.dataset[key].split(" ").map(Number);
    const [left, top] = group.getAttribute("transform").match(/-?[\d.]+/g).map(Number);
    const box = group.querySelector("svg.box");
    const curves = [...box.querySelectorAll("path.curve")].map(readCurve);
    const marks = [...box.querySelectorAll("path.mark")].map((path) => ({ path, d: path.getAttribute("d") }));
    const ends = [...group.children].filter((each) => each.tagName === "text" && each.getAttribute("text-anchor") === "end");
    const [width, height] = numbers("size");
    const cursor = make("g", { class: "figure-cursor" }, group);
    return {
      group, box, left, top, width, height, curves, marks, ends, cursor, frame: group.querySelector("path.frame"),
      x: numbers("x"), y: numbers("y"), view: numbers("x"), isLog: "log" in group.dataset, unit: group.dataset.unit ?? "",
      ticks: [...group.querySelectorAll(".tick-x")], keys: [...group.querySelectorAll(".key")],
      note: group.querySelector(".note"), heads: [...group.querySelectorAll(".title, .key")], full: [width, left, top],
      grid: box.querySelector(".grid"), lines: box.querySelector(".grid")?.getAttribute("d") ?? "",
      across: [...box.querySelectorAll("path.bound")], bands: [...box.querySelectorAll("rect")],
    };
  }
  function readCurve(path) {
    const parts = [];
    for (const text of path.getAttribute("d").split("M").slice(1)) {
      const [x0, y0, ...steps] = text.replace("h0", "").match(/-?\d+/g).map(Number);
      const xs = [x0], ys = [y0];
      for (let i = 0; i < steps.length; i += 2) {
        xs.push(xs.at(-1) + steps[i]);
        ys.push(ys.at(-1) + steps[i + 1]);
      }
      parts.push([xs, ys]);
    }
    return { path, d: path.getAttribute("d"), parts, name: path.dataset.name ?? "", colour: path.getAttribute("stroke") };
  }

  // ---- values at a time
  const share = ([low, high], t) => (t - low) / (high - low);
  function heightAt(panel, curve, t) {
    const at = 100 * panel.full[0] * share(panel.x, t);
    for (const [xs, ys] of curve.parts) {
      if (at < xs[0] - 1 || at > xs.at(-1) + 1) continue;
      let low = 0, high = xs.length - 1;
      while (high - low > 1) {
        const middle = (low + high) >> 1;
        if (xs[middle] <= at) low = middle;
        else high = middle;
      }
      const part = xs[high] > xs[low] ? Math.min(1, Math.max(0, (at - xs[low]) / (xs[high] - xs[low]))) : 0;
      return ys[low] + part * (ys[high] - ys[low]);
    }
    return null;
  }
  function valueAt(panel, curve, t) {
    const y = heightAt(panel, curve, t);
    if (y === null) return null;
    const [low, high] = panel.y, part = 1 - y / (100 * panel.height);
    return panel.isLog ? low * (high / low) ** part : low + (high - low) * part;
  }
  function worded(panel, value) {
    if (!panel.isLog) return value.toFixed(Math.max(0, Math.min(8, Math.ceil(-Math.log10((panel.y[1] - panel.y[0]) / 500))))).replace(/^-(?=0*\.?0*$)/, "").replace("-", "−");
    if (value <= 1.01 * panel.y[0]) return `< ${power(panel.y[0])}`;
    return value >= 1e-3 ? Number(value.toPrecision(2)).toString() : power(value);
  }
  function power(value) {
    const [digits, exponent] = value.toExponential(1).split("e");
    const raised = exponent.replace("+", "").replace("-", "⁻").replace(/\d/g, (digit) => SUPERSCRIPTS[digit]);
    return `${Number(digits) === 1 ? "" : `${Number(digits)}·`}10${raised}`;
  }
  function readings(panel, t) {
    return panel.curves.flatMap((curve, index) => {
      const value = valueAt(panel, curve, t);
      const name = panel.keys.length === panel.curves.length ? panel.keys[index].textContent : curve.name;
      return value === null ? [] : [{ name, colour: curve.colour, text: worded(panel, value), y: heightAt(panel, curve, t) / 100 }];
    });
  }

  // ---- the cursor
  const shown = () => hovered ?? pinned;
  function drawCursors() {
    for (const figure of figures) for (const panel of figure.panels) drawCursor(panel, shown());
  }
  function drawCursor(panel, t) {
    panel.cursor.replaceChildren();
    const isIn = t !== null && t >= panel.view[0] - 1e-9 && t <= panel.view[1] + 1e-9;
    panel.group.classList.toggle("read", isIn);
    if (!isIn) return;
    const x = panel.width * share(panel.view, t), found = readings(panel, t);
    make("path", { class: "cursor-line", d: `M${x.toFixed(2)} 0v${panel.height}` }, panel.cursor);
    for (const each of found)
      make("circle", { cx: x.toFixed(2), cy: each.y.toFixed(2), r: 2.2, fill: each.colour }, panel.cursor);
    const words = make("text", { class: "reading", x: panel.width, y: -5, "text-anchor": "end", "font-size": 7.5 }, panel.cursor);
    make("tspan", {}, words, `${t.toFixed(3)} s: `);
    found.forEach((each, index) => {
      const isAlone = found.length === 1, unit = isAlone || index === found.length - 1 ? ` ${panel.unit}` : "";
      make("tspan", isAlone ? {} : { fill: each.colour, "font-weight": "bold" }, words, `${index ? "  " : ""}${isAlone ? "" : `${each.name} `}${each.text}${unit}`);
    });
  }
  function say(figure) {
    const t = shown();
    const texts = figure.panels.map((panel) => {
      const title = panel.group.querySelector(".title")?.textContent ?? "";
      return `${title}: ${readings(panel, t).map((each) => `${each.name} ${each.text}`).join(", ")} ${panel.unit}`;
    });
    status.textContent = t === null ? "" : `${t.toFixed(3)} s. ${texts.join("; ")}`;
  }
  function choose(t) {
    document.dispatchEvent(new CustomEvent(EVENT, { detail: t }));
  }
  document.addEventListener(EVENT, ({ detail }) => {
    pinned = Number.isFinite(detail) ? detail : null;
    drawCursors();
  });

  // ---- zoom and arrangement
  const same = (a, b) => a[0] === b[0] && a[1] === b[1];
  function zoom(range, [first, last]) {
    const least = (range[1] - range[0]) / 500;
    let low = Math.max(range[0], first), high = Math.min(range[1], last);
    if (high - low < least) [low, high] = [Math.max(range[0], (low + high - least) / 2), Math.min(range[1], (low + high + least) / 2)];
    for (const figure of figures)
      for (const panel of figure.panels) if (same(panel.x, range)) panel.view = [low, high];
    figures.forEach(draw);
  }
  function zoomAbout(panel, t, factor) {
    const [low, high] = panel.view;
    zoom(panel.x, [t - factor * (t - low), t + factor * (high - t)]);
  }
  function ticks([low, high]) {
    const rough = (high - low) / 5, base = 10 ** Math.floor(Math.log10(rough));
    const step = base * [1, 2, 2.5, 5, 10].find((factor) => base * factor >= rough * 0.999999);
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k <= high / step + 1e-9; k += 1) found.push(Number((k * step).toPrecision(9)));
    return found;
  }
  function arrange(figure) {
    const pixels = figure.holder.clientWidth;
    const isNarrow = pixels > 0 && pixels < NARROW && !isPrinting;
    const width = isNarrow ? pixels / PIXELS : figure.width;
    let top = 30 + HEAD;
    if (figure.title) top += 13 * wrapped(figure.title, figure.name, isNarrow ? Math.floor((width - TOOLS) / 6.6) : Infinity);
    for (const panel of figure.panels) {
      const [own, left, above] = panel.full;
      panel.width = isNarrow ? width - LEFT - RIGHT : own;
      panel.group.setAttribute("transform", isNarrow ? `translate(${LEFT} ${top})` : `translate(${left} ${above})`);
      panel.left = isNarrow ? LEFT : left;
      panel.top = isNarrow ? top : above;
      panel.isNarrow = isNarrow;
      for (const each of panel.heads) each.setAttribute("y", isNarrow ? "-15.00" : "-5.00");
      for (const each of panel.ends) each.setAttribute("x", each.matches(".note") ? panel.width.toFixed(2) : (panel.width - 3).toFixed(2));
      top += panel.height + HEAD + (isNarrow ? FOOT : 0);
    }
    const height = isNarrow ? top - HEAD + 8 : figure.height;
    figure.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    figure.svg.classList.toggle("narrow", isNarrow);
    for (const each of figure.others) each.style.display = isNarrow ? "none" : "";
    figure.size = width;
  }
  function wrapped(element, text, letters) {
    element.replaceChildren();
    let line = "", lines = 0;
    for (const word of [...text.split(" "), null]) {
      if (word !== null && (!line || line.length + word.length < letters)) line = line ? `${line} ${word}` : word;
      else {
        make("tspan", lines ? { x: element.getAttribute("x"), dy: 13 } : {}, element, line);
        lines += 1;
        line = word ?? "";
      }
    }
    return lines - 1;
  }
  function draw(figure) {
    arrange(figure);
    figure.panels.forEach(drawPanel);
    figure.reset.hidden = figure.panels.every((panel) => same(panel.x, panel.view));
    drawCursors();
  }
  function drawPanel(panel) {
    const { box, width, height, view } = panel, fine = 100 * width;
    const isPlain = same(panel.x, view) && width === panel.full[0];
    const scale = (100 * panel.full[0] * (view[1] - view[0])) / (panel.x[1] - panel.x[0]);
    const moved = (x) => Math.round(((x - 100 * panel.full[0] * share(panel.x, view[0])) / scale) * fine);
    box.setAttribute("viewBox", `0 0 ${Math.round(fine)} ${Math.round(100 * height)}`);
    box.setAttribute("width", width);
    box.setAttribute("overflow", same(panel.x, view) ? "visible" : "hidden");
    panel.frame.setAttribute("d", `M0 0V${height}H${width}`);
    for (const each of panel.bands) each.setAttribute("width", Math.round(fine));
    for (const each of panel.across) each.setAttribute("d", each.getAttribute("d").replace(/H\d+/, `H${Math.round(fine)}`));
    for (const curve of panel.curves) curve.path.setAttribute("d", isPlain ? curve.d : curve.parts.map((part) => course(part, moved, fine)).join(""));
    for (const { path, d } of panel.marks) {
      const x = moved(Number(d.match(/-?\d+/)[0]));
      path.setAttribute("d", isPlain ? d : d.replace(/-?\d+/, x));
      path.style.display = x < -1 || x > fine + 1 ? "none" : "";
    }
    drawTicks(panel, isPlain);
  }
  function course([xs, ys], moved, fine) {
    let text = "";
    xs.forEach((x, i) => {
      const near = moved(xs[Math.min(i + 1, xs.length - 1)]) >= 0 && moved(xs[Math.max(i - 1, 0)]) <= fine;
      if (near) text += `${text ? "L" : "M"}${moved(x)} ${ys[i]}`;
    });
    return text;
  }
  function drawTicks(panel, isPlain) {
    for (const old of panel.group.querySelectorAll(".own-tick")) old.remove();
    for (const each of panel.ticks) each.style.display = isPlain ? "" : "none";
    if (isPlain) {
      panel.grid?.setAttribute("d", panel.lines);
      return;
    }
    const up = panel.lines.match(/M0 -?\d+h\d+/g) ?? [];
    const values = ticks(panel.view), at = (t) => panel.width * share(panel.view, t);
    const across = values.map((t) => `M${Math.round(100 * at(t))} 0v${Math.round(100 * panel.height)}`);
    panel.grid?.setAttribute("d", across.join("") + up.map((each) => each.replace(/h\d+/, `h${Math.round(100 * panel.width)}`)).join(""));
    if (!panel.ticks.length && !panel.isNarrow) return;
    for (const t of values)
      make("text", { class: "own-tick", x: at(t).toFixed(2), y: panel.height + 10, "text-anchor": "middle", "font-size": 8 }, panel.group, String(t));
  }

  // ---- pointers and keys
  function place(figure, event) {
    const rect = figure.svg.getBoundingClientRect(), points = figure.size / rect.width;
    const x = (event.clientX - rect.left) * points, y = (event.clientY - rect.top) * points;
    const panel = figure.panels.find((each) => x >= each.left - 6 && x <= each.left + each.width + 6 && y >= each.top - 20 && y <= each.top + each.height + 12);
    return panel ? { panel, t: timeAt(panel, x - panel.left), x: x - panel.left } : null;
  }
  function timeAt(panel, x) {
    const part = Math.min(1, Math.max(0, x / panel.width));
    return panel.view[0] + part * (panel.view[1] - panel.view[0]);
  }
  const rounded = (t) => Math.round(1e4 * t) / 1e4;
  function listen(figure) {
    const { svg, holder } = figure, touches = new Map();
    let begun = null, selection = null, spread = 0;
    svg.addEventListener("pointerdown", (event) => {
      if (event.button) return;
      touches.set(event.pointerId, event.clientX);
      begun = touches.size === 1 ? place(figure, event) : null;
      spread = touches.size === 2 ? distance(touches) : 0;
      if (begun) svg.setPointerCapture(event.pointerId);
    });
    svg.addEventListener("pointermove", (event) => {
      const at = place(figure, event);
      if (touches.has(event.pointerId)) touches.set(event.pointerId, event.clientX);
      if (touches.size === 2 && at) {
        const now = distance(touches);
        if (now > 20 && spread > 20) zoomAbout(at.panel, at.t, spread / now);
        spread = now;
        return;
      }
      if (begun && event.pointerType !== "touch") selection = select(begun, event, selection);
      hovered = at || begun ? rounded(at?.t ?? shown()) : null;
      drawCursors();
    });
    svg.addEventListener("pointerup", (event) => {
      const from = begun, range = selection?.range;
      finish(event);
      if (range) {
        hovered = null; // the pointer is at another time now
        zoom(from.panel.x, range);
      } else if (from && hovered !== null) choose(hovered);
    });
    const finish = (event) => {
      touches.delete(event.pointerId);
      selection?.element.remove();
      begun = selection = null;
    };
    svg.addEventListener("pointercancel", (event) => {
      finish(event);
      hovered = null; // the page scrolls
      drawCursors();
    });
    svg.addEventListener("pointerleave", (event) => {
      if (touches.size && event.pointerType !== "touch") return;
      hovered = null;
      drawCursors();
    });
    svg.addEventListener("dblclick", () => zoom(figure.panels[0].x, figure.panels[0].x));
    svg.addEventListener("wheel", (event) => {
      const at = place(figure, event), turned = event.deltaY || event.deltaX;
      if (!at || !(event.ctrlKey || event.shiftKey || event.metaKey) || !turned) return;
      event.preventDefault();
      zoomAbout(at.panel, at.t, turned > 0 ? 1.25 : 0.8);
    }, { passive: false });
    holder.addEventListener("keydown", (event) => key(figure, event));
    holder.addEventListener("blur", () => { hovered = null; drawCursors(); });
    function select(from, moved, old) {
      const rect = svg.getBoundingClientRect();
      const x = Math.min(from.panel.width, Math.max(0, ((moved.clientX - rect.left) * figure.size) / rect.width - from.panel.left));
      if (!old && Math.abs(x - from.x) < 6) return null;
      const element = old?.element ?? make("rect", { class: "selection", y: 0, height: from.panel.height }, from.panel.group);
      element.setAttribute("x", Math.min(x, from.x));
      element.setAttribute("width", Math.abs(x - from.x));
      return { element, range: [from.t, timeAt(from.panel, x)].sort((a, b) => a - b) };
    }
  }
  const distance = (touches) => Math.abs([...touches.values()][0] - [...touches.values()][1]);
  function key(figure, event) {
    if (event.target !== figure.holder || event.ctrlKey || event.metaKey || event.altKey) return;
    const [panel] = figure.panels, [low, high] = panel.view, step = (high - low) / (event.shiftKey ? 10 : 100);
    const t = Math.min(high, Math.max(low, shown() ?? low));
    const moves = { ArrowLeft: t - step, ArrowRight: t + step, Home: low, End: high };
    if (event.key in moves) {
      hovered = rounded(Math.min(high, Math.max(low, shown() === null ? low : moves[event.key])));
      drawCursors();
      say(figure);
    } else if (event.key === "Enter" && shown() !== null) choose(shown());
    else if (event.key === "Escape") { hovered = null; choose(null); }
    else if (event.key === "+" || event.key === "=") zoomAbout(panel, t, 0.5);
    else if (event.key === "-") zoomAbout(panel, t, 2);
    else if (event.key === "0") zoom(panel.x, panel.x);
    else return;
    event.preventDefault();
  }

  // ---- controls
  function control(figure) {
    const tools = document.createElement("div");
    tools.className = "figure-tools";
    const [panel] = figure.panels;
    const middle = () => { const t = shown(), [low, high] = panel.view; return t !== null && t >= low && t <= high ? t : (low + high) / 2; };
    const add = (label, text, act) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = text;
      button.setAttribute("aria-label", label);
      button.addEventListener("click", act);
      tools.append(button);
      return button;
    };
    add("zoom out", "−", () => zoomAbout(panel, middle(), 2));
    add("zoom in", "+", () => zoomAbout(panel, middle(), 0.5));
    figure.reset = add("show the whole motion", "all", () => zoom(panel.x, panel.x));
    const { holder } = figure;
    holder.classList.add("over-time");
    holder.setAttribute("role", "group");
    holder.setAttribute("aria-description", KEYS);
    holder.tabIndex = 0;
    holder.prepend(tools);
  }
  const status = document.createElement("p");
  status.className = "figure-status";
  status.setAttribute("role", "status");
  document.body.append(status);
  for (const svg of document.querySelectorAll("figure > svg.figure")) {
    const figure = readFigure(svg);
    if (!figure.panels.length) continue;
    figures.push(figure);
    control(figure);
    listen(figure);
    draw(figure);
    svg.closest("details")?.addEventListener("toggle", () => draw(figure));
  }
  addEventListener("resize", () => {
    if (innerWidth !== pixelsBefore) figures.forEach(draw);
    pixelsBefore = innerWidth;
  });
  const views = new Map();
  addEventListener("beforeprint", () => {
    isPrinting = true; // on paper figures are what they are in the files
    for (const panel of figures.flatMap((figure) => figure.panels)) {
      views.set(panel, panel.view);
      panel.view = panel.x;
    }
    figures.forEach(draw);
  });
  addEventListener("afterprint", () => {
    isPrinting = false;
    for (const [panel, view] of views) panel.view = view;
    figures.forEach(draw);
  });
})();
