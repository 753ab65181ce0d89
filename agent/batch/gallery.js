// Filters of the rows: without this script, every row is shown.
const filters = document.querySelector(".filters");
const rows = [...document.querySelectorAll(".rows > li")].map((card) => ({
  card,
  outcome: card.dataset.outcome,
  structures: card.dataset.structures.split(" "),
  words: card.textContent.toLowerCase(),
}));
const buttons = [...filters.querySelectorAll("button")];
const structure = filters.querySelector("select"), search = filters.querySelector("input");
const count = filters.querySelector("output");
let outcome = "";
const show = () => {
  const wanted = search.value.toLowerCase().split(/\s+/).filter(Boolean);
  let shown = 0;
  for (const row of rows) {
    const fits = (!outcome || row.outcome === outcome)
      && (!structure.value || row.structures.includes(structure.value))
      && wanted.every((word) => row.words.includes(word));
    row.card.hidden = !fits;
    shown += fits;
  }
  count.textContent = shown === rows.length ? "all rows" : shown + " of " + rows.length + " rows";
};
for (const button of buttons) {
  button.onclick = () => {
    outcome = button.value;
    for (const each of buttons) each.setAttribute("aria-pressed", String(each === button));
    show();
  };
}
structure.onchange = show;
search.oninput = show;
filters.hidden = false;
show(); // a browser may have kept what was typed before the page was loaded again
