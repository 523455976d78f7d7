// Start: the data that the page carries, the plots, and the page.
const data = JSON.parse($("data").textContent ?? "");
const page = new Page(data, await Plots.embedded(data.figures));
document.documentElement.dataset.ready = String(performance.now());
