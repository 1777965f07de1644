"use strict";
// Drawings of a part: panels as tabs, and the motion between rest and displaced points.
(() => {
  const { data, dark, coordinates, traces, scene } = hfsa;
  const plot = document.getElementById("plot");
  const tabs = document.getElementById("panels");
  const play = document.getElementById("play");
  const size = document.getElementById("size");
  const times = document.getElementById("times");
  const PERIOD = 2000; // of the motion [ms]
  let current = 0;
  let moving = []; // [trace, layer] of the layers that move
  let began = null; // time at which the motion began, null while it stands still

  function show(place) {
    current = (place + data.panels.length) % data.panels.length;
    const panel = data.panels[current];
    [...tabs.children].forEach((tab, i) => {
      tab.setAttribute("aria-selected", String(i === current));
      tab.tabIndex = i === current ? 0 : -1;
    });
    moving = panel.layers.map((layer, i) => [i, layer]).filter(([, layer]) => layer.rest !== null);
    document.getElementById("controls").hidden = moving.length === 0;
    plot.setAttribute("aria-label", `${document.title}, ${panel.title}`);
    stop();
    return Plotly.react(plot, traces(panel), scene(panel), { responsive: true, displaylogo: false })
      .then(() => move(Number(size.value)));
  }

  function move(share) {
    if (!moving.length) return Promise.resolve();
    const at = moving.map(([, layer]) => coordinates(layer, share));
    return Plotly.restyle(plot, { x: at.map((a) => a[0]), y: at.map((a) => a[1]), z: at.map((a) => a[2]) }, moving.map(([i]) => i));
  }

  function frame(now) {
    if (began === null) return;
    if (began === 0) began = now;
    move(Number(size.value) * Math.sin((2 * Math.PI * (now - began)) / PERIOD)).then(() => requestAnimationFrame(frame));
  }

  function stop() {
    began = null;
    play.textContent = "Play";
    play.setAttribute("aria-pressed", "false");
  }

  function toggle() {
    if (!moving.length) return;
    if (began !== null) {
      stop();
      move(Number(size.value));
      return;
    }
    began = 0;
    play.textContent = "Pause";
    play.setAttribute("aria-pressed", "true");
    requestAnimationFrame(frame);
  }

  data.panels.forEach((panel, i) => {
    const tab = document.createElement("button");
    tab.type = "button";
    tab.setAttribute("role", "tab");
    tab.textContent = panel.title;
    tab.addEventListener("click", () => show(i));
    tabs.append(tab);
  });
  tabs.hidden = data.panels.length < 2;
  play.addEventListener("click", toggle);
  size.addEventListener("input", () => {
    times.value = Number(size.value).toFixed(2);
    if (began === null) move(Number(size.value));
  });
  document.addEventListener("keydown", (event) => {
    if (event.target === size || event.ctrlKey || event.metaKey || event.altKey) return;
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (step) {
      show(current + step);
      tabs.children[current].focus();
    } else if (event.key === " " && event.target.tagName !== "BUTTON") {
      event.preventDefault();
      toggle();
    }
  });
  dark.addEventListener("change", () => show(current));
  show(0);
})();
