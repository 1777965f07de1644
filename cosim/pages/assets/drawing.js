"use strict";
// Drawings of a part: panels as tabs, layers as traces, and the motion between rest and displaced points.
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const plot = document.getElementById("plot");
  const tabs = document.getElementById("panels");
  const play = document.getElementById("play");
  const size = document.getElementById("size");
  const times = document.getElementById("times");
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const PERIOD = 2000; // of the motion [ms]
  let current = 0;
  let moving = []; // [trace, layer] of the layers that move
  let began = null; // time at which the motion began, null while it stands still

  const colours = () => data.colours[dark.matches ? "dark" : "light"];

  // positions of a layer's points, by axis: rest + share * (points - rest)
  function places(layer, share) {
    if (layer.rest === null) return layer.points;
    return layer.points.map((axis, k) => axis.map((value, i) => layer.rest[k][i] + share * (value - layer.rest[k][i])));
  }

  // coordinates of a trace; lines are separated by gaps
  function coordinates(layer, share) {
    const at = places(layer, share);
    if (layer.cells[0].length !== 2) return at;
    return at.map((axis) => layer.cells.flatMap(([a, b]) => [axis[a], axis[b], null]));
  }

  function trace(layer, panel) {
    const [x, y, z] = coordinates(layer, 1);
    const kind = layer.cells[0].length;
    const colour = colours()[layer.role];
    const unit = panel.unit ? ` ${panel.unit}` : "";
    const where = `${panel.axes[0]} %{x:.4g}${unit}<br>${panel.axes[1]} %{y:.4g}${unit}` +
      (panel.is_flat ? "" : `<br>${panel.axes[2]} %{z:.4g}${unit}`);
    const common = { x, y, z, name: layer.name, showlegend: layer.name !== "", hovertemplate: `${where}<extra>${layer.name}</extra>` };
    if (kind === 3) {
      const [i, j, k] = [0, 1, 2].map((corner) => layer.cells.map((cell) => cell[corner]));
      const paint = layer.values === null
        ? { color: colour, opacity: 0.45 }
        : { intensity: layer.values, colorscale: "Cividis", colorbar: { title: { text: panel.quantity } }, hovertemplate: `${where}<br>%{intensity:.4g}<extra>${panel.quantity}</extra>` };
      const note = layer.notes.length === 1 ? { hovertemplate: `${layer.notes[0]}<br>${where}<extra></extra>` } : {};
      return { type: "mesh3d", ...common, i, j, k, flatshading: true, hoverinfo: "text", ...paint, ...note };
    }
    const notes = layer.notes.length && kind === 2
      ? { text: layer.notes.flatMap((note) => [note, note, ""]), hovertemplate: `%{text}<br>${where}<extra></extra>` }
      : {};
    if (kind === 2) {
      const dash = layer.role === "axis" ? "dashdot" : "solid";
      return { type: "scatter3d", mode: "lines", ...common, line: { color: colour, width: data.widths[layer.role], dash }, ...notes };
    }
    return { type: "scatter3d", mode: "markers", ...common, marker: { color: layer.values === null ? colour : layer.values, size: 5 } };
  }

  // texts beside points
  function labels(layer) {
    const named = layer.texts.map((text, i) => [text, i]).filter(([text]) => text !== "");
    if (!named.length) return [];
    const [x, y, z] = layer.points.map((axis) => named.map(([, i]) => axis[i]));
    return [{ type: "scatter3d", mode: "text", x, y, z, text: named.map(([text]) => text), textposition: "top right", showlegend: false, hoverinfo: "skip" }];
  }

  // axes that hold everything at rest and displaced, so that a motion does not change them
  function scene(panel) {
    const ink = dark.matches ? "#e6e9ee" : "#20242c";
    const paper = "rgba(0,0,0,0)";
    const found = { aspectmode: "manual", dragmode: panel.is_flat ? "pan" : "turntable", camera: panel.is_flat
      ? { eye: { x: 0, y: 0, z: 1.6 }, up: { x: 0, y: 1, z: 0 }, projection: { type: "orthographic" } }
      : { eye: { x: 0.85, y: -1.2, z: 0.62 } } };
    const spans = [0, 1, 2].map((k) => {
      const values = panel.layers.flatMap((layer) => [layer.points[k], ...(layer.rest ? [layer.rest[k]] : [])]).flat();
      return [values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))];
    });
    const largest = Math.max(...spans.map(([low, high]) => high - low)) || 1;
    const aspect = {};
    ["x", "y", "z"].forEach((name, k) => {
      const half = Math.max((spans[k][1] - spans[k][0]) / 2, 0.02 * largest) * 1.15;
      const middle = (spans[k][0] + spans[k][1]) / 2;
      const title = k < panel.axes.length ? `${panel.axes[k]}${panel.unit ? ` (${panel.unit})` : ""}` : "";
      found[`${name}axis`] = { title: { text: title }, range: [middle - half, middle + half], color: ink, showbackground: false, visible: k < panel.axes.length };
      aspect[name] = ((panel.is_flat ? 1.9 : 1.25) * 2 * half) / (largest * 1.15);
    });
    return { scene: { ...found, aspectratio: aspect }, paper_bgcolor: paper, plot_bgcolor: paper, font: { color: ink }, margin: { l: 0, r: 0, t: 0, b: 0 }, legend: { x: 0, y: 1, bgcolor: paper }, uirevision: panel.title };
  }

  function show(place) {
    current = (place + data.panels.length) % data.panels.length;
    const panel = data.panels[current];
    [...tabs.children].forEach((tab, i) => {
      tab.setAttribute("aria-selected", String(i === current));
      tab.tabIndex = i === current ? 0 : -1;
    });
    const traces = panel.layers.map((layer) => trace(layer, panel));
    moving = panel.layers.map((layer, i) => [i, layer]).filter(([, layer]) => layer.rest !== null);
    document.getElementById("controls").hidden = moving.length === 0;
    plot.setAttribute("aria-label", `${document.title}, ${panel.title}`);
    stop();
    return Plotly.react(plot, [...traces, ...panel.layers.flatMap(labels)], scene(panel), { responsive: true, displaylogo: false })
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
