// FRFs of parts that are joined at their hubs, from the parts' modes. No curve is stored: what is
// shown is solved line by line, so that a spring, the damping or a part may be changed at will.
//
// A part moves as u = Φ q, with D q = Φᵀ f,  D = ω_r² − ω² + jω (α + β ω_r²)  for every mode r.
// A joint holds δ = sᵀu back by λ = Z δ,  Z = k + jωc;  a rigid one keeps δ = 0. With the modes of
// set X (the free motions, hubs among them, and modes at their own resonance) kept as unknowns and
// the others summed, Y = Φ D⁻¹ Φᵀ,
//
//     [ SᵀYS + 1/Z   −SᵀΦ_X ] [ λ   ]   [ SᵀY e_j   ]
//     [ −Φ_XᵀS         −D_X ] [ q_X ] = [ −Φ_Xᵀ e_j ],      A x = b_j,
//
//     H_ij = e_iᵀ Y e_j − b_iᵀ A⁻¹ b_j.
//
// Nothing divides by the D of X: a hub of a few grams, a free part on a held one and an undamped
// pole of a single part cost no digits (they do where receptances are coupled).

/**
 * @typedef {{name: string, dofs: string[], omega: number[], shapes: number[][], rigid: number,
 *   dampers: {rows: number[], damping: number[][], stiffness: number[][]}}} Part
 * Modes of a part: shapes by DoF, the free motions first; rows that have dampers of their own,
 * their damping, and the stiffness beside it that has no β k.
 * @typedef {{name: string, terms: [string, number][], stiffness: number|null,
 *   damping: number|null}} Joint
 * δ as a sum of DoFs; stiffness null: rigid; damping null: β k.
 * @typedef {{name: string, parts: Part[], joints: Joint[],
 *   derived: Object<string, [string, number]>}} Route
 * @typedef {{alpha: number, beta: number, stiffness: Object<string, number>,
 *   scales: Object<string, {mass: number, stiffness: number}>}} Setting
 * Joints and parts that are not named are as modelled.
 * @typedef {{vector: Float64Array, stiffness: number, damping: number, rigid: boolean}} Link
 * A joint in modal coordinates.
 * @typedef {{omega: Float64Array, damping: Float64Array, free: boolean[], part: Int32Array,
 *   links: Link[], dof: (label: string) => Float64Array}} Assembly
 * All modes side by side, and a DoF's row of Φ.
 * @typedef {{re: Float64Array, im: Float64Array}} Curve
 */

const EPS = Number.EPSILON;
const NEAR = 1e-3; // |D| / (ω_r² + ω²) below which a mode is at its resonance

/**
 * All parts side by side, as a setting has them: K → s K and M → m M keep shapes but for their norm.
 * @param {Route} route
 * @param {Setting} setting
 * @returns {Assembly}
 */
function assemble(route, setting) {
  const count = route.parts.reduce((sum, part) => sum + part.omega.length, 0);
  const omega = new Float64Array(count), damping = new Float64Array(count);
  const part = new Int32Array(count), free = new Array(count).fill(false);
  /** @type {Map<string, Float64Array>} */
  const rows = new Map();
  /** @type {Link[]} */
  const links = [];
  let first = 0;
  route.parts.forEach((one, number) => {
    const { mass, stiffness } = setting.scales[one.name] ?? { mass: 1, stiffness: 1 };
    one.omega.forEach((value, mode) => {
      const square = (value * value * stiffness) / mass;
      omega[first + mode] = Math.sqrt(square);
      damping[first + mode] = setting.alpha + setting.beta * square;
      free[first + mode] = mode < one.rigid;
      part[first + mode] = number;
    });
    const still = stillness(one);
    one.dofs.forEach((label, row) => {
      const vector = new Float64Array(count);
      one.shapes[row].forEach((value, mode) => {
        if (Math.abs(value) > still[mode]) vector[first + mode] = value / Math.sqrt(mass);
      });
      rows.set(label, vector);
    });
    links.push(...ownDampers(one, rows, setting.beta, stiffness));
    first += one.omega.length;
  });
  /** @param {string} label */
  const dof = (label) => {
    const [of, factor] = route.derived[label] ?? [label, 1];
    const row = /** @type {Float64Array} */ (rows.get(of));
    return factor === 1 ? row : row.map((value) => factor * value);
  };
  for (const joint of route.joints) links.push(link(joint, dof, setting, count));
  return { omega, damping, free, part, links, dof };
}

/** What a mode's round-off is: a DoF that moves less is not moved by it. @param {Part} part */
function stillness(part) {
  return part.omega.map((_, mode) => {
    const largest = part.shapes.reduce((most, row) => Math.max(most, Math.abs(row[mode])), 0);
    return 16 * part.dofs.length * EPS * largest;
  });
}

