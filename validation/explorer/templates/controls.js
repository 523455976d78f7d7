// What is chosen, dragged, typed, dropped and saved; and the view in the address.

const CHOICES = ["response", "excitation", "quantity", "route", "against", "below"];

/**
 * @typedef {{key: string, label: string, unit: string, base: number, decades: number,
 *   zero: boolean}} Slider
 * Its value is base · 10^position, |position| ≤ decades; where `zero`, its left end is 0.
 */

/** @param {HTMLSelectElement} select @param {[string, string][]} options value, text */
function offer(select, options) {
  const before = select.value;
  select.replaceChildren(...options.map(([value, textContent]) => element_("option", { value, textContent })));
  if (options.some(([value]) => value === before)) select.value = before;
}

/** Fill the choices that are the same for all routes. @param {Page} page */
function fillChoices(page) {
  const { data } = page;
  /** @param {string[]} names @returns {[string, string][]} */
  const plain = (names) => names.map((name) => [name, name]);
  offer($("response"), plain(data.dofs));
  offer($("excitation"), plain(data.dofs));
  offer($("quantity"), plain(QUANTITIES));
  const routes = data.routes.map((/** @type {Route} */ one) => one.name);
  offer($("route"), plain(routes));
  offer($("against"), [["", "nothing"], ...plain([MODELLED, ...routes])]);
  $("response").value = data.response;
  $("excitation").value = data.excitation;
  $("against").value = MODELLED;
}

/** The sliders of a route. @param {any} data @param {Route} route @returns {Slider[]} */
function sliders(data, route) {
  /** @type {Slider[]} */
  const found = route.joints.filter((/** @type {Joint} */ joint) => joint.stiffness)
    .map((/** @type {Joint} */ { name, stiffness }) => ({ key: `k:${name}`, label: name, unit: "N/m", base: stiffness, decades: 3, zero: false }));
  found.push({ key: "beta", label: "damping β (c = β k)", unit: "s", base: data.beta || 1e-6, decades: 3, zero: true });
  found.push({ key: "alpha", label: "damping α (c = α m)", unit: "1/s", base: data.alpha || 1, decades: 3, zero: true });
  if (route.parts.length > 1) {
    for (const { name, omega, rigid } of route.parts) {
      if (omega.length > rigid) found.push({ key: `stiffness:${name}`, label: `${name}: stiffness ×`, unit: "", base: 1, decades: 1, zero: false });
      found.push({ key: `mass:${name}`, label: `${name}: mass ×`, unit: "", base: 1, decades: 1, zero: false });
    }
  }
  return found;
}

/** Whether a slider reaches a value, as the address has it. @param {Slider|undefined} slider @param {string} text */
function reaches(slider, text) {
  const value = text.trim() ? Number(text) : NaN;
  if (!slider || value === 0) return Boolean(slider?.zero) && value === 0;
  return Math.abs(Math.log10(value / slider.base)) <= slider.decades + 1e-5; // 6 digits
}

/** Lay the sliders of a route out. @param {Page} page */
function fillSliders(page) {
  $("sliders-note").textContent = page.route.joints.length
    ? "A part’s factors replace it by one as stiff and heavy as that."
    : "The whole at once: couplings and parts are changed by a route of FBS.";
  $("sliders-of").replaceChildren(...sliders(page.data, page.route).map((slider) => {
    const { key, label, unit, base, decades, zero } = slider, id = `slider-${key}`;
    const input = element_("input", { type: "range", id, min: -decades, max: decades, step: 0.005 });
    const output = element_("output", { htmlFor: id });
    const box = element_("div", { className: "slider" }, element_("label", { htmlFor: id, textContent: label }), output, input);
    const show = () => {
      const modelled = key in page.data ? page.data[key] : base, value = page.changed.get(key) ?? modelled;
      box.classList.toggle("moved", page.changed.has(key));
      output.textContent = `${digits(value, 4)} ${unit}`;
      input.setAttribute("aria-valuetext", output.textContent);
      return value;
    };
    const value = show();
    input.value = String(value > 0 ? Math.log10(value / base) : -decades);
    const set = () => {
      const position = Number(input.value);
      page.changed.set(key, zero && position <= -decades ? 0 : base * 10 ** position);
      show();
    };
    input.addEventListener("input", () => {
      set();
      page.dragged();
    });
    input.addEventListener("change", () => {
      page.update();
      page.follow();
    });
    return box;
  }));
}

