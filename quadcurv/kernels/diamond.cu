// The passes of `rows` and `rings` on a device: the same sums in the same order, by the same formulas.
//
// Compile with --fmad=false. Where HOST is defined this is C++ for a processor, whose caller sets blockIdx and
// threadIdx: no thread waits for another one.
#ifdef HOST
#include <cmath>
#include <cstring>
#define DEVICE static inline
#define GLOBAL extern "C"
#define RESTRICT __restrict__
using std::fma;
struct place3 { unsigned x, y, z; };
static thread_local place3 blockIdx, blockDim, threadIdx;
DEVICE long long bits(double x) { long long b; std::memcpy(&b, &x, 8); return b; }
DEVICE double from_bits(long long b) { double x; std::memcpy(&x, &b, 8); return x; }
#else
#define DEVICE static __device__ __forceinline__
#define GLOBAL extern "C" __global__
#define RESTRICT __restrict__
DEVICE long long bits(double x) { return __double_as_longlong(x); }
DEVICE double from_bits(long long b) { return __longlong_as_double(b); }
#endif

struct triple { double x, y, z; };

// FORMULAS

DEVICE triple load(const double* RESTRICT p, long long i) { return {p[3 * i], p[3 * i + 1], p[3 * i + 2]}; }
DEVICE void store(double* p, long long i, triple a) { p[3 * i] = a.x; p[3 * i + 1] = a.y; p[3 * i + 2] = a.z; }

// Where results go; null where nobody wants them.
struct results { double *Hn, *H, *normal, *area; };

// Results at number k from the sum of fluxes, the square of the ring's normal, and the sum of the lengths of the
// normals of its quads.
DEVICE void finish(results out, long long k, triple flux, triple ring, double square, double lengths, int liu) {
  double own = ring_scale(square);
  triple h = times(flux, liu ? quads_scale(lengths) : own), n = times(ring, own);
  if (out.Hn) store(out.Hn, k, h);
  if (out.H) out.H[k] = -dot(h, n);
  if (out.normal) store(out.normal, k, n);
  if (out.area) out.area[k] = liu ? quads_area(lengths) : ring_area(square);
}

// A point of a grid; beyond its sides that of the other side, or NaN.
DEVICE triple grid_point(const double* RESTRICT p, long long i, long long j, long long rows, long long columns,
                         int wrap_rows, int wrap_columns) {
  bool inside = true;
  if (i < 0 || i >= rows) { inside = wrap_rows; i += i < 0 ? rows : -rows; }
  if (j < 0 || j >= columns) { inside = inside && wrap_columns; j += j < 0 ? columns : -columns; }
  if (inside) return load(p, i * columns + j);
  double nan = from_bits(0x7ff8000000000000ll);
  return {nan, nan, nan};
}

// What a quad gives to its vertices: its first one is a, then b, c, d around it.
struct quad_part { triple first, second; double length; };

DEVICE quad_part quad_of(triple a, triple b, triple c, triple d, double coarse) {
  quad_part q;
  triple u = less(c, a), v = less(d, b), n = cross(u, v), m;
  unit(n, known_square(n, u, v, a, coarse), m, q.length);
  fluxes(u, v, m, q.first, q.second);
  return q;
}

// A thread goes down WIDE columns, HIGH rows of them, and keeps the sums of the row above: a quad serves four vertices, of which those
// in columns of other threads compute it again.
GLOBAL void grid_curvatures(const double* RESTRICT p, long long rows, long long columns, int wrap_rows,
                            int wrap_columns, double coarse, int liu, double* Hn, double* H, double* normal,
                            double* area) {
  results out = {Hn, H, normal, area};
  long long across = (columns + WIDE * blockDim.x - 1) / (WIDE * blockDim.x);
  long long j = WIDE * (blockIdx.x % across * blockDim.x + threadIdx.x), begin = blockIdx.x / across * HIGH;
  long long end = begin + HIGH < rows ? begin + HIGH : rows;
  if (j >= columns || begin >= rows) return;
  // Points of the rows above, at and below; those of column j - 1 come first. Columns beyond the last but one more
  // are not there, nor wanted.
  triple above[WIDE + 2], here[WIDE + 2], below[WIDE + 2], part[WIDE];
  double both[WIDE];
  for (int k = 0; k < WIDE + 2; k++) {
    long long column = j + k - 1 <= columns ? j + k - 1 : columns;
    above[k] = grid_point(p, begin - 1, column, rows, columns, wrap_rows, wrap_columns);
    here[k] = grid_point(p, begin, column, rows, columns, wrap_rows, wrap_columns);
  }
  quad_part left = quad_of(above[0], here[0], here[1], above[1], coarse);
  for (int k = 0; k < WIDE; k++) {
    quad_part right = quad_of(above[k + 1], here[k + 1], here[k + 2], above[k + 2], coarse);
    part[k] = less(right.second, left.first);
    both[k] = right.length + left.length;
    left = right;
  }
  for (long long i = begin; i < end; i++) {
    for (int k = 0; k < WIDE + 2; k++) {
      long long column = j + k - 1 <= columns ? j + k - 1 : columns;
      below[k] = grid_point(p, i + 1, column, rows, columns, wrap_rows, wrap_columns);
    }
    left = quad_of(here[0], below[0], below[1], here[1], coarse);
    for (int k = 0; k < WIDE; k++) {
      quad_part right = quad_of(here[k + 1], below[k + 1], below[k + 2], here[k + 2], coarse);
      triple flux = plus(part[k], less(right.first, left.second));
      double lengths = right.length + left.length, sum = both[k] + lengths;
      both[k] = lengths;
      part[k] = less(right.second, left.first);
      left = right;
      triple a = less(below[k + 1], above[k + 1]), b = less(here[k + 2], here[k]), ring = cross(a, b);
      double square = known_square(ring, a, b, here[k + 1], coarse);
      if (j + k < columns) finish(out, i * columns + j + k, flux, ring, square, sum, liu);
    }
    for (int k = 0; k < WIDE + 2; k++) { above[k] = here[k]; here[k] = below[k]; }
  }
}