/**
 * Dampers that are not β k, as joints to ground: C − β K of their rows by principal directions.
 * @param {Part} part
 * @param {Map<string, Float64Array>} rows
 * @param {number} beta
 * @param {number} scale
 * @returns {Link[]}
 */
function ownDampers(part, rows, beta, scale) {
  const { rows: own, damping, stiffness } = part.dampers;
  if (!own.length) return [];
  const excess = damping.map((line, i) =>
    Float64Array.from(line, (value, j) => value - beta * scale * stiffness[i][j]));
  const { values, vectors } = symmetricModes(excess);
  const limit = 16 * own.length * EPS * values.reduce((most, s) => Math.max(most, Math.abs(s)), 0);
  return [...values].flatMap((value, which) => {
    if (Math.abs(value) <= limit) return [];
    const vector = combination(own.map((row, i) =>
      [/** @type {Float64Array} */ (rows.get(part.dofs[row])), vectors[which][i]]));
    return [{ vector, stiffness: 0, damping: value, rigid: false }];
  });
}

/**
 * @param {Joint} joint
 * @param {(label: string) => Float64Array} dof
 * @param {Setting} setting
 * @param {number} count
 * @returns {Link}
 */
function link(joint, dof, setting, count) {
  const vector = combination(joint.terms.map(([label, factor]) => [dof(label), factor]));
  const stiffness = setting.stiffness[joint.name] ?? joint.stiffness ?? 0;
  const damping = joint.damping ?? setting.beta * stiffness;
  return { vector, stiffness, damping, rigid: joint.stiffness === null };
}

/** Σ factor · vector. @param {[Float64Array, number][]} terms */
function combination(terms) {
  const sum = new Float64Array(terms[0][0].length);
  for (const [vector, factor] of terms) {
    for (let k = 0; k < sum.length; k++) sum[k] += factor * vector[k];
  }
  return sum;
}

/**
 * The modes that two vectors share, and what each adds: one entry of SᵀYS, SᵀY e or e_iᵀ Y e_j.
 * @param {Assembly} assembly
 * @param {Float64Array} a
 * @param {Float64Array} b
 */
function residues({ omega, free }, a, b) {
  const modes = [], values = [];
  for (let mode = 0; mode < omega.length; mode++) {
    const value = a[mode] * b[mode];
    if (!free[mode] && value !== 0) {
      modes.push(mode);
      values.push(value);
    }
  }
  return { modes: Int32Array.from(modes), values: Float64Array.from(values) };
}

/**
 * Places of the unknowns, joints and free modes, neighbours beside each other, so that A is a band
 * where the parts are a chain: breadth first along what they share.
 * @param {Assembly} assembly
 * @param {Link[]} links
 * @param {number[][]} pairs of joints, those that share a mode among them
 * @returns {{place: Int32Array, rows: number}} by joint, then by mode
 */
function ordered({ omega, free }, links, pairs) {
  const joints = links.length, place = new Int32Array(joints + omega.length).fill(-1);
  /** @type {number[][]} */
  const beside = Array.from(place, () => []);
  for (const [a, b] of pairs) {
    if (a < joints && b < joints) {
      beside[a].push(b);
      beside[b].push(a);
    }
  }
  const modes = [...omega.keys()].filter((mode) => free[mode]);
  for (const mode of modes) {
    links.forEach(({ vector }, a) => {
      if (vector[mode] === 0) return;
      beside[a].push(joints + mode);
      beside[joints + mode].push(a);
    });
  }
  let rows = 0;
  for (const start of [...links.keys(), ...modes.map((mode) => joints + mode)]) {
    const queue = [start];
    for (let next = queue.shift(); next !== undefined; next = queue.shift()) {
      if (place[next] >= 0) continue;
      place[next] = rows++;
      queue.push(...beside[next]);
    }
  }
  return { place, rows };
}

/**
 * The receptance between two vectors of modal coordinates (rows of Φ), at frequencies in Hz; NaN
 * where nothing resists.
 * @param {Assembly} assembly
 * @param {Float64Array} response
 * @param {Float64Array} excitation
 * @param {ArrayLike<number>} frequency
 * @returns {Curve}
 */
