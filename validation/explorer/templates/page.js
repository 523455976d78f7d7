// The page: what is chosen and changed, in the address as well, and what is shown of it.

const LINES = 4000; // over the range shown
const BUDGET = 12; // ms of computation while a slider is dragged, of the 16 between two frames
const BESIDE = [-3e-3, -1e-3, -3e-4, -1e-4, -1e-5, 1e-5, 1e-4, 3e-4, 1e-3, 3e-3]; // of a resonance
const ROUGHLY = [-1e-4, 1e-4]; // while a slider of a large drivetrain is dragged
const APART = 1e-9; // of two lines: repeated modes ask for the same ones
const UNITS = ["m/N", "m/s/N", "m/s²/N"];
const MODELLED = "as modelled";

/** An element of this page, whose kind its id says. @param {string} id @returns {any} */
const $ = (id) => document.getElementById(id);
/** @param {string} id @returns {string} */
const chosen = (id) => $(id).value;

/** @param {string} tag @param {object} [properties] @param {...(Node|string)} children @returns {any} */
function element_(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

/** Digits a person reads. @param {number} value */
function digits(value, most = 5) {
  if (value === 0) return "0";
  const size = Math.abs(value);
  const text = size >= 1e-3 && size < 1e6 ? String(Number(value.toPrecision(most)))
    : value.toExponential(most - 2).replace("e+", "e");
  return text.replace("-", "−");
}

class Page {
  /** @param {any} data @param {Plots} plots */
  constructor(data, plots) {
    this.data = data;
    this.plots = plots;
    this.player = new Player($("drawing"), data.motions);
    /** @type {Map<string, number>} what a slider has changed, by its key */
    this.changed = new Map();
    /** @type {(FrfFile & {which: number})[]} */
    this.files = [];
    this.at = 0; // the cursor, Hz
    this.mode = -1; // whose shape is shown, from 0; -1: a forced one
    /** @type {Assembly} */
    this.assembly = assemble(data.routes[0], this.setting());
    /** @type {NaturalMode[]} */
    this.natural = [];
    /** @type {number[]|undefined} by mode, which mode as modelled moves alike */
    this.alike = undefined;
    this.held = false; // whether there is a curve that the other is held against
    this.frequency = new Float64Array();
    /** @type {Curve} */
    this.shown = { re: this.frequency, im: this.frequency };
    this.lines = LINES;
    /** @type {Map<string, NaturalMode[]>} by route */
    this.known = new Map();
    this.address = "";
    this.waiting = 0;
    fillChoices(this);
    fromAddress(this);
    listen(this);
    this.update();
    this.start();
  }

  /** The shape at the cursor, or the first that strains something. */
  start() {
    this.shape(this.at || this.elastic[0]?.frequency || 1);
  }

  // --- what is set ---------------------------------------------------------------------------

  get route() {
    return this.routeOf(chosen("route"));
  }

  /** @param {string} name @returns {Route} */
  routeOf(name) {
    return this.data.routes.find((/** @type {Route} */ one) => one.name === name);
  }

  /** What is changed of a route: a whole has no couplings and parts to change. @param {Route} route @returns {[string, number][]} */
  changes(route) {
    const keys = new Set(sliders(this.data, route).map(({ key }) => key));
    return [...this.changed].filter(([key]) => keys.has(key));
  }

  /** A route in words, with what is changed of it. @param {Route} route */
  named(route) {
    const { length } = this.changes(route);
    if (length < this.changed.size) return `${route.name}, its couplings and parts as modelled`;
    return length ? `${route.name}, changed` : route.name;
  }

  /** @param {[string, number][]} [changes] @returns {Setting} */
  setting(changes = []) {
    const { alpha, beta } = this.data;
    /** @type {Setting} */
    const setting = { alpha, beta, stiffness: {}, scales: {} };
    for (const [key, value] of changes) {
      const [kind, name] = key.split(/:(.*)/s);
      if (kind === "alpha" || kind === "beta") setting[kind] = value;
      else if (kind === "k") setting.stiffness[name] = value;
      else {
        setting.scales[name] ??= { mass: 1, stiffness: 1 };
        setting.scales[name][/** @type {"mass"|"stiffness"} */ (kind)] = value;
      }
    }
    return setting;
  }

  /** @param {Route} route @param {Setting} setting */
  modes(route, setting) {
    return naturalModes(assemble(route, setting), route.parts.length, this.data.free);
  }

  /** The route's modes as modelled. */
  get modelled() {
    const { name } = this.route;
    if (!this.known.has(name)) this.known.set(name, this.modes(this.route, this.setting()));
    return /** @type {NaturalMode[]} */ (this.known.get(name));
  }

  /** Modes that strain something, below the end of the range. */
  get elastic() {
    return this.natural.slice(this.data.free);
  }

  // --- what is computed ----------------------------------------------------------------------

  /** Lines over the range, more of them beside resonances. @param {NaturalMode[]} modes */
  axis(modes) {
    const [first, last] = this.plots.ends, ratio = Math.log(last / first);
    const grid = Array.from({ length: this.lines }, (_, k) => first * Math.exp((ratio * k) / (this.lines - 1)));
    const beside = this.lines < LINES ? ROUGHLY : BESIDE;
    for (const { frequency } of modes) {
      if (frequency > first && frequency < last) grid.push(...beside.map((one) => frequency * (1 + one)));
    }
    grid.sort((one, other) => one - other);
    /** @type {number[]} */
    const lines = [];
    for (const f of grid) if (!lines.length || f > lines[lines.length - 1] * (1 + APART)) lines.push(f);
    return Float64Array.from(lines);
  }

  /** The pair shown, or another one. @param {Assembly} assembly @param {ArrayLike<number>} frequency @returns {Curve} */
  curve(assembly, frequency, response = chosen("response"), excitation = chosen("excitation")) {
    const found = receptance(assembly, assembly.dof(response), assembly.dof(excitation), frequency);
    return derived(found, frequency, derivatives(chosen("quantity")));
  }

  /** What the curve is held against on some lines; null where nothing is. @param {ArrayLike<number>} frequency */
  other(frequency) {
    const name = chosen("against"), modelled = name === MODELLED;
    if (!name || (modelled && !this.changes(this.route).length)) return null;
    const route = modelled ? this.route : this.routeOf(name);
    return this.curve(assemble(route, this.setting(modelled ? [] : this.changes(route))), frequency);
  }

  /** Compute and draw everything. @param {boolean} [dragged] */
  update(dragged = false) {
    const start = performance.now(), { route, plots } = this;
    const setting = this.setting(this.changes(route));
    this.assembly = assemble(route, setting);
    if (!dragged || this.assembly.omega.length < 80) {
      this.natural = naturalModes(this.assembly, route.parts.length, this.data.free);
    }
    this.frequency = this.axis(this.natural);
    this.shown = this.curve(this.assembly, this.frequency);
    const taken = performance.now() - start;
    this.lines = dragged ? Math.max(400, Math.min(LINES, Math.round((this.lines * BUDGET) / taken))) : LINES;
    const difference = chosen("below") === "difference";
    plots.fill("shown", this.drawn(this.frequency, this.shown, difference ? null : this.shown));
    if (!(dragged && this.held && !difference && chosen("against") === MODELLED)) this.hold(difference);
    this.files.forEach((file, k) => plots.fill(`file${k + 1}`, this.fileDrawn(file, difference)));
    const n = derivatives(chosen("quantity"));
    plots.label("level", `${chosen("quantity")} (${UNITS[n]})`);
    plots.label("below", difference ? "Difference (dB)" : "Phase (°)");
    this.marks();
    this.read();
    if (!dragged) {
      this.legend();
      this.table();
      this.speeds();
      toAddress(this);
    }
    const { dataset } = document.documentElement; // what a benchmark reads
    dataset.step = String(performance.now() - start);
    dataset.lines = String(this.frequency.length);
  }

  /** Draw what the curve is held against; as modelled it stays while a slider moves. @param {boolean} difference */
  hold(difference) {
    const other = this.other(this.frequency);
    this.held = other !== null;
    this.plots.fill("against", other ? this.drawn(this.frequency, other, difference ? this.ratio(this.shown, other) : other) : NOTHING);
  }

  /** Draw once a frame while a slider moves. */
  dragged() {
    cancelAnimationFrame(this.waiting);
    this.waiting = requestAnimationFrame(() => this.update(true));
  }

  /** @param {ArrayLike<number>} f @param {Curve} curve @param {Curve|Float64Array|null} below @returns {Drawn} */
  drawn(f, curve, below) {
    const level = curve.re.map((value, k) => Math.hypot(value, curve.im[k]) || NaN);
    if (below === null) return { f, level, below: level.map(() => NaN) };
    if (below instanceof Float64Array) return { f, level, below };
    return { f, level, below: below.re.map((value, k) => (Math.atan2(below.im[k], value) * 180) / Math.PI) };
  }

  /** 20 lg |a / b|. @param {Curve} a @param {Curve} b */
  ratio(a, b) {
    return a.re.map((value, k) => 20 * Math.log10(Math.hypot(value, a.im[k]) / Math.hypot(b.re[k], b.im[k])));
  }

  /**
   * A file's FRF as the quantity shown, and its difference from the page's FRF of the same pair, on
   * the file's lines; none where the pair is not the model's.
   * @param {FrfFile & {which: number}} file
   * @param {boolean} difference
   */
  fileDrawn({ frfs, which, frequency }, difference) {
    const { curve, quantity, response, excitation } = frfs[which];
    const own = derived(curve, frequency, derivatives(chosen("quantity")) - derivatives(quantity));
    if (!difference) return this.drawn(frequency, own, own);
    if (!this.has(frfs[which])) return this.drawn(frequency, own, null);
    return this.drawn(frequency, own, this.ratio(own, this.curve(this.assembly, frequency, response, excitation)));
  }

  /** Whether a pair is the model's. @param {{response: string, excitation: string}} pair */
  has({ response, excitation }) {
    return this.data.dofs.includes(response) && this.data.dofs.includes(excitation);
  }

  // --- what is shown -------------------------------------------------------------------------

  /** A mode in words: its number, and the kind of the mode as modelled that moves alike. @param {number} number from 0 */
  kind(number) {
    this.alike ??= this.changes(this.route).length ? matched(this.natural, this.modelled) : this.natural.map((_, k) => k);
    const kind = this.data.modes[this.alike[number]]?.kind ?? "", [part, share] = this.most(number);
    return share > 0.9 && this.route.parts.length > 1 ? `${kind}, ${part}` : kind;
  }

  /** The part with most of a mode's kinetic energy, and its share. @param {number} number @returns {[string, number]} */
  most(number) {
    const { shares } = this.natural[number], share = Math.max(...shares);
    return [this.route.parts[shares.indexOf(share)].name, share];
  }

  /** @param {number} number from 0 */
  words(number) {
    return `Mode ${number + 1}: ${digits(this.natural[number].frequency, 6)} Hz, ${this.kind(number)}`;
  }

  marks() {
    this.alike = undefined;
    const [first, last] = this.plots.ends;
    const within = this.natural.map((mode, number) => ({ ...mode, number }))
      .filter(({ frequency }) => frequency > first && frequency < last);
    const f = within.map((mode) => mode.frequency);
    this.plots.fill("marks", {
      f, level: f.map((frequency) => this.level(frequency)),
      number: within.map(({ number }) => String(number + 1)), words: within.map(({ number }) => this.words(number)),
    });
  }

  /** @param {number} frequency */
  nearest(frequency) {
    const f = /** @type {Float64Array} */ (this.frequency);
    let low = 0, high = f.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (f[middle] > frequency) high = middle;
      else low = middle;
    }
    return frequency - f[low] < f[high] - frequency ? low : high;
  }

  /** @param {number} frequency */
  level(frequency) {
    const line = this.nearest(frequency), { re, im } = /** @type {Curve} */ (this.shown);
    return Math.hypot(re[line], im[line]);
  }

  /** The values at the cursor. */
  read() {
    const line = this.nearest(this.at || this.plots.ends[0]), f = this.frequency[line];
    const { re, im } = this.shown, size = Math.hypot(re[line], im[line]);
    const unit = UNITS[derivatives(chosen("quantity"))];
    const words = size === 0 ? "0, nothing passes"
      : `${digits(size, 5)} ${unit} (${digits(20 * Math.log10(size), 5)} dB), ${digits((Math.atan2(im[line], re[line]) * 180) / Math.PI, 4)}°`;
    const lost = re.reduce((count, value) => count + (Number.isFinite(value) ? 0 : 1), 0);
    this.plots.cursor(f);
    $("reading").textContent = `${digits(f, 7)} Hz: ${words}` + (lost ? `. ${lost} lines on undamped poles are left out.` : "");
  }

  legend() {
    const pair = `${chosen("response")} ← ${chosen("excitation")}`, against = chosen("against");
    const entries = [["shown", `${pair}, ${this.named(this.route)}`]];
    if (this.held) entries.push(["against", against === MODELLED ? against : this.named(this.routeOf(against))]);
    this.files.forEach(({ name, frfs, which }, k) => {
      const lacks = this.has(frfs[which]) ? "" : ", not of this model: no difference";
      entries.push([`file${k + 1}`, `${name}: ${frfs[which].response} ← ${frfs[which].excitation}${lacks}`]);
    });
    $("legend").replaceChildren(...entries.map(([key, text]) => {
      const sample = element_("i");
      sample.style.borderColor = this.data.colors[key];
      return element_("span", {}, sample, element_("bdi", { textContent: text }));
    }));
  }

  table() {
    $("resonances").replaceChildren(...this.natural.map(({ frequency }, number) => {
      const go = element_("button", { type: "button", textContent: digits(frequency, 6), title: "Show its shape" });
      go.addEventListener("click", () => this.shape(frequency, number));
      const [part, share] = this.most(number), kind = this.kind(number);
      const before = this.modelled[this.alike?.[number] ?? number].frequency;
      return this.row(["num", String(number + 1)], ["num", go], ["num", digits(before, 6)], ["", kind],
        ["", `${part}: ${Math.round(100 * share)} %`]);
    }));
  }

  /** @param {...[string, Node|string]} cells */
  row(...cells) {
    return element_("tr", {}, ...cells.map(([className, content]) => element_("td", { className }, content)));
  }

  /** Levels and orders over speed, and where they meet. */
  speeds() {
    const { orders } = this.data;
    if (!orders) return;
    const { range: [first, last], lines } = orders;
    const top = Math.max(...lines.map((/** @type {{slope: number}} */ one) => one.slope)) * last;
    const modes = this.natural.map(({ frequency }, number) => ({ frequency, number })).filter(({ frequency }) => frequency > 0 && frequency < 1.25 * top);
    this.plots.fill("levels", { x: modes.map(() => [first, last]), y: modes.map((one) => [one.frequency, one.frequency]), words: modes.map(({ number }) => this.words(number)) });
    this.plots.fill("orders", { x: lines.map(() => [first, last]), y: lines.map((/** @type {{slope: number}} */ one) => [one.slope * first, one.slope * last]), words: lines.map((/** @type {{name: string}} */ one) => one.name) });
    const met = lines.flatMap((/** @type {{name: string, slope: number}} */ { name, slope }) => modes
      .map(({ frequency, number }) => ({ name, frequency, number, speed: frequency / slope })))
      .filter((/** @type {{speed: number}} */ { speed }) => speed >= first && speed <= last);
    met.sort((/** @type {{speed: number}} */ a, /** @type {{speed: number}} */ b) => a.speed - b.speed);
    $("crossings").replaceChildren(...met.map((/** @type {any} */ one) => this.row(["", one.name], ["num", digits(one.speed, 5)], ["num", digits(one.frequency, 6)], ["", `${one.number + 1}, ${this.kind(one.number)}`])));
  }

  /** Move the cursor, and the drawing: a mode's shape, or what the excitation forces. @param {number} frequency @param {number} [number] of a mode */
  shape(frequency, number = this.resonanceAt(frequency)) {
    const assembly = /** @type {Assembly} */ (this.assembly), { dofs } = this.data.motions;
    this.at = number >= 0 ? this.natural[number].frequency : frequency;
    this.mode = number;
    const mode = this.natural[number]?.shape;
    const shape = mode
      ? { re: Float64Array.from(dofs, (label) => motionOf(assembly.dof(label), mode)), im: new Float64Array(dofs.length) }
      : forcedShape(assembly, dofs, chosen("excitation"), frequency);
    this.player.show(shape);
    $("shape").textContent = mode ? this.words(number) : `Forced at ${digits(frequency, 6)} Hz by ${chosen("excitation")}`;
    [...$("resonances").children].forEach((row, k) => row.classList.toggle("here", k === number));
    this.read();
    toAddress(this);
  }

  /** The same shape of what has changed: of the mode, wherever it is now, or at the frequency. */
  follow() {
    if (this.mode >= 0) this.shape(this.natural[this.mode].frequency, this.mode);
    else this.shape(this.at);
  }

  /** The mode whose mark a pointer at a frequency means: within a hundredth of the range shown. @param {number} frequency */
  resonanceAt(frequency) {
    const [first, last] = this.plots.ends, reach = Math.log(last / first) / 100;
    let best = -1, least = reach;
    this.natural.forEach((mode, number) => {
      const away = Math.abs(Math.log(mode.frequency / frequency));
      if (away < least) [best, least] = [number, away];
    });
    return best;
  }
}
