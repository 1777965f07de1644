"use strict";
// A run: bodies that move, and signals, under one cursor in time.
(() => {
  const { data, dark, ink, lines, traces, scene, bar } = hfsa;
  const [plot, signals] = ["plot", "signals"].map((id) => document.getElementById(id));
  const [tabs, play, time, now, size, times] = ["panels", "play", "time", "now", "size", "times"]
    .map((id) => document.getElementById(id));
  const LENGTH = 12000; // of the whole run as it plays [ms]
  const last = data.time.length - 1;
  let body = 0;
  let frame = 0;
  let began = null; // [time of the page, frame] at which it began to play

  const units = [...new Set(data.signals.map((signal) => signal.unit))];
  const factor = () => data.bodies[body].times * 10 ** Number(size.value);

  // coordinates of the layers that move, in a frame
  function moved() {
    const found = [];
    data.bodies[body].shifts.forEach((shift, i) => {
      if (shift === null) return;
      const layer = data.bodies[body].panel.layers[i];
      found.push([i, lines(layer, layer.points.map((axis, k) => axis.map((value, j) => value + factor() * shift[frame][k][j])))]);
    });
    return found;
  }

  function show(to) {
    frame = Math.max(0, Math.min(last, to));
    time.value = frame;
    now.value = `${data.time[frame].toPrecision(5)} s`;
    const jobs = [Plotly.relayout(signals, { shapes: [cursor()] })];
    if (data.bodies.length) {
      times.value = String(Number(factor().toPrecision(3)));
      const at = moved();
      jobs.push(Plotly.restyle(plot, { x: at.map(([, a]) => a[0]), y: at.map(([, a]) => a[1]), z: at.map(([, a]) => a[2]) }, at.map(([i]) => i)));
    }
    return Promise.all(jobs);
  }

  const cursor = () => ({ type: "line", xref: "x", yref: "paper", x0: data.time[frame], x1: data.time[frame], y0: 0, y1: 1, line: { color: ink(), width: 1.5 } });

  function choose(place) {
    body = (place + data.bodies.length) % data.bodies.length;
    [...tabs.children].forEach((tab, i) => tab.setAttribute("aria-selected", String(i === body)));
    const panel = data.bodies[body].panel;
    plot.setAttribute("aria-label", `${document.title}, ${data.bodies[body].name}`);
    return Plotly.react(plot, traces(panel), scene(panel), { responsive: true, displaylogo: false }).then(() => show(frame));
  }

  function curves() {
    const paper = "rgba(0,0,0,0)";
    const layout = { paper_bgcolor: paper, plot_bgcolor: paper, font: { color: ink() }, height: 190 * units.length + 85, margin: { l: 70, r: 10, t: 35, b: 40 }, modebar: bar("h"), hovermode: "x", xaxis: { title: { text: "Time (s)" }, gridcolor: "rgba(128,128,128,.25)", anchor: `y${units.length > 1 ? units.length : ""}` }, shapes: [cursor()] };
    units.forEach((unit, i) => {
      const high = 1 - i / units.length;
      layout[`yaxis${i ? i + 1 : ""}`] = { title: { text: unit === "1" ? "" : `(${unit})` }, domain: [high - 0.9 / units.length, high], gridcolor: "rgba(128,128,128,.25)" };
    });
    const drawn = data.signals.map(({ name, unit, t, y }) => ({ type: "scattergl", mode: "lines", name, x: t, y, yaxis: `y${units.indexOf(unit) ? units.indexOf(unit) + 1 : ""}`, hovertemplate: `%{y:.5g} ${unit === "1" ? "" : unit}` }));
    return Plotly.react(signals, drawn, layout, { responsive: true, displaylogo: false });
  }

  function nearest(t) {
    let best = 0;
    data.time.forEach((value, i) => { if (Math.abs(value - t) < Math.abs(data.time[best] - t)) best = i; });
    return best;
  }

  function step(at) {
    if (began === null) return;
    if (began[0] === 0) began[0] = at;
    const to = began[1] + Math.round(((at - began[0]) / LENGTH) * last);
    if (to > last) { began = [at, 0]; }
    show(Math.min(to, last)).then(() => requestAnimationFrame(step));
  }

  function toggle() {
    began = began === null ? [0, frame === last ? 0 : frame] : null;
    play.textContent = began === null ? "Play" : "Pause";
    play.setAttribute("aria-pressed", String(began !== null));
    if (began !== null) requestAnimationFrame(step);
  }

  function pause() {
    if (began !== null) toggle();
  }

  time.max = last;
  data.bodies.forEach((found, i) => {
    const tab = document.createElement("button");
    tab.type = "button";
    tab.setAttribute("role", "tab");
    tab.textContent = found.name;
    tab.addEventListener("click", () => choose(i));
    tabs.append(tab);
  });
  tabs.hidden = data.bodies.length < 2;
  plot.hidden = data.bodies.length === 0;
  size.parentElement.hidden = data.bodies.length === 0;
  play.addEventListener("click", toggle);
  time.addEventListener("input", () => { pause(); show(Number(time.value)); });
  size.addEventListener("input", () => show(frame));
  document.addEventListener("keydown", (event) => {
    if (event.target.tagName === "INPUT" || event.ctrlKey || event.metaKey || event.altKey) return;
    const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (by) { pause(); show(frame + by); }
    else if (event.key === " " && event.target.tagName !== "BUTTON") { event.preventDefault(); toggle(); }
  });
  dark.addEventListener("change", () => { curves(); if (data.bodies.length) choose(body); });
  curves().then(() => {
    signals.on("plotly_click", (event) => { pause(); show(nearest(event.points[0].x)); });
    return data.bodies.length ? choose(0) : show(0);
  });
})();