/** Listen to everything. @param {Page} page */
function listen(page) {
  const { plots } = page;
  for (const id of CHOICES) {
    $(id).addEventListener("change", () => {
      if (id === "route") fillSliders(page);
      if (id === "response" || id === "excitation") matchFiles(page);
      page.update();
      page.shape(page.at);
    });
  }
  for (const id of ["from", "to"]) {
    $(id).addEventListener("change", () => {
      plots.zoom(Number(chosen("from")), Number(chosen("to")));
      toAddress(page); // which shows the range again where there is none such
    });
  }
  plots.onRange = () => page.update();
  plots.onTap((frequency) => page.shape(frequency));
  $("all").addEventListener("click", () => plots.all(page.data.band));
  $("reset").addEventListener("click", () => {
    page.changed.clear();
    fillSliders(page);
    page.update();
    page.follow();
  });
  $("play").addEventListener("click", () => hold(page, page.player.playing));
  hold(page, !page.player.playing);
  $("frf").addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => key(page, event));
  for (const type of ["png", "svg"]) {
    $(type).addEventListener("click", async () => save(`${fileName(page)}.${type}`, await plots.picture(/** @type {"png"|"svg"} */ (type))));
  }
  $("csv").addEventListener("click", () => save(`${fileName(page)}.csv`, new Blob([csv(page)], { type: "text/csv" })));
  $("files").addEventListener("change", (/** @type {any} */ event) => take(page, event.target.files));
  document.addEventListener("dragover", (event) => {
    event.preventDefault();
    $("drop").classList.add("over");
  });
  document.addEventListener("dragleave", () => $("drop").classList.remove("over"));
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    $("drop").classList.remove("over");
    take(page, event.dataTransfer?.files ?? []);
  });
  addEventListener("hashchange", () => {
    if (location.hash === page.address) return;
    fromAddress(page);
    matchFiles(page);
    page.update();
    page.start();
  });
}

/** @param {Page} page @param {boolean} held */
function hold(page, held) {
  page.player.play(!held);
  $("play").setAttribute("aria-pressed", String(held));
}

/** @param {Page} page @param {KeyboardEvent} event */
function key(page, event) {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const [first, last] = page.plots.ends, step = event.shiftKey ? 50 : 5;
  const line = page.nearest(page.at), f = page.frequency;
  /** @param {number} to */
  const move = (to) => { page.at = f[Math.max(0, Math.min(f.length - 1, to))]; };
  /** @param {number} factor */
  const zoom = (factor) => {
    const centre = Math.log(page.at), reach = (Math.log(last / first) * factor) / 2;
    page.plots.zoom(Math.exp(centre - reach), Math.exp(centre + reach));
  };
  const above = page.natural.find(({ frequency }) => frequency > page.at * (1 + 1e-7));
  const below = page.natural.findLast(({ frequency }) => frequency > 0 && frequency < page.at * (1 - 1e-7));
  /** @type {Object<string, () => void>} */
  const acts = {
    ArrowLeft: () => move(line - step),
    ArrowRight: () => move(line + step),
    Home: () => move(0),
    End: () => move(f.length - 1),
    PageUp: () => above && page.shape(above.frequency),
    PageDown: () => below && page.shape(below.frequency),
    Enter: () => page.shape(page.at),
    "+": () => zoom(0.5),
    "-": () => zoom(2),
    0: () => page.plots.all(page.data.band),
  };
  const act = acts[event.key];
  if (!act) return;
  event.preventDefault();
  act();
  page.read();
  toAddress(page);
}

// --- files ---------------------------------------------------------------------------------------

/** @param {Page} page @param {Iterable<File>} files */
async function take(page, files) {
  const problems = [];
  for (const file of files) {
    try {
      const read = await readFrfs(file);
      page.files = [...page.files, { ...read, which: shownIn(read) ?? 0 }].slice(-2);
    } catch (error) {
      problems.push(`${file.name}: ${error instanceof Error ? error.message : error}`);
    }
  }
  listFiles(page, problems);
  page.update();
}

/** Which FRF of a file is the pair shown. @param {FrfFile} file */
function shownIn({ frfs }) {
  const pair = frfs.findIndex(({ response, excitation }) => response === chosen("response") && excitation === chosen("excitation"));
  return pair < 0 ? undefined : pair;
}

