// What the page asks of Bokeh: fill sources, read and set the frequency range, and pictures of it.

/** @typedef {{f: ArrayLike<number>, level: ArrayLike<number>, below: ArrayLike<number>}} Drawn */

const { Bokeh } = /** @type {any} */ (globalThis);
const NOTHING = { f: [], level: [], below: [] };
const TICK = 40; // ms between two sets of lines while the range is dragged
const LOWEST = 1e-3, HIGHEST = 1e9; // Hz that can be shown

class Plots {
  /** @param {Object<string, object>} figures as Bokeh wrote them, by the id of their element */
  static async embedded(figures) {
    for (const [id, item] of Object.entries(figures)) {
      await Bokeh.embed.embed_item(item, document.getElementById(id));
    }
    return new Plots();
  }

  constructor() {
    /** @param {string} name */
    this.model = (name) => Bokeh.documents.map((/** @type {any} */ one) => one.get_model_by_name(name)).find(Boolean);
    this.range = this.model("frequency");
    /** @type {() => void} */
    this.onRange = () => {};
    let waiting = 0;
    const changed = () => {
      clearTimeout(waiting);
      waiting = setTimeout(() => this.onRange(), TICK);
    };
    this.range.properties.start.change.connect(changed);
    this.range.properties.end.change.connect(changed);
    this.fit();
    addEventListener("resize", () => this.fit());
  }

  /** Heights and letters as large as the window has room for. */
  fit() {
    const letter = `${0.87 * parseFloat(getComputedStyle(document.documentElement).fontSize)}px`;
    const most = Math.max(240, 0.4 * innerHeight);
    for (const name of ["level", "below", "campbell"]) {
      const figure = this.model(name);
      if (!figure) continue;
      figure.height = Math.round(name === "below" ? 0.65 * most : most);
      for (const { glyph } of figure.renderers) if (glyph.text) glyph.text_font_size = { value: letter };
      for (const axis of [...figure.left, ...figure.below]) {
        axis.setv({ axis_label_text_font_size: letter, major_label_text_font_size: letter });
      }
    }
  }

  /** @param {string} name @param {object} columns */
  fill(name, columns) {
    const source = this.model(name);
    if (source) source.data = columns;
  }

  /** @param {string} figure @param {string} words */
  label(figure, words) {
    this.model(figure).left[0].axis_label = words;
  }

  /** @param {number} frequency */
  cursor(frequency) {
    for (const figure of ["level", "below"]) this.model(`cursor-${figure}`).location = frequency;
  }

  get ends() {
    const start = Math.min(Math.max(this.range.start, LOWEST), 0.9 * HIGHEST);
    return [start, Math.max(Math.min(this.range.end, HIGHEST), start * (1 + 1e-6))];
  }

  /** @param {number} start @param {number} end */
  zoom(start, end) {
    if (start >= LOWEST && end <= HIGHEST && end > start * (1 + 1e-6)) this.range.setv({ start, end });
  }

  /** Everything over a band, whatever was zoomed to. @param {[number, number]} band */
  all([start, end]) {
    for (const figure of ["level", "below"]) this.model(figure).y_range.reset();
    this.zoom(start, end);
  }

  /** What a click or touch on a figure points at (Hz). @param {(frequency: number) => void} act */
  onTap(act) {
    for (const figure of ["level", "below"]) {
      this.model(figure).on_event("tap", (/** @type {{x: number}} */ event) => act(event.x));
    }
  }

  /** @param {"png"|"svg"} type @returns {Promise<Blob>} */
  async picture(type) {
    const view = Bokeh.index.roots.find((/** @type {any} */ root) => root.model.document === this.range.document);
    return view.export(type).to_blob();
  }
}
