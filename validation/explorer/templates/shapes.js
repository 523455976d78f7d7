// The drawing in motion: every group is shifted and turned as the drivetrain's DoFs move it.

/**
 * @typedef {[number, number][]} Row factors by DoF
 * @typedef {{dofs: string[], swing: number,
 *   bodies: {key: string, radius: number, rows: Row[]}[],
 *   meshes: {key: string, length: number, rows: Row[]}[]}} Motions
 */

class Player {
  /** @param {Element} drawing @param {Motions} motions */
  constructor(drawing, motions) {
    this.motions = motions;
    /** @param {{key: string}} one @returns {SVGElement[]} */
    const groups = (one) => /** @type {SVGElement[]} */ ([...drawing.querySelectorAll(`.mv.${one.key}`)]);
    this.bodies = motions.bodies.map((one) => ({ ...one, groups: groups(one) }));
    this.meshes = motions.meshes.map((one) => ({ ...one, groups: groups(one) }));
    /** @type {Float64Array} */
    this.re = new Float64Array(motions.dofs.length);
    this.im = this.re;
    this.largest = 1;
    this.playing = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.frame = 0;
  }

  /** Show re + j im, motions of the DoFs, to the scale of the largest. @param {Curve} shape */
  show({ re, im }) {
    const turned = phaseOfLargest(re, im); // where it stands still, it is at full swing
    this.re = re.map((value, k) => value * turned.c + im[k] * turned.s);
    this.im = im.map((value, k) => value * turned.c - re[k] * turned.s);
    this.largest = Math.hypot(this.reach(this.re), this.reach(this.im)) || 1;
    cancelAnimationFrame(this.frame);
    this.draw(0);
    if (this.playing) this.frame = requestAnimationFrame((now) => this.tick(now, now));
  }

  /** @param {number} now @param {number} start */
  tick(now, start) {
    this.draw(((now - start) / 1100) * Math.PI); // half a swing in 1.1 s, as in the report
    this.frame = requestAnimationFrame((next) => this.tick(next, start));
  }

  /** @param {boolean} playing */
  play(playing) {
    this.playing = playing;
    this.show({ re: this.re, im: this.im });
  }

  /** The largest translation or r·θ of any body. @param {Float64Array} motion */
  reach(motion) {
    return this.bodies.reduce((most, { radius, rows }) => {
      const [x, y, turn, axial, rocking] = rows.map((row) => along(row, motion));
      return Math.max(most, Math.hypot(x, y), Math.abs(turn) * radius, Math.abs(axial), Math.abs(rocking));
    }, 0);
  }

  /** The drawing at a phase of the swing. @param {number} phase */
  draw(phase) {
    const c = Math.cos(phase) / this.largest, s = Math.sin(phase) / this.largest;
    const motion = this.re.map((value, k) => value * c - this.im[k] * s);
    const { swing } = this.motions;
    for (const { groups, rows } of this.bodies) {
      const [x, y, turn, axial, rocking] = rows.map((row) => along(row, motion));
      place(groups, swing * x, swing * y, swing * turn, 0.16 * axial, 14 * rocking);
    }
    for (const { groups, length, rows } of this.meshes) {
      const [a, b, c2, d] = rows.map((row) => swing * along(row, motion));
      const long = length + c2 - a, wide = d - b;
      place(groups, a, b, Math.atan2(wide, long), Math.hypot(long, wide) / length - 1, 0);
    }
  }
}

/** @param {Row} row @param {Float64Array} motion */
function along(row, motion) {
  return row.reduce((sum, [dof, factor]) => sum + factor * motion[dof], 0);
}

/** @param {Float64Array} re @param {Float64Array} im */
function phaseOfLargest(re, im) {
  let at = 0;
  re.forEach((value, k) => { if (Math.hypot(value, im[k]) > Math.hypot(re[at], im[at])) at = k; });
  const size = Math.hypot(re[at], im[at]) || 1;
  return { c: re[at] / size, s: im[at] / size };
}

/**
 * @param {SVGElement[]} groups
 * @param {number} x @param {number} y @param {number} turn rad
 * @param {number} stretch @param {number} lean degrees
 */
function place(groups, x, y, turn, stretch, lean) {
  const transform = `translate(${x.toFixed(2)}px, ${y.toFixed(2)}px) rotate(${turn.toFixed(5)}rad) `
    + `scale(${(1 + stretch).toFixed(4)}) skewX(${lean.toFixed(3)}deg)`;
  for (const group of groups) group.style.transform = transform;
}