/** Take the pair shown of every file that has it. @param {Page} page */
function matchFiles(page) {
  for (const file of page.files) file.which = shownIn(file) ?? file.which;
  if (page.files.length) listFiles(page, []);
}

/** @param {Page} page @param {string[]} problems */
function listFiles(page, problems) {
  const items = page.files.map((file, number) => {
    const select = element_("select", { ariaLabel: `FRF of ${file.name}` });
    offer(select, file.frfs.map(({ response, excitation, quantity }, k) => [String(k), `${response} ← ${excitation} (${quantity})`]));
    select.value = String(file.which);
    select.addEventListener("change", () => {
      file.which = Number(select.value);
      page.update();
    });
    const drop = element_("button", { type: "button", textContent: "Remove", ariaLabel: `Remove ${file.name}` });
    drop.addEventListener("click", () => {
      page.plots.fill(`file${page.files.length}`, NOTHING);
      page.files.splice(number, 1);
      listFiles(page, []);
      page.update();
    });
    return element_("li", {}, element_("bdi", { textContent: file.name }), `: ${file.frequency.length} lines `, select, " ", drop);
  });
  const refused = problems.map((textContent) => element_("li", { className: "problem", textContent, dir: "auto" }));
  $("loaded").replaceChildren(...items, ...refused);
}

/** The curve, and what it is held against, as crosscheck's own CSV. @param {Page} page */
function csv(page) {
  const quantity = chosen("quantity"), unit = ["m/N", "m/s/N", "m/s^2/N"][derivatives(quantity)];
  const other = page.other(page.frequency);
  /** @type {[string, Curve][]} */
  const curves = [[chosen("response"), page.shown]];
  if (other) curves.push([`${chosen("response")} ${chosen("against")}`, other]);
  const names = ["frequency_hz", ...curves.flatMap(([response]) => ["re", "im"].map((part) => `${part} ${quantity} ${response} <- ${chosen("excitation")} (${unit})`))];
  const rows = Array.from(page.frequency, (f, line) => [f, ...curves.flatMap(([, { re, im }]) => [re[line], im[line]])])
    .filter((row) => row.every(Number.isFinite));
  return `${[names, ...rows].map((row) => row.join(",")).join("\n")}\n`;
}

/** @param {Page} page */
function fileName(page) {
  return `${chosen("response")}_${chosen("excitation")}_${chosen("quantity")}`;
}

/** @param {string} name @param {Blob} content */
function save(name, content) {
  const address = URL.createObjectURL(content);
  element_("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 1e4);
}

// --- the address ---------------------------------------------------------------------------------

/** @param {Page} page */
function toAddress(page) {
  const state = new URLSearchParams(CHOICES.map((id) => [id, chosen(id)]));
  const [from, to] = page.plots.ends;
  $("from").value = digits(from, 5);
  $("to").value = digits(to, 5);
  state.set("from", String(Number(from.toPrecision(9))));
  state.set("to", String(Number(to.toPrecision(9))));
  if (page.at) state.set("at", page.at.toPrecision(9));
  for (const [name, value] of page.changed) state.set(`set.${name}`, value.toPrecision(6));
  page.address = `#${state}`;
  history.replaceState(null, "", page.address);
}

/** Take what the address says, where it can be. @param {Page} page */
function fromAddress(page) {
  const state = new URLSearchParams(location.hash.slice(1));
  for (const id of CHOICES) {
    const value = state.get(id), select = /** @type {HTMLSelectElement} */ ($(id));
    if ([...select.options].some((option) => option.value === value)) select.value = String(value);
  }
  const known = new Map(sliders(page.data, page.route).map((slider) => [slider.key, slider]));
  page.changed = new Map();
  for (const [name, text] of state) {
    const key = name.replace(/^set\./, "");
    if (name.startsWith("set.") && reaches(known.get(key), text)) page.changed.set(key, Number(text));
  }
  fillSliders(page);
  const at = Number(state.get("at")), [first, last] = page.plots.ends;
  page.at = at >= LOWEST && at <= HIGHEST ? at : 0;
  page.plots.zoom(Number(state.get("from") ?? first), Number(state.get("to") ?? last));
}
