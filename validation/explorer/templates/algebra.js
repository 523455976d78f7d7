// The little linear algebra that is needed: a small complex solution, and symmetric modes.

class Complex {
  /** @param {number} size */
  constructor(size) {
    this.re = new Float64Array(size);
    this.im = new Float64Array(size);
  }
}

/** xᵀ A⁻¹ b of a small complex symmetric A, by Gaussian elimination with partial pivoting. */
class Solver {
  /** @param {number} most */
  constructor(most) {
    this.most = most;
    this.size = 0;
    this.a = new Complex(most * (most + 1)); // its last column is b
    this.x = new Complex(most);
    this.scale = new Float64Array(most);
    this.end = new Int32Array(most); // of a row: behind its last entry that is not zero
    this.result = new Float64Array(2);
  }

  /** @param {number} size */
  clear(size) {
    this.size = size;
    this.a.re.fill(0, 0, size * (size + 1));
    this.a.im.fill(0, 0, size * (size + 1));
  }

  /** @param {number} row @param {number} column @param {number} re @param {number} im */
  add(row, column, re, im) {
    const at = row * (this.size + 1) + column;
    this.a.re[at] += re;
    this.a.im[at] += im;
  }

  /** An entry and its mirror image. @param {number} row @param {number} column @param {number} re @param {number} im */
  both(row, column, re, im) {
    this.add(row, column, re, im);
    if (row !== column) this.add(column, row, re, im);
  }

  /** @param {number} row @param {number} re @param {number} im */
  right(row, re, im) {
    this.add(row, this.size, re, im);
  }

  /** @param {number} row @param {number} re @param {number} im */
  left(row, re, im) {
    this.x.re[row] = re;
    this.x.im[row] = im;
  }

  /**
   * Scale rows and columns alike to entries of order one: forces by their own, motions also by what
   * the forces do to them.
   * @param {ArrayLike<number>} isForce by row
   */
  equilibrate(isForce) {
    const { size, a, x, scale } = this, width = size + 1;
    for (let row = 0; row < size; row++) {
      const own = row * width + row, most = Math.abs(a.re[own]) + Math.abs(a.im[own]);
      scale[row] = most > 0 ? 1 / Math.sqrt(most) : 1;
    }
    for (let row = 0; row < size; row++) {
      for (let column = 0; column < size && !isForce[row]; column++) {
        const most = Math.abs(a.re[row * width + column]) * scale[column];
        if (isForce[column] && most * scale[row] > 1) scale[row] = 1 / most;
      }
    }
    for (let row = 0; row < size; row++) {
      const own = scale[row], first = row * width;
      for (let column = 0; column < size; column++) {
        a.re[first + column] *= own * scale[column];
        a.im[first + column] *= own * scale[column];
      }
      a.re[first + size] *= own;
      a.im[first + size] *= own;
      let end = size;
      while (end > 0 && a.re[first + end - 1] === 0 && a.im[first + end - 1] === 0) end--;
      this.end[row] = end;
      x.re[row] *= scale[row];
      x.im[row] *= scale[row];
    }
  }