// Regular vertices of a face list from rings (n, 8); others are left alone.
GLOBAL void ring_curvatures(const double* RESTRICT p, const int* RESTRICT ring, long long n, double coarse, int liu,
                            double* Hn, double* H, double* normal, double* area) {
  long long v = blockIdx.x * (long long)blockDim.x + threadIdx.x;
  if (v >= n || ring[8 * v] < 0) return;
  triple c = load(p, v), edge[4], diagonal[4], flux[4];
  double length[4];
  for (int k = 0; k < 4; k++) {
    edge[k] = load(p, ring[8 * v + 2 * k]);
    diagonal[k] = load(p, ring[8 * v + 2 * k + 1]);
  }
  for (int k = 0; k < 4; k++) {
    triple u = less(diagonal[k], c), w = less(edge[(k + 1) % 4], edge[k]), m = cross(u, w), normal_of_quad;
    unit(m, known_square(m, u, w, c, coarse), normal_of_quad, length[k]);
    flux[k] = fused_cross(w, normal_of_quad);
  }
  triple a = less(edge[2], edge[0]), b = less(edge[3], edge[1]), m = cross(a, b);
  triple sum = plus(plus(flux[0], flux[1]), plus(flux[2], flux[3]));
  results out = {Hn, H, normal, area};
  double square = known_square(m, a, b, c, coarse);
  finish(out, v, sum, m, square, (length[0] + length[1]) + (length[2] + length[3]), liu);
}

// Rows of the stiffness matrix in CSR, nine entries each in the order of their columns, of regular vertices.
GLOBAL void ring_stiffness(const double* RESTRICT p, const int* RESTRICT ring, const int* RESTRICT indptr,
                           long long n, double coarse, int* indices, double* data) {
  long long v = blockIdx.x * (long long)blockDim.x + threadIdx.x;
  if (v >= n || ring[8 * v] < 0) return;
  triple c = load(p, v), edge[4], diagonal[4];
  int column[9];
  double own[4], mixed[4], weight[9];
  column[0] = (int)v;
  for (int k = 0; k < 4; k++) {
    column[2 * k + 1] = ring[8 * v + 2 * k];
    column[2 * k + 2] = ring[8 * v + 2 * k + 1];
    edge[k] = load(p, column[2 * k + 1]);
    diagonal[k] = load(p, column[2 * k + 2]);
  }
  for (int k = 0; k < 4; k++) {
    conductance(less(diagonal[k], c), less(edge[(k + 1) % 4], edge[k]), c, coarse, own[k], mixed[k]);
  }
  weight[0] = (own[0] + own[1]) + (own[2] + own[3]);
  for (int k = 0; k < 4; k++) {
    weight[2 * k + 1] = mixed[k] - mixed[(k + 3) % 4];
    weight[2 * k + 2] = -own[k];
  }
  for (int k = 0; k < 9; k++) {
    int rank = 0;
    for (int other = 0; other < 9; other++) rank += column[other] < column[k];
    indices[indptr[v] + rank] = column[k];
    data[indptr[v] + rank] = weight[k];
  }
}

// As many bytes, for a comparison.
GLOBAL void copy(const double* RESTRICT from, double* to, long long n) {
  long long i = blockIdx.x * (long long)blockDim.x + threadIdx.x;
  if (i < n) to[i] = from[i];
}
