// Players for films: without this script, the last picture stays.
for (const figure of document.querySelectorAll("figure.film")) {
  const sources = JSON.parse(figure.querySelector("script").textContent);
  const pictures = sources.map((data) => {
    const picture = new Image();
    picture.src = "data:image/webp;base64," + data;
    return picture;
  });
  const shown = figure.querySelector("img");
  const canvas = document.createElement("canvas");
  const [play, slider, time] = ["button", "input", "output"].map((name) => figure.querySelector(".controls " + name));
  const seconds = Number(figure.dataset.interval), perSecond = Number(figure.dataset.speed);
  let at = pictures.length - 1, timer = null;
  const show = (number) => {
    at = number;
    slider.value = at;
    time.textContent = Math.round(at * seconds) + " s of " + Math.round((pictures.length - 1) * seconds) + " s";
    const picture = pictures[at];
    const draw = () => { if (picture === pictures[at]) canvas.getContext("2d").drawImage(picture, 0, 0); };
    if (picture.complete) draw(); else picture.onload = draw;
  };
  const stop = () => {
    clearInterval(timer);
    timer = null;
    play.textContent = "▶";
    play.setAttribute("aria-label", "play");
  };
  const start = () => {
    if (at === pictures.length - 1) show(0);
    play.textContent = "⏸";
    play.setAttribute("aria-label", "pause");
    timer = setInterval(() => { if (at + 1 < pictures.length) show(at + 1); else stop(); }, 1000 / perSecond);
  };
  play.onclick = () => { if (timer) stop(); else start(); };
  slider.oninput = () => { stop(); show(Number(slider.value)); };
  slider.max = pictures.length - 1;
  const ready = () => {
    canvas.width = shown.naturalWidth;
    canvas.height = shown.naturalHeight;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", shown.alt);
    shown.replaceWith(canvas);
    figure.querySelector(".controls").hidden = false;
    show(at);
  };
  if (shown.complete) ready(); else shown.onload = ready;
}