  /** xᵀ A⁻¹ b, real and imaginary part; NaN of a singular A. */
  bilinear() {
    const { size, a: { re, im }, x, end, result } = this, width = size + 1;
    for (let pivot = 0; pivot < size; pivot++) {
      let best = pivot, most = -1;
      for (let row = pivot; row < size; row++) {
        const at = row * width + pivot, value = Math.abs(re[at]) + Math.abs(im[at]);
        if (value > most) {
          best = row;
          most = value;
        }
      }
      if (!(most > 0)) return result.fill(NaN);
      if (best !== pivot) {
        exchange(re, pivot * width + pivot, best * width + pivot, width - pivot);
        exchange(im, pivot * width + pivot, best * width + pivot, width - pivot);
        exchange(end, pivot, best, 1);
      }
      const own = pivot * width + pivot, square = re[own] * re[own] + im[own] * im[own];
      const invRe = re[own] / square, invIm = -im[own] / square;
      for (let row = pivot + 1; row < size; row++) {
        const at = row * width + pivot;
        if (re[at] === 0 && im[at] === 0) continue;
        const fRe = re[at] * invRe - im[at] * invIm, fIm = re[at] * invIm + im[at] * invRe;
        if (end[row] < end[pivot]) end[row] = end[pivot];
        for (let from = own + 1, to = at + 1, last = pivot * width + end[pivot]; from < last; from++, to++) {
          const p = re[from], q = im[from];
          re[to] -= fRe * p - fIm * q;
          im[to] -= fRe * q + fIm * p;
        }
        const b = pivot * width + size, at_b = row * width + size;
        re[at_b] -= fRe * re[b] - fIm * im[b];
        im[at_b] -= fRe * im[b] + fIm * re[b];
      }
    }
    result.fill(0);
    for (let row = size - 1; row >= 0; row--) { // what is solved replaces b
      let sRe = re[row * width + size], sIm = im[row * width + size];
      for (let column = row + 1; column < end[row]; column++) {
        const at = row * width + column, b = column * width + size;
        sRe -= re[at] * re[b] - im[at] * im[b];
        sIm -= re[at] * im[b] + im[at] * re[b];
      }
      const own = row * width + row, square = re[own] * re[own] + im[own] * im[own];
      const vRe = (sRe * re[own] + sIm * im[own]) / square;
      const vIm = (sIm * re[own] - sRe * im[own]) / square;
      re[row * width + size] = vRe;
      im[row * width + size] = vIm;
      result[0] += x.re[row] * vRe - x.im[row] * vIm;
      result[1] += x.re[row] * vIm + x.im[row] * vRe;
    }
    return result;
  }
}

/** Exchange two stretches. @param {Float64Array|Int32Array} array @param {number} one @param {number} two @param {number} count */
function exchange(array, one, two, count) {
  for (let k = 0; k < count; k++) {
    const value = array[one + k];
    array[one + k] = array[two + k];
    array[two + k] = value;
  }
}

/**
 * Eigenvalues, ascending, and eigenvectors of a symmetric matrix, by Jacobi's rotations (Golub & Van
 * Loan 2013, Matrix Computations, sec. 8.5): a rotation zeroes a_pq with t = tan of its angle, the
 * smaller root of t² + 2 t (a_qq − a_pp)/(2 a_pq) − 1 = 0.
 * @param {Float64Array[]} matrix its rows; they are used up
 * @returns {{values: Float64Array, vectors: Float64Array[]}}
 */
function symmetricModes(matrix) {
  const n = matrix.length;
  const vectors = matrix.map((_, k) => Float64Array.from({ length: n }, (_, j) => (j === k ? 1 : 0)));
  for (let sweep = 0, turned = true; turned && sweep < 60; sweep++) {
    turned = false;
    for (let p = 0; p < n - 1; p++) {
      for (let q = p + 1; q < n; q++) {
        const a = matrix[p], b = matrix[q], off = a[q];
        if (Math.abs(off) <= EPS * Math.sqrt(Math.abs(a[p] * b[q]))) continue;
        turned = true;
        const theta = (b[q] - a[p]) / (2 * off);
        const t = (theta < 0 ? -1 : 1) / (Math.abs(theta) + Math.sqrt(theta * theta + 1));
        const c = 1 / Math.sqrt(t * t + 1), s = t * c, pp = a[p] - t * off, qq = b[q] + t * off;
        const v = vectors[p], w = vectors[q];
        for (let k = 0; k < n; k++) {
          const x = a[k], y = b[k], vx = v[k], vy = w[k];
          a[k] = c * x - s * y;
          b[k] = s * x + c * y;
          v[k] = c * vx - s * vy;
          w[k] = s * vx + c * vy;
        }
        for (let k = 0; k < n; k++) {
          matrix[k][p] = a[k];
          matrix[k][q] = b[k];
        }
        a[p] = pp;
        b[q] = qq;
        a[q] = b[p] = 0;
      }
    }
  }
  const order = [...matrix.keys()].sort((p, q) => matrix[p][p] - matrix[q][q]);
  return {
    values: Float64Array.from(order, (k) => matrix[k][k]),
    vectors: order.map((k) => vectors[k]),
  };
}
