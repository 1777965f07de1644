"use strict";
// Figures and machines of a report, each in the place that the page leaves for it.
(() => {
  const { data, dark, traces, scene } = hfsa;

  function layout(own) {
    const ink = hfsa.ink();
    const grid = dark.matches ? "#3a404b" : "#dfe3e8";
    const paper = "rgba(0,0,0,0)";
    const found = { paper_bgcolor: paper, plot_bgcolor: paper, font: { color: ink }, margin: { l: 70, r: 20, t: 10, b: 50 }, legend: { orientation: "h", y: 1.02, yanchor: "bottom" } };
    Object.entries(own).forEach(([name, value]) => {
      found[name] = /^[xy]axis/.test(name) ? { gridcolor: grid, zerolinecolor: grid, ...value } : value;
    });
    found.shapes = (own.shapes || []).map((shape) => ({ line: { color: ink, width: 1, dash: "dash" }, ...shape }));
    return found;
  }

  const looks = { responsive: true, displaylogo: false };

  function draw() {
    data.plots.forEach((plot, i) => Plotly.react(`plot${i}`, plot.traces, layout(plot.layout), looks));
    data.machines.forEach((panel, i) => Plotly.react(`machine${i}`, traces(panel), scene(panel), looks));
  }

  dark.addEventListener("change", draw);
  draw();
})();