function receptance(assembly, response, excitation, frequency) {
  const { omega, damping, free } = assembly;
  const links = assembly.links.filter((one) => one.rigid || one.stiffness || one.damping);
  const n = omega.length, joints = links.length;
  const vectors = [...links.map((one) => one.vector), response, excitation];
  const count = vectors.length, i = joints, j = joints + 1;
  // pairs of vectors with a mode in common; the entry of (response, response) is not asked for
  const pairs = [];
  for (let a = 0; a < count; a++) {
    for (let b = a; b < count; b++) {
      if (a >= joints && !(a === i && b === j)) continue;
      const { modes, values } = residues(assembly, vectors[a], vectors[b]);
      if (modes.length) pairs.push({ at: a * count + b, modes, values });
    }
  }
  const inverse = new Complex(n), y = new Complex(count * count), solver = new Solver(joints + n);
  const re = new Float64Array(frequency.length), im = new Float64Array(frequency.length);
  const kept = new Int32Array(n), isForce = new Uint8Array(joints + n);
  const { place, rows } = ordered(assembly, links, pairs.map(({ at }) => [Math.floor(at / count), at % count]));
  for (let a = 0; a < joints; a++) isForce[place[a]] = 1;
  for (let line = 0; line < frequency.length; line++) {
    const w = 2 * Math.PI * frequency[line];
    let explicit = 0;
    for (let mode = 0; mode < n; mode++) {
      const wr = omega[mode], p = (wr - w) * (wr + w), q = w * damping[mode];
      const size = p * p + q * q, limit = NEAR * (wr * wr + w * w);
      if (free[mode] || size < limit * limit) {
        kept[explicit++] = mode;
        inverse.re[mode] = inverse.im[mode] = 0;
      } else {
        inverse.re[mode] = p / size;
        inverse.im[mode] = -q / size;
      }
    }
    for (const { at, modes, values } of pairs) {
      let sumRe = 0, sumIm = 0;
      for (let k = 0; k < modes.length; k++) {
        sumRe += values[k] * inverse.re[modes[k]];
        sumIm += values[k] * inverse.im[modes[k]];
      }
      y.re[at] = sumRe;
      y.im[at] = sumIm;
    }
    // A, b_j and b_i: rows of joints and free modes by their places, then of other explicit modes
    let size = rows;
    for (let e = 0; e < explicit; e++) if (!free[kept[e]]) place[joints + kept[e]] = size++;
    solver.clear(size);
    for (let a = 0; a < joints; a++) {
      const row = place[a];
      for (let b = a; b < joints; b++) solver.both(row, place[b], y.re[a * count + b], y.im[a * count + b]);
      if (!links[a].rigid) {
        const k = links[a].stiffness, c = w * links[a].damping, square = k * k + c * c;
        solver.add(row, row, k / square, -c / square);
      }
      solver.right(row, y.re[a * count + j], y.im[a * count + j]);
      solver.left(row, y.re[a * count + i], y.im[a * count + i]);
    }
    for (let e = 0; e < explicit; e++) {
      const mode = kept[e], row = place[joints + mode], wr = omega[mode];
      for (let a = 0; a < joints; a++) solver.both(place[a], row, -vectors[a][mode], 0);
      solver.add(row, row, (w - wr) * (w + wr), -w * damping[mode]);
      solver.right(row, -excitation[mode], 0);
      solver.left(row, -response[mode], 0);
    }
    solver.equilibrate(isForce);
    const solved = solver.bilinear();
    re[line] = y.re[i * count + j] - solved[0];
    im[line] = y.im[i * count + j] - solved[1];
  }
  return { re, im };
}

/**
 * The receptance of every DoF at one frequency: the shape the drivetrain is forced into.
 * @param {Assembly} assembly
 * @param {string[]} labels
 * @param {string} excitation
 * @param {number} frequency
 * @returns {Curve}
 */
function forcedShape(assembly, labels, excitation, frequency) {
  const re = new Float64Array(labels.length), im = new Float64Array(labels.length);
  labels.forEach((label, k) => {
    const one = receptance(assembly, assembly.dof(label), assembly.dof(excitation), [frequency]);
    re[k] = one.re[0];
    im[k] = one.im[0];
  });
  return { re, im };
}

/** Derivatives of the displacement that a quantity is. @param {string} quantity */
const derivatives = (quantity) => ["receptance", "mobility", "accelerance"].indexOf(quantity);

/**
 * (jω)ⁿ times a curve.
 * @param {Curve} curve
 * @param {ArrayLike<number>} frequency
 * @param {number} n
 * @returns {Curve}
 */
function derived(curve, frequency, n) {
  let { re, im } = curve;
  for (let k = 0; k < Math.abs(n); k++) {
    const factor = Float64Array.from(frequency, (f) => (n > 0 ? 2 * Math.PI * f : -1 / (2 * Math.PI * f)));
    [re, im] = [im.map((value, line) => -value * factor[line]), re.map((value, line) => value * factor[line])];
  }
  return { re, im };
}
