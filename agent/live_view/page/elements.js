// Elements of the page. Whatever comes from the agent is set as text, never as HTML.

export const at = (id) => document.getElementById(id);

// A new element with a class, and texts or elements in it.
export function element(name, className, ...content) {
  const made = document.createElement(name);
  if (className) made.className = className;
  made.append(...content);
  return made;
}

export function button(label, press, className = "") {
  const made = element("button", className, label);
  made.type = "button";
  made.addEventListener("click", press);
  return made;
}

// Lets a button show and hide something.
export function toggle(id, show) {
  at(id).addEventListener("click", () => {
    const shown = at(id).getAttribute("aria-pressed") !== "true";
    at(id).setAttribute("aria-pressed", String(shown));
    show(shown);
  });
}
