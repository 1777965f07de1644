"use strict";
// Panels of drawings: their layers as traces of plotly, and the axes that hold them.
const hfsa = (() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const ink = () => (dark.matches ? "#e6e9ee" : "#20242c");
  const colours = () => data.colours[dark.matches ? "dark" : "light"];
  // positions of a layer's points, by axis: rest + share * (points - rest)
  function places(layer, share) {
    if (layer.rest === null) return layer.points;
    return layer.points.map((axis, k) => axis.map((value, i) => layer.rest[k][i] + share * (value - layer.rest[k][i])));
  }

  // coordinates of a trace from those of a layer's points; lines are separated by gaps
  function lines(layer, at) {
    if (layer.cells[0].length !== 2) return at;
    return at.map((axis) => layer.cells.flatMap(([a, b]) => [axis[a], axis[b], null]));
  }

  const coordinates = (layer, share) => lines(layer, places(layer, share));

  const scale = (panel) => ({ colorscale: "Cividis", colorbar: { title: { text: panel.quantity, side: "right" }, len: 0.9, y: 0.47 } });

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
        : { intensity: layer.values, ...scale(panel), hovertemplate: `${where}<br>%{intensity:.4g}<extra>${panel.quantity}</extra>` };
      const note = layer.notes.length === 1 ? { hovertemplate: `${layer.notes[0]}<br>${where}<extra></extra>` } : {};
      return { type: "mesh3d", ...common, i, j, k, flatshading: true, hoverinfo: "text", ...paint, ...note };
    }
    const texts = kind === 2 ? layer.notes.flatMap((note) => [note, note, ""]) : layer.notes;
    const notes = texts.length ? { text: texts, hovertemplate: `%{text}<br>${where}<extra></extra>` } : {};
    if (kind === 2) {
      const dash = layer.role === "axis" ? "dashdot" : "solid";
      return { type: "scatter3d", mode: "lines", ...common, line: { color: colour, width: data.widths[layer.role], dash }, ...notes };
    }
    const marker = layer.values === null
      ? { color: colour, size: 5 }
      : { color: layer.values, size: 10, ...scale(panel) };
    return { type: "scatter3d", mode: "markers", ...common, marker, ...notes };
  }

  // texts beside points
  function labels(layer) {
    const named = layer.texts.map((text, i) => [text, i]).filter(([text]) => text !== "");
    if (!named.length) return [];
    const [x, y, z] = layer.points.map((axis) => named.map(([, i]) => axis[i]));
    return [{ type: "scatter3d", mode: "text", x, y, z, text: named.map(([text]) => text), textposition: "top right", showlegend: false, hoverinfo: "skip" }];
  }

  // place from which a box of these sides, with the numbers along its edges, is seen whole
  function eye({ x, y, z }) {
    const [e, right, up] = [[0.533, -0.753, 0.386], [0.816, 0.578, 0], [-0.223, 0.315, 0.923]];
    const tangent = Math.tan(Math.PI / 8); // of half the height of the view
    const along = (one, other) => one.reduce((sum, value, i) => sum + value * other[i], 0);
    const corners = [-1, 1].flatMap((a) => [-1, 1].flatMap((b) => [-1, 1].map((c) => [a * x / 2, b * y / 2, c * z / 2])));
    const distances = corners.map((at) => along(at, e) + Math.max(Math.abs(along(at, right)) / 1.3, Math.abs(along(at, up))) / (0.86 * tangent));
    const far = Math.max(...distances);
    return { x: far * e[0], y: far * e[1], z: far * e[2] };
  }

  // buttons of a figure, without a ground of their own
  const bar = (orientation) => ({ orientation, bgcolor: "rgba(0,0,0,0)", color: dark.matches ? "#8b93a1" : "#7a828f", activecolor: ink() });

  // axes that hold everything at rest and displaced, so that a motion does not change them
  function scene(panel) {
    const paper = "rgba(0,0,0,0)";
    const found = { aspectmode: "manual", dragmode: panel.is_flat ? "pan" : "turntable" };
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
      found[`${name}axis`] = { title: { text: title }, range: [middle - half, middle + half], color: ink(), gridcolor: dark.matches ? "#3a404b" : "#dfe3e8", showbackground: false, visible: k < panel.axes.length, ...(panel.is_flat ? { tickangle: 0 } : {}) };
      aspect[name] = ((panel.is_flat ? 1.6 : 1.25) * 2 * half) / (largest * 1.15);
    });
    const camera = panel.is_flat
      ? { eye: { x: 0, y: 0, z: 1.6 }, up: { x: 0, y: 1, z: 0 }, projection: { type: "orthographic" } }
      : { eye: eye(aspect) };
    return { modebar: bar("v"), scene: { ...found, camera, aspectratio: aspect }, paper_bgcolor: paper, plot_bgcolor: paper, font: { color: ink() }, margin: { l: 0, r: 0, t: 0, b: 0 }, legend: { x: 0, y: 1, bgcolor: paper }, uirevision: panel.title };
  }

  // the traces of a panel: its layers in their order, then their texts
  function traces(panel) {
    return [...panel.layers.map((layer) => trace(layer, panel)), ...panel.layers.flatMap(labels)];
  }

  return { data, dark, ink, places, lines, coordinates, traces, scene, bar };
})();
