// Elements of the page by short names; text is always set as text, so that no name becomes markup.

const byId = (id) => document.getElementById(id);

/** A new element with properties, attributes in `attributes`, and children. */
function element(kind, properties = {}, ...children) {
  const { attributes = {}, ...own } = properties;
  const made = Object.assign(document.createElement(kind), own);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

function svgElement(kind, attributes) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", kind);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}

/** A checkbox with its label. */
function checkbox(text, isChecked, onChange, colour) {
  const box = element("input", { type: "checkbox", checked: isChecked });
  box.addEventListener("change", () => onChange(box.checked));
  const swatch = colour ? [element("span", { className: "swatch", style: `background:${colour}` })] : [];
  return element("label", { className: "choice" }, box, ...swatch, text);
}

/** A number with a few decimals and a proper minus sign. */
function printed(value, decimals = 1) {
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? (0).toFixed(decimals) : text.replace("-", "−");
}

function seconds(t) {
  return `${t.toFixed(3)} s`;
}
