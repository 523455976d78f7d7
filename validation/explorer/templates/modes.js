// Natural frequencies and mode shapes of the joined parts, undamped, as a setting has them.

/**
 * @typedef {{frequency: number, shape: Float64Array, shares: Float64Array}} NaturalMode
 * Hz; the shape in modal coordinates, of unit modal mass; shares of the kinetic energy by part.
 */

/**
 * diag(ω_r²) + Σ k s sᵀ in the modal coordinates, M = 1, with the rigid joints' coordinates taken
 * away by a reflection each: it turns what a joint ties into one coordinate, which is left out.
 * @param {Assembly} assembly
 * @param {number} parts
 * @param {number} freeMotions lowest modes that strain nothing: exactly 0 Hz
 * @returns {NaturalMode[]}
 */
function naturalModes(assembly, parts, freeMotions) {
  const { omega, links, part } = assembly, n = omega.length;
  const stiffness = Array.from(omega, (wr, k) => {
    const row = new Float64Array(n);
    row[k] = wr * wr;
    return row;
  });
  for (const { vector, stiffness: k } of links) {
    for (let a = 0; k && a < n; a++) {
      for (let b = 0; vector[a] && b < n; b++) stiffness[a][b] += k * vector[a] * vector[b];
    }
  }
  const mirrors = reflections(links.filter((one) => one.rigid).map((one) => one.vector), n);
  mirrors.forEach((mirror) => {
    stiffness.forEach((row) => reflect(mirror, row));
    for (let column = 0; column < n; column++) {
      const image = stiffness.map((row) => row[column]);
      reflect(mirror, image);
      image.forEach((value, row) => { stiffness[row][column] = value; });
    }
  });
  const tied = mirrors.length;
  const { values, vectors } = symmetricModes(stiffness.slice(tied).map((row) => row.slice(tied)));
  return [...values].map((value, number) => {
    const shape = Float64Array.from({ length: n }, (_, k) => (k < tied ? 0 : vectors[number][k - tied]));
    [...mirrors].reverse().forEach((mirror) => reflect(mirror, shape));
    const shares = new Float64Array(parts);
    shape.forEach((q, mode) => { shares[part[mode]] += q * q; });
    const square = number < freeMotions ? 0 : Math.max(value, 0);
    return { frequency: Math.sqrt(square) / (2 * Math.PI), shape, shares };
  });
}

/**
 * Householder's reflections (Golub & Van Loan 2013, sec. 5.1) that turn vector k into coordinate k.
 * @param {Float64Array[]} vectors
 * @param {number} n
 */
function reflections(vectors, n) {
  /** @type {Float64Array[]} */
  const mirrors = [];
  vectors.forEach((vector, k) => {
    const image = Float64Array.from(vector);
    mirrors.forEach((mirror) => reflect(mirror, image));
    image.fill(0, 0, k);
    const norm = Math.hypot(...image);
    if (norm === 0) return;
    image[k] += image[k] < 0 ? -norm : norm;
    const length = Math.hypot(...image);
    mirrors.push(image.map((value) => value / length));
  });
  return mirrors;
}

/** v − 2 m (mᵀv), in place. @param {Float64Array} mirror @param {Float64Array|number[]} vector */
function reflect(mirror, vector) {
  let along = 0;
  for (let k = 0; k < mirror.length; k++) along += mirror[k] * vector[k];
  for (let k = 0; k < mirror.length; k++) vector[k] -= 2 * along * mirror[k];
}

/**
 * Which of some modes each new one is: the one with most of its motion, sum over repeated ones.
 * @param {NaturalMode[]} modes
 * @param {NaturalMode[]} before
 * @returns {number[]}
 */
function matched(modes, before) {
  return modes.map(({ shape }) => {
    let best = 0, most = -1;
    before.forEach((other, number) => {
      let along = 0;
      for (let k = 0; k < shape.length; k++) along += shape[k] * other.shape[k];
      if (along * along > most) [best, most] = [number, along * along];
    });
    return best;
  });
}

/** A mode's motion of a DoF. @param {Float64Array} row of Φ @param {Float64Array} shape */
function motionOf(row, shape) {
  let sum = 0;
  for (let k = 0; k < row.length; k++) sum += row[k] * shape[k];
  return sum;
}
